"""``palmares demo``."""

import dataclasses
import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

from palmares.program import demo
from tests.real_server import PROGRAM, needs_server


@needs_server
def test_it_plays_a_run_and_keeps_the_replay(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "palmares", "demo", "--task", "grasp", "--seed", "2", "--json"]
    done = subprocess.run(
        [*command, "--program", str(PROGRAM), "--replay", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    outcome = json.loads(done.stdout)
    assert outcome["leaderboard"][0]["tasks"]["grasp"]["score"] == outcome["score"]
    assert Path(outcome["replay"]).stat().st_size > 0
    assert "/live" in done.stderr
    verified = subprocess.run([str(PROGRAM), "verify", outcome["replay"]], capture_output=True, check=False)
    assert verified.returncode == 0


def test_a_wrong_program_is_an_error(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "palmares", "demo", "--program", "/bin/false"]
    done = subprocess.run(
        [*command, "--replay", str(tmp_path)], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode == 1
    assert "`/bin/false serve" in done.stderr
    assert "does not start" in done.stderr


@pytest.mark.parametrize(("in_b", "words"), [(0, "0 balls in"), (1, "1 ball in"), (2, "2 balls in")])
def test_one_object_is_in_the_singular(in_b: int, words: str) -> None:
    outcome = {"score": 1.0, "balls_in_b": in_b, "run_id": "run_1", "sim_time_s": 1.0, "rtf": 1.0}
    said = demo.in_words("balls", outcome, [], Path("run_1.mcap"))
    assert f": {words} box B, run run_1" in said


def test_every_task_has_a_demo() -> None:
    sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
    assert set(demo.CONTROLLERS) == set(sim.TASKS)
    for task, (module, field, *_) in demo.CONTROLLERS.items():
        found = importlib.import_module(f"palmares.examples.{module}")
        (summary,) = (it for it in vars(found).values() if isinstance(it, type) and field in _fields(it))
        assert summary is not None, task
    outcome = {"score": 8.0, "goals": ["lid_lifted at 3.1 s", "lid_aside at 9 s"], "run_id": "run_1"}
    said = demo.in_words("pan", {**outcome, "sim_time_s": 1.0, "rtf": 1.0}, [], Path("run_1.mcap"))
    assert "score 8: 2 goals reached, run run_1" in said


def _fields(kind: type) -> set[str]:
    return {it.name for it in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
