"""The examples that play balls, and the short ones."""

from __future__ import annotations

import importlib.util
import itertools
import math
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.rotation import angle_between
from palmares.skills.attempts import Attempt
from palmares.skills.motion import BaseLimits
from tests.fake_server import FakeServer

EXAMPLES = Path(__file__).parent.parent / "src/palmares/examples"
BOX = palmares.Region(name="box_a", min=(-0.25, -0.25, 0.0), max=(0.25, 0.25, 0.3))


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # Dataclasses look up their annotations here.
    spec.loader.exec_module(module)
    return module


balls = load("balls_softhand")
reflex = load("balls_reflex")
grasp = load("grasp_softhand")


def test_first_steps_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with FakeServer() as server:
        monkeypatch.setattr(sys, "argv", ["first_steps.py", "--url", server.url])
        load("first_steps").main()
    assert "score 0 (practice, stopped)" in capsys.readouterr().out


def test_realtime_hello_runs(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with FakeServer(ticks=250) as server:
        monkeypatch.setattr(sys, "argv", ["realtime_hello.py", "--url", server.url])
        load("realtime_hello").main()
    printed = capsys.readouterr().out
    assert "of 250 observations" in printed
    assert "score 0 (practice, stopped)" in printed


def test_a_lone_ball_in_the_middle_has_room() -> None:
    alone = np.array([[0.0, 0.0, 0.05]])
    choice = balls.SoftHand.choose(alone, [0], 0.05, BOX, [])
    assert choice is not None
    assert choice.room_m == 0.0


def test_the_hand_comes_from_the_free_side() -> None:
    # For a ball at the +x wall the hand's base must be on its -x side.
    by_the_wall = np.array([[0.19, 0.0, 0.05]])
    choice = balls.SoftHand.choose(by_the_wall, [0], 0.05, BOX, [])
    assert choice is not None
    base = balls.GRASP.base_position(by_the_wall[0], balls.GRASP.rotation(choice.yaw_rad))
    assert base[0] < by_the_wall[0, 0]


def test_a_neighbour_costs_room_on_its_side() -> None:
    two = np.array([[0.0, 0.0, 0.05], [0.101, 0.0, 0.05]])
    choice = balls.SoftHand.choose(two, [0], 0.05, BOX, [])
    assert choice is not None
    assert math.cos(choice.yaw_rad) < 0.99  # not straight over the neighbour


def test_a_failure_turns_the_hand_and_four_give_up() -> None:
    alone = np.array([[0.0, 0.0, 0.05]])
    tried: list[Any] = []
    for _ in range(balls.SoftHand.tries):
        choice = balls.SoftHand.choose(alone, [0], 0.05, BOX, tried)
        assert choice is not None
        assert all(math.cos(choice.yaw_rad - attempt.yaw_rad) < 0.9 for attempt in tried)
        tried.append(Attempt(0, alone[0], choice.yaw_rad, choice.grasp.name))
    assert balls.SoftHand.choose(alone, [0], 0.05, BOX, tried) is None
    moved = alone + np.array([0.02, 0.0, 0.0])
    assert balls.SoftHand.choose(moved, [0], 0.05, BOX, tried) is not None


def test_no_ball_no_choice() -> None:
    assert balls.SoftHand.choose(np.zeros((0, 3)), [], 0.05, BOX, []) is None


def test_targets_stay_within_the_base_limits() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        summary = balls.run(client, seed=1, picks=3)
        limits, tick_s = BaseLimits.of(client.welcome.specs), client.run.tick_s
        assert summary.picks == 3
        assert summary.caught == 0
        targets = [
            request["action"]["base"]
            for request in server.requests
            if request["op"] == "step" and "base" in request["action"]
        ]
    position = np.array([target["position"] for target in targets])
    velocity = np.diff(position, axis=0) / tick_s
    acceleration = np.diff(velocity, axis=0) / tick_s
    assert np.linalg.norm(velocity, axis=1).max() < limits.speed_m_s
    assert np.linalg.norm(acceleration, axis=1).max() < limits.acceleration_m_s2
    quats = [target["quat_xyzw"] for target in targets]
    turns = [angle_between(a, b) for a, b in itertools.pairwise(quats)]
    assert max(turns) / tick_s < limits.angular_speed_rad_s


def test_the_reflex_closes_along_the_wall() -> None:
    by_the_wall = np.array([[0.195, 0.0, 0.05]])
    plan = reflex.Reflex.choose(by_the_wall, [0], 0.05, BOX, [])
    assert plan is not None
    assert plan.room_m > 0.005
    # Fingers 1 and 2 are at +x of the hand, where the wall is; the housing is on the other side.
    assert plan.rotation[0, 0] > 0.8
    assert plan.at[0] < by_the_wall[0, 0]


def test_the_reflex_fits_into_a_corner_next_to_another_ball() -> None:
    two = np.array([[0.195, 0.195, 0.05], [0.095, 0.195, 0.05]])
    plan = reflex.Reflex.choose(two, [0, 1], 0.05, BOX, [])
    assert plan is not None
    assert plan.room_m > -0.005


def test_the_reflex_changes_grasp_or_direction_after_a_failure() -> None:
    alone = np.array([[0.0, 0.0, 0.05]])
    tried: list[Any] = []
    for _ in range(reflex.Reflex.tries):
        plan = reflex.Reflex.choose(alone, [0], 0.05, BOX, tried)
        assert plan is not None
        again = [t for t in tried if t.grasp == plan.grasp.name and math.cos(t.yaw_rad - plan.yaw_rad) > 0.95]
        assert not again
        tried.append(Attempt(0, alone[0], plan.yaw_rad, plan.grasp.name))
    assert reflex.Reflex.choose(alone, [0], 0.05, BOX, tried) is None


def test_the_reflex_brings_two_balls() -> None:
    with palmares.Client("local") as client:
        summary = reflex.run(client, seed=1, picks=2)
    assert (summary.picks, summary.balls_in_b, summary.score) == (2, 2, 2.0)


def test_the_grasp_depends_on_the_size() -> None:
    first = {
        "apple": grasp.grasps_for((0.075, 0.075, 0.075), 0.07)[0],
        "coffee can": grasp.grasps_for((0.102, 0.102, 0.139), 0.41)[0],
        "fork": grasp.grasps_for((0.198, 0.024, 0.014), 0.03)[0],
        "cracker box": grasp.grasps_for((0.158, 0.06, 0.21), 0.41)[0],
    }
    assert len({(how.name, turn_rad) for how, turn_rad in first.values()}) == len(first)


@pytest.mark.parametrize("seed", [101, 102, 103, 104, 105])
def test_the_grasp_holds_through_the_shake(seed: int) -> None:
    with palmares.Client("local") as client:
        summary = grasp.run(client, seed)
    assert summary.kept == 1
    assert summary.score > 9.5
