"""The record of a measured page, by `benchmarks/record.py`."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

pytest.importorskip("palmares._native", reason="the compiled part of the package is not there")
from palmares.sim import identity

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def record() -> ModuleType:
    path = ROOT / "client-py/benchmarks/record.py"
    spec = importlib.util.spec_from_file_location("record", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["record"] = module
    spec.loader.exec_module(module)
    return module


def test_the_engine_is_that_of_the_golden_runs() -> None:
    golden = [(ROOT / f"tasks/golden/{name}.txt").read_text().strip() for name in ("balls_5s", "pinch_2s")]
    known = identity()
    assert known.engine.split(".")[:2] == golden
    for hashes, name in ((known.hands, "softhand"), (known.tasks, "balls")):
        assert re.fullmatch(r"[0-9a-f]{64}", hashes[name])


def test_the_digest_of_controllers_is_that_of_palmares_bench(record: ModuleType, tmp_path: Path) -> None:
    # The folder and the digest are those of the test in bench/src/record/models.rs.
    (tmp_path / "skills").mkdir()
    for name, text in (
        ("a.py", "one\n"),
        ("skills/c.py", "σ\n"),
        ("skills/b.py", "two\n"),
        ("skills/d.txt", "-"),
    ):
        (tmp_path / name).write_text(text)
    assert record.controllers(tmp_path, ["a.py", "skills"]) == "e0e1f027098d"


def test_a_line_has_engine_models_commit_day_and_machine(record: ModuleType) -> None:
    line = record.line(record.fields("grasped"))
    form = (
        r"Engine [0-9a-f.]+; controllers [0-9a-f]{12}; hand softhand [0-9a-f]{12}; task grasp [0-9a-f]{12}; "
        r"commit \S+; \d{4}-\d\d-\d\d; .+, \d+ threads, \w+ \w+\."
    )
    assert re.fullmatch(form, line), line


def test_a_page_of_which_some_rows_are_old_keeps_its_record(record: ModuleType, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    now = record.line(record.fields("grasped"))
    assert record.of_page(page, "grasped", whole=False) == now, "a new page"
    old = "Engine 0a; commit 1; 2026-01-01; here."
    for mark in ("", "# "):
        page.write_text(f"# Page\n\n{mark}{old}\n")
        assert record.of_page(page, "grasped", whole=False) == old
        assert record.of_page(page, "grasped", whole=True) == now
    page.write_text(now.replace("commit ", "commit earlier"))
    assert record.of_page(page, "grasped", whole=False) == now
