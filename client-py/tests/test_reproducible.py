"""Whatever decides a run has the same bits on every machine."""

from __future__ import annotations

import ast
import itertools
import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from palmares import reproducible
from palmares.reproducible import dot, dots, least_squares, matmul, mean, norm, normal, norms, total

PACKAGE = Path(__file__).parent.parent / "src/palmares"
BENCHMARK = Path(__file__).parent.parent / "benchmarks/processors.py"

DECIDING = (
    *(
        "skills",
        "examples",
        "design",
        "grasps",
        "gym",
        "sim",
        "analysis",
        "evaluate",
        "rotation.py",
        "cameras.py",
        "scene.py",
    ),
    *("targets.py", "clipping.py"),
)
"""Code that decides a run, or is printed on a page"""
LEFT_OUT = {
    "_grasp_runs.py": "worlds of the learners, thousands at once",
    "_training.py": "PyTorch",
    "train_grasp_success.py": "PyTorch",
    "train_grasp_cem.py": "a learner: its curve is of one machine",
    "train_grasp_tune.py": "Ray",
    "train_lift_sb3.py": "PyTorch",
    "train_lift_shaped.py": "PyTorch",
    "train_peg_reward.py": "PyTorch",
    "train_ppo_torch.py": "PyTorch",
    "plots.py": "figures for people",
    "realtime_hello.py": "it runs by the clock",
}
"""Files that may compute otherwise on another machine, and why: docs/training.md says so of learners"""
NUMPY = {
    # Types, constants and generators of random numbers.
    *(
        "bool_",
        "bytes_",
        "float32",
        "float64",
        "int32",
        "int64",
        "integer",
        "number",
        "str_",
        "uint8",
        "uint16",
        "uint64",
    ),
    *("dtype", "errstate", "generic", "inf", "nan", "ndarray", "ndim", "newaxis", "pi", "random", "s_"),
    # They place elements.
    *(
        "append",
        "arange",
        "array",
        "asarray",
        "ascontiguousarray",
        "atleast_1d",
        "atleast_2d",
        "broadcast_to",
    ),
    *("column_stack", "concatenate", "delete", "empty", "eye", "frombuffer", "full", "hstack"),
    *(
        "mgrid",
        "moveaxis",
        "nan_to_num",
        "ones",
        "ones_like",
        "pad",
        "ravel",
        "repeat",
        "split",
        "stack",
        "swapaxes",
    ),
    *("tile", "vstack", "where", "zeros", "zeros_like"),
    # They compute each element by itself, with operations that IEEE 754 rounds.
    *(
        "abs",
        "clip",
        "cross",
        "isfinite",
        "isin",
        "linspace",
        "maximum",
        "minimum",
        "outer",
        "round",
        "sign",
        "sqrt",
    ),
    # They add in order.
    *("bincount", "cumsum"),
    # They compare and select.
    *("all", "any", "argmax", "argmin", "argsort", "array_equal", "count_nonzero", "flatnonzero", "max"),
    *("min", "nanpercentile", "percentile", "unique"),
}
"""Names of NumPy that give the same bits everywhere"""
MATH = {"ceil", "floor", "fsum", "inf", "isfinite", "isnan", "nan", "pi", "prod", "radians", "sqrt"}
"""Names of `math` that do so: no others than these are exact or correctly rounded"""
METHODS = {"argsort", "cumsum", "dot", "mean", "prod", "std", "sum", "trace", "var"}
"""Methods of arrays that sum in an order of their own, or sort equal elements in any order"""


def differing(source: str) -> Iterator[str]:
    """Yield what a source has that differs between processors, C libraries or versions of Python."""
    for node in ast.walk(ast.parse(source)):
        line = f"line {getattr(node, 'lineno', 0)}"
        match node:
            case ast.BinOp(op=ast.MatMult()) | ast.AugAssign(op=ast.MatMult()):
                yield f"{line}: @"
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                whole = [isinstance(it, ast.Constant) and isinstance(it.value, int) for it in (left, right)]
                if not all(whole):
                    yield f"{line}: **"
            case ast.AugAssign(op=ast.Pow()):
                yield f"{line}: **"
            case ast.Call(
                func=ast.Attribute(value=ast.Name(id="np"), attr="argsort" as name), keywords=keywords
            ) if not any(ast.unparse(it) == "kind='stable'" for it in keywords):
                yield f"{line}: np.{name}"
            case ast.Attribute(value=ast.Name(id="np"), attr=name) if name not in NUMPY:
                yield f"{line}: np.{name}"
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if name not in MATH:
                yield f"{line}: math.{name}"
            case ast.Call(func=ast.Attribute(value=value, attr=name)) if name in METHODS:
                if not isinstance(value, ast.Name) or value.id not in ("np", "math"):
                    yield f"{line}: .{name}()"
            case ast.Call(func=ast.Name(id="sum")):
                yield f"{line}: sum()"
            case ast.Call(func=ast.Name(id="pow"), args=arguments) if len(arguments) < 3:
                yield f"{line}: pow()"
            case ast.ImportFrom(module="math" | "numpy" | "cmath" as module, names=names):
                for imported in names:
                    yield f"{line}: from {module} import {imported.name}"


