"""``palmares new``: what it makes plays."""

from __future__ import annotations

import ast
import itertools
import json
import os
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

from palmares.program import new  # noqa: E402


def run(folder: Path, *arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, **variables}
    )


STARTS = [pair for pair in itertools.product(sim.TASKS, sim.HANDS) if new.can_start(*pair)]


def test_a_controller_of_every_task_and_hand_can_be_imported() -> None:
    for task, hand in STARTS:
        files = new.project("crabs", task, hand)
        assert set(files) == {"controller.py", "test_controller.py", "README.md"}
        tree = ast.parse(files["controller.py"])
        # Only the constants and the functions: `decide` runs in the tests below.
        made: dict[str, object] = {"__name__": "controller"}
        exec(compile(tree, f"{task} {hand}", "exec"), made)
        assert (made["TASK"], made["HAND"]) == (task, hand)
        for text in files.values():
            assert re.search(r"\{\w+\}", text) is None, (task, hand)


def test_what_a_start_scores_is_said(tmp_path: Path) -> None:
    made = run(tmp_path, "-m", "palmares", "new", "crabs", "--task", "peg", "--hand", "leap")
    assert made.returncode == 0, made.stderr
    assert "As it is, it scores 1 of 10 points in scene 1. Much of the task is left to you" in made.stdout
    (tmp_path / "eels").mkdir()
    (tmp_path / "eels/controller.py").write_text("raise ArithmeticError('no')")
    with pytest.raises(new.StartError, match="ArithmeticError: no"):
        new.tried(tmp_path / "eels", "peg")


def test_a_hand_without_a_grip_for_the_task_is_refused(tmp_path: Path) -> None:
    refused = run(tmp_path, "-m", "palmares", "new", "crabs", "--task", "pan", "--hand", "pinch")
    assert refused.returncode == 1
    assert "no grip of pinch for a knob or handle is known" in refused.stderr
    assert "--hand with one: softhand, " in refused.stderr
    assert not (tmp_path / "crabs").exists()


@pytest.mark.parametrize("name", ["équipe", "e\u0301quipe", "हिन्दी", "蟹"])
def test_a_folder_can_have_letters_of_any_language(name: str, tmp_path: Path) -> None:
    for folder, variables in ((f"{name}1", {}), (f"{name}2", {"PYTHONIOENCODING": "ascii"})):
        made = run(tmp_path, "-m", "palmares", "new", folder, "--untried", **variables)
        assert made.returncode == 0, made.stderr
        team = unicodedata.normalize("NFC", folder)
        assert f"--team {team}" in (tmp_path / folder / "README.md").read_text(encoding="utf-8")
    assert "letters, digits" in run(tmp_path, "-m", "palmares", "new", "🦀").stderr


@pytest.mark.parametrize("task", sim.TASKS)
def test_what_is_made_plays_as_it_is(task: str, tmp_path: Path) -> None:
    made = run(tmp_path, "-m", "palmares", "new", "crabs", "--task", task, "--untried")
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
