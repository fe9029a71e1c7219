"""Readings of the sensors and images of the cameras, over a real socket."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import pytest
from gymnasium import spaces

import palmares
from palmares.gym import PalmaresEnv
from palmares.skills.objects import largest_radius, object_bounds
from tests.real_server import RealServer, needs_server

pytestmark = needs_server


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


def test_a_depth_picture_shows_the_balls_where_they_are(url: str) -> None:
    with palmares.Client(url) as client:
        obs = client.reset("balls", "softhand", seed=7, cameras=["box_a", "box_a.bodies", "box_a.rgb"])
        image = obs.cameras["box_a"]
        assert image.tick == 0
        assert image.depth.shape == image.bodies.shape == (240, 320)
        assert image.rgb.shape == (240, 320, 3)
        points = image.points()
        assert obs.truth is not None
        count = 0
        for body, state in zip(client.scene.free, obs.truth.objects, strict=True):
            shown = image.bodies == body.id
            if np.count_nonzero(shown) < 50:
                continue
            count += 1
            radius = body.parts[0].shape.radius
            assert radius is not None
            # The points are on the sphere, to half a step of depth.
            away = np.linalg.norm(points[shown] - np.array(state.position), axis=1)
            assert np.abs(away - radius).max() < 0.6 * image.depth_unit
            # Its pixels are around its projection.
            u, v = image.pixel(state.position)
            rows, columns = np.nonzero(shown)
            assert np.hypot(columns + 0.5 - u, rows + 0.5 - v).max() < 1.1 * image.fx * radius / 0.9
        assert count >= 5


@pytest.mark.parametrize("noise", ["none", "real"])
def test_both_encodings_bring_the_same_pictures(url: str, noise: Literal["none", "real"]) -> None:
    images: list[palmares.CameraImage] = []
    for encoding in ("msgpack", "json"):
        with palmares.Client(url, encoding=cast(Any, encoding)) as client:
            client.reset("shelf", "reflex", seed=2, sensing="sensors", noise=noise)
            obs = client.step(repeat=20, cameras=["shelf", "shelf.rgb", "wrist"])
            assert set(obs.cameras) == {"shelf", "wrist"}
            images.append(obs.cameras["shelf"])
    first, second = images
    np.testing.assert_array_equal(first.depth, second.depth)
    np.testing.assert_array_equal(first.rgb, second.rgb)
    assert first.tick == second.tick
    assert (first.tick == 20) == (noise == "none")


def test_missing_cameras_are_refused(url: str) -> None:
    with palmares.Client(url) as client:
        with pytest.raises(palmares.UnknownCameraError, match="box_a"):
            client.reset("balls", "softhand", cameras=["eye"])
        obs = client.reset("balls", "softhand", sensing="sensors")
        with pytest.raises(palmares.PalmaresError, match="truth"):
            client.step(cameras=["box_a.bodies"])
        # No tick was made.
        assert client.step().tick == obs.tick + 1
        with pytest.raises(ValueError, match="wrist\\.rgb"):
            _ = client.step(cameras=["wrist"]).cameras["wrist"].rgb


def test_an_environment_of_sensors(url: str) -> None:
    env = PalmaresEnv(
        url, hand="reflex", sensing="sensors", noise="real", cameras=["wrist", "box_a"], ticks=2
    )
    obs, _ = env.reset(seed=1)
    obs, *_ = env.step({"twist": np.zeros(6), "hand": np.full(4, 0.2)})
    assert env.observation_space.contains(obs)
    shapes = {name: space.shape for name, space in cast(spaces.Dict, env.observation_space).items()}
    assert shapes == {
        "base": (13,),
        "motors": (4, 4),
        "wrist": (6,),
        "time_left": (1,),
        "encoders": (3,),
        "touch": (38, 3),
        "depth_wrist": (120, 160),
        "depth_box_a": (240, 320),
    }
    env.close()
    with pytest.raises(ValueError, match="box_b"):
        PalmaresEnv(url, cameras=["eye"])


def test_the_example_finds_the_balls_in_noise(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent.parent / "src/palmares/examples")
    example = importlib.import_module("balls_sensors")
    with palmares.Client(url) as client:
        # The truth is for the test; the image has the errors of a real camera.
        hand = example.Senses(client, client.reset("balls", "softhand", noise="real", seed=11))
        points = hand.look()
        balls = example.find_balls(points, largest_radius(client.scene), client.scene.region("box_a"))
        truth = hand.obs.truth
        assert truth is not None
        nearest = [float(np.linalg.norm(truth.positions - ball, axis=1).min()) for ball in balls]
        # Some objects are hidden under others; all found ones exist.
        assert len(balls) >= 6
        assert max(nearest) < 0.01


def test_the_example_finds_the_objects_in_the_shelf(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parent.parent / "src/palmares/examples")
    example = importlib.import_module("shelf_sensors")
    with palmares.Client(url) as client:
        # The truth is for the test; the image has the errors of a real camera.
        hand = example.Senses(client, client.reset("shelf", "softhand", noise="real", seed=2))
        image = hand.look()
        found = example.find_objects(image, client.scene.free, client.scene.region("shelf"))
        true = object_bounds(client.scene, hand.obs)
        # Some are hidden behind others.
        assert len(found) >= 6
        errors = [np.abs([box.low - true[box.index].low, box.high - true[box.index].high]) for box in found]
        # The visible fronts are correct; some are partly hidden.
        assert np.median(errors) < 0.005
        assert np.median([error[0, 1] for error in errors]) < 0.005
        assert np.median([error[1, 1] for error in errors]) < 0.02