def files() -> list[Path]:
    found = [PACKAGE / name for name in DECIDING]
    every = [path for place in found for path in (sorted(place.rglob("*.py")) if place.is_dir() else [place])]
    return [path for path in every if path.name not in LEFT_OUT]


@pytest.mark.parametrize("path", files(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_deciding_file_computes_the_same_everywhere(path: Path) -> None:
    assert not list(differing(path.read_text())), "see palmares.reproducible"


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("a @ b", "@"),
        ("a @= b", "@"),
        ("x**2", "**"),
        ("np.linalg.norm(x)", "np.linalg"),
        ("np.sin(x)", "np.sin"),
        ("math.cos(x)", "math.cos"),
        ("x.sum(axis=0)", ".sum()"),
        ("sum(x)", "sum()"),
        ("x.argsort()", ".argsort()"),
        ("np.argsort(x)", "np.argsort"),
        ("from math import sin", "from math import sin"),
    ],
)
def test_what_differs_is_found(source: str, found: str) -> None:
    assert list(differing(source)) == [f"line 1: {found}"]


def test_every_file_that_is_left_out_is_there() -> None:
    assert {path.name for path in PACKAGE.rglob("*.py")} >= LEFT_OUT.keys()


def test_what_new_makes_computes_the_same_everywhere() -> None:
    sim = pytest.importorskip("palmares.sim", reason="the package has no compiled part")
    from palmares.program import new

    for task, hand in itertools.product(sim.TASKS, ("softhand", "reflex")):
        assert not list(differing(new.project("crabs", task, hand)["controller.py"])), (task, hand)


def test_products_and_lengths_are_those_of_numpy() -> None:
    rng = np.random.default_rng(1)
    a, b, v = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    cloud = rng.normal(size=(5, 7, 3))
    assert matmul(a, v) == pytest.approx(a @ v)
    assert matmul(v, a) == pytest.approx(v @ a)
    assert matmul(a, b, v) == pytest.approx(a @ b @ v)
    assert matmul(cloud, a.T) == pytest.approx(cloud @ a.T)
    assert matmul(np.stack([a, b]), v) == pytest.approx(np.stack([a, b]) @ v)
    assert matmul(cloud[:0, 0], a).shape == (0, 3)
    assert dot(v, a[0]) == pytest.approx(v @ a[0])
    assert norm(v) == pytest.approx(np.linalg.norm(v))
    assert norms(cloud) == pytest.approx(np.linalg.norm(cloud, axis=-1))
    assert dots(cloud, v) == pytest.approx(cloud @ v)
    assert mean(cloud) == pytest.approx(cloud.mean(axis=0))
    with pytest.raises(ValueError, match=r"matmul: shapes \(3, 3\) and \(2,\) do not fit"):
        matmul(a, v[:2])


def test_a_sum_is_rounded_once() -> None:
    assert total([1.0, 1e100, 1.0, -1e100]) == 2.0
    assert total(np.full((2, 5), 0.1)) == 1.0


def test_least_squares_are_those_of_lapack() -> None:
    rng = np.random.default_rng(2)
    matrix, right = rng.normal(size=(80, 3)), rng.normal(size=80)
    assert least_squares(matrix, right) == pytest.approx(np.linalg.lstsq(matrix, right, rcond=None)[0])
    with pytest.raises(ValueError, match="columns of the matrix depend on each other"):
        least_squares(np.ones((5, 2)), np.ones(5))


def test_normal_numbers_have_the_moments_of_the_distribution() -> None:
    drawn = normal(np.random.default_rng(3), 200, 100)
    assert drawn.shape == (200, 100)
    assert drawn.mean() == pytest.approx(0.0, abs=0.03)
    assert drawn.std() == pytest.approx(1.0, abs=0.02)
    assert (np.abs(drawn) < 1.0).mean() == pytest.approx(0.6827, abs=0.01)


def test_functions_are_those_of_the_engine() -> None:
    native = pytest.importorskip(
        "palmares._native", reason="the compiled part of the package is not installed"
    )
    for name in ("sin", "cos", "tan", "asin", "acos", "atan2", "exp", "log"):
        ours, arguments = getattr(reproducible, name), (0.7, 0.3)[: 2 if name == "atan2" else 1]
        assert ours is getattr(native, name)
        assert ours(*arguments) == pytest.approx(getattr(math, name)(*arguments), rel=1e-15)


def test_runs_are_the_same_on_other_processors() -> None:
    pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    names = ("balls_sensors", "grasp_arm", "grasp_sensors", "shelf_softhand")
    command = [sys.executable, str(BENCHMARK), "--sim-s", "2"]
    command += [word for name in names for word in ("--only", name)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    print(done.stdout)
    if "shows nothing" in done.stdout:
        pytest.skip(done.stdout)
    assert done.stdout.count(f": {len(names)} of {len(names)} ") >= 3
