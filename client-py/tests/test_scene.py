"""Bodies and regions of a scene."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import palmares
from tests.fake_server import BALLS, SCENE


@pytest.fixture
def scene() -> palmares.Scene:
    furniture = {**SCENE["bodies"][0], "id": 3, "name": "box_a", "free": False, "mass": 0.0}
    return msgspec.convert({**SCENE, "bodies": [*SCENE["bodies"], furniture], "news": 1}, palmares.Scene)


def test_bodies_by_name(scene: palmares.Scene) -> None:
    assert scene.body("ball_1").xyz == pytest.approx(BALLS[1])
    assert np.array_equal(scene.body("ball_1").rotation, np.eye(3))
    assert [body.name for body in scene.free] == ["ball_0", "ball_1", "ball_2"]
    assert [body.name for body in scene.furniture] == ["box_a"]
    with pytest.raises(KeyError, match="no body 'shelf'; there are: ball_0, ball_1, ball_2, box_a"):
        scene.body("shelf")


def test_regions_by_name_and_by_role(scene: palmares.Scene) -> None:
    assert scene.start is scene.region("box_a")
    assert scene.goal is scene.region("box_b")
    assert scene.region("box_b").center == pytest.approx([0.7, 0.0, 0.15])
    assert scene.region("box_b").size == pytest.approx([0.5, 0.5, 0.3])
    assert scene.region("box_b").contains(scene.region("box_b").center)
    assert not scene.region("box_b").contains(scene.region("box_a").center)
    with pytest.raises(KeyError, match="there are: box_a, box_b"):
        scene.region("lid")


def test_a_scene_of_an_older_server(scene: palmares.Scene) -> None:
    for region in scene.regions:
        region.role = None
    assert scene.start is None
    assert scene.goal is None
