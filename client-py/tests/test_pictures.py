"""Pictures of one world and of many: equal to the images of cameras, and taken by learners without a copy."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import palmares

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not there")
from palmares.sim import Batch, View, World
from palmares.sim.pictures import KINDS

SEEDS = [3, 4, 5]
SIZE = (84, 60)
EYE = View.looking((0.4, -0.5, 0.4), at=(0.0, 0.0, 0.1))


@pytest.fixture(scope="module")
def worlds() -> list[World]:
    """Return worlds in which the hand came down."""
    opened = [World("grasp", "softhand", seed=seed) for seed in SEEDS]
    for world in opened:
        world.step(base=palmares.twist((0.0, 0.0, -0.2), (0.0, 0.0, 0.0)), hand=[0.4], repeat=40)
    return opened


@pytest.fixture(scope="module")
def batch(worlds: list[World]) -> Batch:
    """Return the same worlds in a batch."""
    batch = Batch("grasp", "softhand", len(SEEDS), threads=2)
    batch.reset(SEEDS)
    batch.step([[0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.4]] * len(SEEDS), ticks=40)
    assert batch.state_hashes() == [world.state_hash() for world in worlds]
    return batch


def test_a_named_camera_shows_what_its_images_show(worlds: list[World]) -> None:
    world = worlds[0]
    drawn = world.pictures("table", kinds=KINDS)
    image = world.observe(cameras=["table", "table.rgb", "table.bodies"]).cameras["table"]
    assert (drawn["rgb"] == image.rgb).all()
    assert (drawn["bodies"] == image.bodies).all()
    # The image has depth in steps of the camera; the picture is exact.
    step = image.depth_unit
    known = np.isfinite(image.depth)
    assert ((drawn["depth"] > 0.0) == known).all()
    assert np.abs(drawn["depth"] - image.depth)[known].max() <= 0.5 * step + 1e-6
    assert np.abs(drawn["depth_mm"] / 1e3 - drawn["depth"])[known].max() <= 0.5e-3 + 1e-6


@pytest.mark.parametrize(
    "camera", ["table", "film", EYE, View.looking((0, 0, -0.2), (0, 0, 1), (1, 0, 0), link="base")]
)
def test_a_batch_draws_the_same_bits_as_its_worlds(
    camera: str | View, worlds: list[World], batch: Batch
) -> None:
    # The film's place is that of the first world.
    together = batch.pictures(camera, SIZE, KINDS)
    width, height = SIZE
    types = {"depth": "f4", "depth_mm": "u2", "rgb": "u1", "bodies": "u2", "film": "u1"}
    assert list(together) == list(KINDS)
    for k, world in enumerate(worlds):
        alone = world.pictures(camera, SIZE, KINDS)
        for kind in KINDS:
            shape = (height, width, 3) if kind in ("rgb", "film") else (height, width)
            assert together[kind].shape == (len(SEEDS), *shape)
            assert together[kind].dtype == alone[kind].dtype == np.dtype(types[kind])
            assert together[kind].flags.c_contiguous
            if camera != "film" or k == 0:
                assert (together[kind][k] == alone[kind]).all(), (kind, k)
    assert len(np.unique(together["bodies"])) > 3


def test_other_libraries_take_the_arrays_without_a_copy(batch: Batch) -> None:
    depth = batch.pictures("table", SIZE)["depth"]
    shared = np.from_dlpack(depth)
    assert np.shares_memory(shared, depth)
    # jax takes no other addresses without a copy.
    for name, values in (batch.observe() | {"depth": depth}).items():
        assert values.ctypes.data % 64 == 0, name
    torch = pytest.importorskip("torch", reason="torch is not installed")
    tensor = torch.from_numpy(depth)
    depth[0, 0, 0] = 7.0
    assert tensor[0, 0, 0] == 7.0


def test_the_view_from_a_point_has_its_target_in_the_middle(worlds: list[World]) -> None:
    world = worlds[1]
    position = world.state().objects[0, :3]
    drawn = world.pictures(
        View.looking(position + np.array([0.3, -0.4, 0.3]), position), (81, 61), ("bodies", "depth")
    )
    assert drawn["bodies"][30, 40] == 0
    assert 0.4 < drawn["depth"][30, 40] < np.sqrt(0.34)


def test_the_film_sees_fingers_and_object_and_does_not_move(worlds: list[World]) -> None:
    world = worlds[0].fork()
    first = world.pictures("film", (320, 240), ("bodies", "film"))
    shown, count = np.unique(first["bodies"], return_counts=True)
    pixels = dict(zip(shown.tolist(), count.tolist(), strict=True))
    assert pixels[0] > 30, "the object"
    assert sum(number > 5 for body, number in pixels.items() if 0 < body < 65535) > 8, pixels
    world.step(hand=[1.0], repeat=60)
    second = world.pictures("film", (320, 240), "film")["film"]
    changed = (first["film"] != second).any(axis=-1).mean()
    assert 0.001 < changed < 0.6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("tabel",), "no camera `tabel`; there are: top, table, wrist, film"),
        (("table", (0, 10)), "size[0]: found 0; wanted a whole number from 1 to 921600"),
        (("table", (2000, 2000)), "a picture of 2000 × 2000 pixels"),
        (("table", None, "colour"), "kinds: found ['colour']; wanted some of depth"),
        (("table", None, ()), "kinds: found []; wanted some of depth"),
        ((View((0, 0, 1), (0, 0, 0, 1), fov_deg=200.0),), "fov_deg: found 200.0; wanted 1 to 170"),
        ((View((0, 0, 1), (0, 0, 0, 1), range_m=(1.0, 0.5)),), "range_m: found (1.0, 0.5)"),
        ((View((0, 0, 1), (0, 0, 0, 1), link="thumb"),), "no link `thumb`; there are: "),
    ],
)
def test_errors_say_what_is_wanted(arguments: tuple[Any, ...], message: str, batch: Batch) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        batch.pictures(*arguments)


def test_a_view_along_up_is_refused() -> None:
    with pytest.raises(ValueError, match="not along up"):
        View.looking((0.0, 0.0, 1.0), at=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("noise", ["none", "real"])
def test_depth_of_a_vector_environment_is_that_of_single_ones(noise: str) -> None:
    gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    import palmares.gym  # noqa: F401

    options: dict[str, Any] = {"cameras": ["table"], "noise": noise, "ticks": 5}
    envs = gymnasium.make_vec("palmares/Grasp-Pinch-v1", num_envs=2, **options)
    env = gymnasium.make("palmares/Grasp-Pinch-v1", **options)
    assert envs.single_observation_space == env.observation_space
    together, _ = envs.reset(seed=[7, 8])
    assert envs.observation_space.contains(together)
    for k, seed in enumerate((7, 8)):
        alone, _ = env.reset(seed=seed)
        assert (together["depth_table"][k] == alone["depth_table"]).all()
    action = env.action_space.sample()
    together = envs.step(np.stack([action, action]))[0]
    alone = env.step(action)[0]
    assert (together["depth_table"][1] == alone["depth_table"]).all()
    with pytest.raises(ValueError, match=r"cameras: found 'tabel'; wanted some of top, top\.rgb, table"):
        gymnasium.make_vec("palmares/Grasp-Pinch-v1", num_envs=2, cameras=["tabel"])


def test_films_of_environments_are_from_the_chosen_camera() -> None:
    gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    import palmares.gym

    options: dict[str, Any] = {"render_mode": "rgb_array", "render_size": (64, 48)}
    env = gymnasium.make("palmares/Grasp-Pinch-v1", **options)
    env.reset(seed=7)
    envs = gymnasium.make_vec("palmares/Grasp-Pinch-v1", num_envs=2, **options)
    envs.reset(seed=[7, 8])
    picture, pictures = env.render(), envs.render()
    assert picture.shape == (48, 64, 3)
    assert picture.dtype == np.uint8
    assert (pictures[0] == picture).all()
    other = gymnasium.make("palmares/Grasp-Pinch-v1", render_camera="top", **options)
    other.reset(seed=7)
    assert (other.render() != picture).any()
    with pytest.raises(ValueError, match="render_size and a View as render_camera need"):
        palmares.gym.PalmaresEnv("http://127.0.0.1:9", task="grasp", hand="pinch", render_size=(8, 8))
