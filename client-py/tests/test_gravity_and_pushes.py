"""Gravity and masses of links given for runs, and pushes on objects."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
from palmares.arrays import Array
from palmares.gym import BatchEnv, FlatEnv
from palmares.sim import Batch, Snapshot, World, describe_hand

EARTH = (0.0, 0.0, -9.81)
MOON = (0.0, 0.0, -1.62)
NOWHERE = (0.0, 0.0, 0.0)
CLOSED = [1.0, 0.4]
"""σ of the hand `pinch` around a ball"""


def in_the_air(batch: Batch) -> Array:
    """Put the object of each world into the air, far from the hand, at rest; return the objects (N, 13)."""
    objects = batch.state().objects
    objects[:, 0, [0, 2]] = 1.0, 0.5
    objects[:, 0, 7:] = 0.0
    batch.set_state(objects=objects)
    return objects[:, 0]


def test_objects_fall_with_the_gravity_of_their_run() -> None:
    own, batch = Batch("grasp", "pinch", 1, threads=1), Batch("grasp", "pinch", 2, threads=1)
    own.reset([3])
    gravity = np.array([MOON, (0.5, 0.0, -0.0)])
    batch.reset([3, 3], parameters={"gravity": gravity})
    np.testing.assert_array_equal(own.parameters["gravity"], [EARTH])
    np.testing.assert_array_equal(batch.parameters["gravity"], gravity)
    # A seed keeps its scene.
    np.testing.assert_array_equal(batch.state().objects, np.repeat(own.state().objects, 2, axis=0))
    before = in_the_air(batch)
    batch.step(np.zeros((2, 8)), 20)
    after, time_s = batch.state().objects[:, 0], 0.2
    np.testing.assert_allclose(after[:, 7:10], gravity * time_s, atol=1e-12)
    np.testing.assert_allclose((after - before)[:, :3], gravity * time_s**2 / 2, atol=1e-12)


def test_a_grasp_that_holds_at_a_sixth_of_the_weight_drops_at_twice_the_weight() -> None:
    world, up = World("grasp", "pinch", 6), np.array([0.0, 0.0, 1.0])
    assert world.scene.free[0].name == "056_tennis_ball"
    heavy = {"mass": 20.0}
    world.reset(parameters={"gravity": np.array(EARTH) / 6, **heavy})
    at, down = world.state().objects[0, :3], world.state().base[3:7]
    world.step(base=(at + 0.1 * up, down), hand=[0.0, 0.0], repeat=120)
    world.step(hand=CLOSED, repeat=100)
    world.step(base=(at + 0.4 * up, down), hand=CLOSED, repeat=150)
    grasp = world.state()
    assert grasp.objects[0, 2] - at[2] > 0.28
    names = ("base", "q", "joint_velocity", "motors", "objects")
    fallen = []
    for factor in (1 / 6, 1.0, 2.0):
        world.reset(parameters={"gravity": np.array(EARTH) * factor, **heavy})
        world.set_state(**{name: getattr(grasp, name) for name in names})
        world.step(hand=CLOSED, repeat=100)
        fallen.append(grasp.objects[0, 2] - world.state().objects[0, 2])
    assert max(fallen[:2]) < 0.001
    assert fallen[2] > 0.28


def test_a_run_with_given_gravity_is_for_training_and_its_snapshot_carries_it(tmp_path: Path) -> None:
    world = World("grasp", "pinch", 3)
    own = world.state_hash()
    world.reset(parameters={"gravity": MOON, "link_mass": 1.5})
    assert tuple(world.scene.gravity) == MOON
    world.step(hand=[0.5, 0.5], repeat=10)
    world.push_object(0, force=(0.5, 0.0, 0.0), duration_s=0.2)
    world.step(hand=[0.5, 0.5], repeat=5)
    other, copy = World("grasp", "pinch", 1), pickle.loads(pickle.dumps(world))
    other.restore(Snapshot(bytes(world.snapshot())))
    assert other.parameters["gravity"].tolist() == list(MOON)
    assert set(other.parameters["link_mass"]) == {1.5}
    for each in (world, other, copy):
        each.step(hand=[0.5, 0.5], repeat=20)
    assert other.state_hash() == copy.state_hash() == world.state_hash()
    with pytest.raises(ValueError, match="its actions alone do not play it again"):
        world.save_replay(tmp_path / "pushed.mcap")
    assert world.result().status == "training"
    # Left out again, all is the task's own.
    world.reset()
    assert world.state_hash() == own
    assert world.parameters["gravity"].tolist() == list(EARTH)
    assert world.result().status == "practice"
    world.reset(parameters={"gravity": EARTH})
    with pytest.raises(ValueError, match="it has no replay"):
        world.save_replay(tmp_path / "given.mcap")
    assert world.result().status == "training"


def test_the_mass_matrix_has_the_masses_of_the_links() -> None:
    batch = Batch("grasp", "softhand", 4, threads=1)
    links = World("grasp", "softhand", 1).mechanics("links")["links"].shape[0]
    factors = np.ones((4, links))
    factors[1], factors[2, 0], factors[3, -1] = 2.0, 3.0, 5.0
    batch.reset([1] * 4, parameters={"link_mass": factors})
    np.testing.assert_array_equal(batch.parameters["link_mass"], factors)
    own, double, palm, tip = batch.mechanics("mass_matrix")["mass_matrix"]
    np.testing.assert_allclose(double, 2.0 * own, rtol=1e-9, atol=1e-15)
    # The joints do not move the first link, which is the base.
    np.testing.assert_allclose(palm[6:, 6:], own[6:, 6:], rtol=1e-9, atol=1e-15)
    assert palm[0, 0] > own[0, 0]
    # The last link has four times its kinetic energy on top: 4 m v²/2 where the base moves at v.
    mass = describe_hand("softhand")["links"][-1]["mass"]
    np.testing.assert_allclose((tip - own)[:3, :3], 4.0 * mass * np.eye(3), rtol=1e-9, atol=1e-12)
    assert np.linalg.matrix_rank(tip - own, tol=1e-12) == 6
    # The wrist carries the weight.
    weights = batch.observe()["wrist"][:, 2]
    assert weights[1] == pytest.approx(2.0 * weights[0])


def test_a_push_on_a_free_object_is_an_impulse() -> None:
    batch = Batch("grasp", "pinch", 3, threads=1)
    batch.reset([5, 5, 6], parameters={"gravity": np.zeros((3, 3))})
    in_the_air(batch)
    force = np.array([[0.5, 0.0, 0.2], [0.5, 0.0, 0.2], [0.0, -0.3, 0.0]])
    mask = np.array([True, False, True])
    batch.push_object(0, force=force, duration_s=0.1, mask=mask)
    batch.step(np.tile([0.0] * 6 + [0.5, 0.5], (3, 1)), 30)
    objects = batch.state().objects[:, 0]
    momentum = batch.observe()["object_mass"][:, :1] * objects[:, 7:10]
    np.testing.assert_allclose(momentum, 0.1 * force * mask[:, np.newaxis], rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(objects[:, 10:], 0.0)
    # A single world does the same.
    world = World("grasp", "pinch", 5)
    world.reset(parameters={"gravity": NOWHERE})
    raised = world.state().objects
    raised[0, [0, 2]] = 1.0, 0.5
    raised[0, 7:] = 0.0
    world.set_state(objects=raised)
    world.push_object(0, force=force[0], duration_s=0.1)
    world.step(hand=[0.5, 0.5], repeat=30)
    np.testing.assert_array_equal(world.state().objects[0], objects[0])


def test_a_pushed_run_of_a_batch_is_for_training_and_continues_from_its_snapshot() -> None:
    batch = Batch("grasp", "pinch", 2, threads=1)
    batch.reset([5, 5])
    batch.push_object(0, force=np.full((2, 3), 0.3), torque=np.full((2, 3), 1e-3), mask=[True, False])
    batch.step(np.zeros((2, 8)), 5)
    assert batch.state_hashes()[0] != batch.state_hashes()[1]
    batch.restore(1, batch.snapshot(0))
    batch.step(np.zeros((2, 8)), 30)
    assert batch.state_hashes()[0] == batch.state_hashes()[1]
    world = World("grasp", "pinch", 5)
    world.push_object(0, force=[0.3] * 3, torque=[1e-3] * 3)
    assert world.result().status == "training"
    with pytest.raises(ValueError, match="the run is over"):
        world.push_object(0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"gravity": [MOON]}, "parameters['gravity']: found shape (1, 3); wanted (2, 3)"),
        ({"gravity": [-9.81, -9.81]}, "parameters['gravity']: found shape (2,); wanted (2, 3)"),
        ({"gravity": [MOON, (0.0, 0.0, 1000.0)]}, "run 1: gravity: found 1000 m/s²; wanted -100 to 100"),
        ({"link_mass": np.ones((2, 3))}, "parameters['link_mass']: found shape (2, 3); wanted (2, "),
        ({"link_mass": [1.0, 0.0]}, "run 1: link_mass: found 0; wanted 0.01 to 100"),
        ({"wind": [1.0, 1.0]}, "wanted some of mass, friction, size, link_mass, gravity, hand_NAME"),
    ],
)
def test_numbers_out_of_bounds_are_named(parameters: dict[str, Any], message: str) -> None:
    batch = Batch("grasp", "softhand", 2, threads=1)
    with pytest.raises(ValueError, match=re.escape(message)):
        batch.reset([1, 2], parameters=parameters)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"index": 1}, "index: found 1; wanted a whole number from 0 to 0"),
        (
            {"force": [[0.1] * 3, [300.0] * 3]},
            "world 1: wrench.force: expected finite numbers, at most 200",
        ),
        (
            {"torque": [[0.1] * 3, [30.0] * 3]},
            "world 1: wrench.torque: expected finite numbers, at most 20",
        ),
        ({"force": [1.0, 0.0, 0.0]}, "force: found shape (3,); wanted (2, 3)"),
        ({"duration_s": 100.0}, "duration_s: expected more than 0 and at most 60 s"),
    ],
)
def test_a_refused_push_is_named_and_changes_no_world(arguments: dict[str, Any], message: str) -> None:
    batch = Batch("grasp", "pinch", 2, threads=1)
    batch.reset([1, 1])
    before = batch.snapshot(0)
    with pytest.raises(ValueError, match=re.escape(message)):
        batch.push_object(**{"index": 0, **arguments})
    assert bytes(batch.snapshot(0)) == bytes(before)


def test_an_object_that_a_smaller_scene_lacks_is_not_pushed() -> None:
    few = Batch("balls", "pinch", 1, threads=1)
    few.fraction = 0.3
    few.reset([1])
    with pytest.raises(ValueError, match="object: found 9; the scene has 3, from 0 on"):
        few.push_object(9, force=np.ones((1, 3)))


def test_environments_take_gravity_and_masses_of_links() -> None:
    env = FlatEnv("grasp", "pinch")
    env.reset(seed=1, options={"parameters": {"gravity": MOON}})
    assert env.world is not None
    assert env.world.parameters["gravity"].tolist() == list(MOON)
    envs: Any = BatchEnv("grasp", "pinch", 2)
    envs.reset(seed=1, options={"parameters": {"gravity": [MOON, EARTH], "link_mass": [1.0, 2.0]}})
    np.testing.assert_array_equal(envs.batch.parameters["gravity"], [MOON, EARTH])
    np.testing.assert_array_equal(envs.batch.parameters["link_mass"][:, -1], [1.0, 2.0])
