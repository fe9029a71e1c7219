"""A scene in which the poses of the objects are hidden."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import palmares
from palmares.errors import error_of
from tests.fake_server import SCENE


def test_the_poses_of_objects_may_be_hidden() -> None:
    hidden = [
        {k: v for k, v in body.items() if k not in {"position", "quat_xyzw"}} for body in SCENE["bodies"]
    ]
    box = {**SCENE["bodies"][0], "id": 3, "name": "box_a", "free": False, "mass": 0.0}
    scene = msgspec.convert({**SCENE, "bodies": [*hidden, box]}, palmares.Scene)
    for body in scene.free:
        assert body.position is None
        assert body.quat_xyzw is None
        with pytest.raises(ValueError, match="sensors"):
            _ = body.xyz
        with pytest.raises(ValueError, match=body.name):
            _ = body.rotation
    assert np.array_equal(scene.body("box_a").xyz, box["position"])
    assert np.array_equal(scene.body("box_a").rotation, np.eye(3))


def test_a_hand_in_the_way_has_its_own_exception() -> None:
    error = error_of("hand_in_the_way", "it touches an object")
    assert isinstance(error, palmares.HandInTheWayError)


def test_the_greeting_has_the_cost_of_a_reset() -> None:
    sent = {"name": "Cup", "mode": "official", "session_s": 1800.0, "reset_cost_s": 10.0, "news": 1}
    assert msgspec.convert(sent, palmares.Competition).reset_cost_s == 10.0
    assert (
        msgspec.convert(
            {"name": "old", "mode": "practice", "session_s": None}, palmares.Competition
        ).reset_cost_s
        == 0
    )
