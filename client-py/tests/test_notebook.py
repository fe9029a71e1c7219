"""The notebook for the first steps: its cells run in their order, and each shows something."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

from palmares.views import LONGEST

pytest.importorskip("palmares._native", reason="the compiled part of the package is not there")
pytest.importorskip("matplotlib", reason="matplotlib is not installed")

NOTEBOOK = Path(__file__).parents[2] / "docs/examples/first_steps.ipynb"


def run_cell(code: str, names: dict[str, Any]) -> Any:
    """Run a cell; return the value of its last line, as a notebook shows it."""
    tree = ast.parse(code)
    last = tree.body[-1]
    if not isinstance(last, ast.Expr):
        exec(compile(tree, "cell", "exec"), names)
        return None
    exec(compile(ast.Module(tree.body[:-1], []), "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def test_the_first_steps_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    codes = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert all(cell.get("outputs", []) == [] for cell in cells)
    names: dict[str, Any] = {}
    pictures = 0
    for code in codes:
        value = run_cell(code, names)
        if value is not None:
            assert len(repr(value)) <= LONGEST, code
            pictures += hasattr(value, "_repr_png_") and value._repr_png_().startswith(b"\x89PNG")
    assert pictures == 3, "the world, the camera and the figure"
    # The hand came down on the object.
    assert abs(names["arrays"]["finger_force"]).max() > 1.0
    assert (tmp_path / "run.mcap").exists()


def test_the_notebook_is_small_and_has_no_outputs() -> None:
    assert NOTEBOOK.stat().st_size < 10_000
    assert "execution_count" in NOTEBOOK.read_text()
    assert '"output_type"' not in NOTEBOOK.read_text()
