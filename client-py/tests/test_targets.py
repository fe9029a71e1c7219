"""Forms of targets that are accepted, and the errors for others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import palmares
from palmares import targets
from tests.fake_server import FakeServer

action_of: Any = targets.action_of
pose: Any = palmares.pose
twist: Any = palmares.twist
POSE = palmares.pose([1, 2, 3], [0, 0, 0, 1])


@pytest.mark.parametrize(
    "base",
    [
        POSE,
        ([1, 2, 3], [0, 0, 0, 1]),
        [np.array([1.0, 2.0, 3.0]), (0, 0, 0, 1)],
        (1, 2, 3, 0, 0, 0, 1),
        np.array([1, 2, 3, 0, 0, 0, 1]),
        np.array([1, 2, 3, 0, 0, 0, 1], dtype=np.float32),
        iter([1, 2, 3, 0, 0, 0, 1]),
    ],
)
def test_a_pose_is_accepted_in_every_reasonable_form(base: Any) -> None:
    assert action_of(base, None, 1).base == POSE


@pytest.mark.parametrize(
    "hand",
    [0.5, np.float32(0.5), np.array(0.5), [0.5], (0.5,), np.array([0.5]), np.int64(1) / 2, iter([0.5])],
)
def test_one_motor_accepts_a_number(hand: Any) -> None:
    assert action_of(None, hand, 1).hand == [0.5]


def test_of_several_motors_each_has_its_number() -> None:
    assert action_of(None, np.array([0, 1, 0.5, 1]), 4).hand == [0.0, 1.0, 0.5, 1.0]
    assert action_of(None, 0, 1).hand == [0.0]
    assert action_of(None, 0.2, 1, 0.5).effort == [0.5]
    assert action_of(None, None, 2).effort is None


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (
            lambda: action_of(None, 0.5, 4),
            r"hand: found the single number 0.5; wanted shape \(4,\): σ of every",
        ),
        (
            lambda: action_of(None, [0.1, 0.2], 1),
            r"hand: found shape \(2,\); wanted shape \(1,\): σ of the motor",
        ),
        (
            lambda: action_of(None, None, 2, 0.5),
            r"effort: found the single number 0.5; .*the effort of every",
        ),
        (lambda: action_of(None, np.zeros((1, 1)), 1), r"hand: found shape \(1, 1\)"),
        (lambda: action_of(None, "0.5", 1), r"hand: found str '0.5'"),
        (lambda: action_of(None, ["open"], 1), r"hand: found list \['open'\], which are not numbers"),
        (lambda: action_of(None, object(), 1), r"hand: found \w+ .*not numbers"),
        (lambda: pose([0, 0, 1], [0, 0, 1]), r"quat_xyzw: found shape \(3,\); wanted shape \(4,\)"),
        (lambda: pose(1.0, [0, 0, 0, 1]), r"position: found the single number 1.0; .*\(3,\)"),
        (lambda: twist([0, 0], [0, 0, 0]), r"linear: found shape \(2,\)"),
        (lambda: twist([0, 0, 0], [[0, 0, 0]]), r"angular: found shape \(1, 3\)"),
        (lambda: action_of([0, 0, 1], None, 1), r"base: found shape \(3,\); wanted shape \(7,\)"),
        (lambda: action_of(np.eye(4), None, 1), r"base: found shape \(4, 4\)"),
        (lambda: action_of(([0, 0, 1], [0, 0, 1]), None, 1), r"base: quat_xyzw: found shape \(3,\)"),
        (
            lambda: action_of({"linear": [0, 0, 1], "angular": [0, 0, 0]}, None, 1),
            r"base: found a dictionary with linear, angular; wanted palmares\.twist",
        ),
        (lambda: action_of(0.5, None, 1), r"base: found the single number 0.5; wanted shape \(7,\)"),
        (lambda: action_of([[1], [2, 3], 4], None, 1), r"base: found list .*not numbers"),
    ],
)
def test_an_invalid_target_is_named_with_both_shapes(act: Callable[[], Any], message: str) -> None:
    with pytest.raises(palmares.BadActionError, match=message):
        act()


def test_the_client_accepts_them_and_an_invalid_one_changes_nothing() -> None:
    with FakeServer() as server, palmares.Client(server.url) as client:
        client.reset("balls", "softhand")
        assert client.step(base=([0, 0, 0.5], (0, 0, 0, 1)), hand=0.5).tick == 1
        with pytest.raises(palmares.BadActionError, match="hand"):
            client.step(hand=[0.5, 0.5])
        with pytest.raises(palmares.BadActionError, match="force"):
            client.perturb("palm", force=[0, 0])
        assert client.step(hand=np.array([0.25])).tick == 2
        steps = [request["action"] for request in server.requests if request["op"] == "step"]
    assert [step["hand"] for step in steps] == [[0.5], [0.25]]
    assert steps[0]["base"] == {"position": [0.0, 0.0, 0.5], "quat_xyzw": [0.0, 0.0, 0.0, 1.0]}
