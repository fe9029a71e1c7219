"""``palmares new``: what it makes plays."""

from __future__ import annotations

import ast
import itertools
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

from palmares.program import new  # noqa: E402


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env={**os.environ}
    )


def test_a_controller_of_every_task_and_hand_can_be_imported() -> None:
    for task, hand in itertools.product(sim.TASKS, sim.HANDS):
        files = new.project("crabs", task, hand)
        assert set(files) == {"controller.py", "test_controller.py", "README.md"}
        tree = ast.parse(files["controller.py"])
        # Only the constants and the functions: `decide` runs in the tests below.
        made: dict[str, object] = {"__name__": "controller"}
        exec(compile(tree, f"{task} {hand}", "exec"), made)
        assert (made["TASK"], made["HAND"]) == (task, hand)
        for text in files.values():
            assert re.search(r"\{\w+\}", text) is None, (task, hand)


@pytest.mark.parametrize("task", sim.TASKS)
def test_what_is_made_plays_as_it_is(task: str, tmp_path: Path) -> None:
    made = run(tmp_path, "-m", "palmares", "new", "crabs", "--task", task)
    assert made.returncode == 0, made.stderr
    assert "cd crabs" in made.stdout
    played = run(tmp_path / "crabs", "controller.py", "--url", "local", "--seed", "2", "--json", "--quiet")
    assert played.returncode == 0, played.stderr
    summary = json.loads(played.stdout)
    assert summary["seed"] == 2
    assert summary["sim_time_s"] > 1.0
    assert summary["score"] >= {"balls": 1.0, "grasp": 1.0, "pan": 2.0, "peg": 1.0}.get(task, 0.0)


def test_its_own_test_and_the_commands_of_its_readme_work(tmp_path: Path) -> None:
    folder = tmp_path / "crabs"
    assert (
        run(tmp_path, "-m", "palmares", "new", "crabs", "--task", "peg", "--hand", "reflex").returncode == 0
    )
    tested = run(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert tested.returncode == 0, tested.stdout
    evaluated = run(
        folder, "-m", "palmares", "evaluate", "controller.py", "--seeds", "1", "--json", "--quiet"
    )
    assert evaluated.returncode == 0, evaluated.stderr
    assert "--team crabs" in (folder / "README.md").read_text()


def test_an_existing_folder_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "crabs").mkdir()
    own = tmp_path / "crabs/controller.py"
    own.write_text("mine")
    refused = run(tmp_path, "-m", "palmares", "new", "crabs")
    assert refused.returncode == 1
    assert "crabs exists already" in refused.stderr
    assert [path.name for path in (tmp_path / "crabs").iterdir()] == ["controller.py"]
    assert own.read_text() == "mine"
    (tmp_path / "file").write_text("mine")
    assert "file exists already" in run(tmp_path, "-m", "palmares", "new", "file").stderr
    assert "letters, digits" in run(tmp_path, "-m", "palmares", "new", "a/b?").stderr
    assert "invalid choice: 'ball'" in run(tmp_path, "-m", "palmares", "new", "x", "--task", "ball").stderr


def test_the_program_lists_it() -> None:
    help_of_it = run(Path.cwd(), "-m", "palmares", "new", "--help").stdout
    assert "softhand_strong" in help_of_it
    assert "palmares new crabs" in help_of_it
