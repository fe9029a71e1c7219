"""Numbers given for runs, longer steps, late and inexact actions, pose actions and pushes in a batch."""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest

from palmares import Training, twist
from palmares.analysis import Hand
from palmares.sim import Batch, Snapshot, World

UP = np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.5])


def test_given_numbers_are_in_the_runs_and_can_be_read() -> None:
    batch = Batch("grasp", "softhand", 3)
    mass = np.array([0.5, 1.0, 2.0])
    batch.reset([1, 1, 1], parameters={"mass": mass, "hand_friction": [0.8, 0.9, 1.0]})
    own = Batch("grasp", "softhand", 1)
    own.reset([1])
    np.testing.assert_allclose(
        batch.observe()["object_mass"][:, 0], own.observe()["object_mass"][0, 0] * mass, rtol=1e-15
    )
    parameters = batch.parameters
    np.testing.assert_array_equal(parameters["mass"][:, 0], mass)
    np.testing.assert_array_equal(parameters["hand_friction"], [0.8, 0.9, 1.0])
    assert parameters["friction"].tolist() == [[1.0], [1.0], [1.0]]
    assert parameters["sensor_noise"].tolist() == [1.0, 1.0, 1.0]


def test_a_run_with_given_numbers_is_that_of_the_world_and_its_snapshot_carries_them() -> None:
    given = {"mass": 1.7, "hand_damping": 1.2}
    world = World("grasp", "softhand", 5)
    world.reset(5, parameters=given)
    batch = Batch("grasp", "softhand", 2)
    batch.reset([5, 5], parameters={name: [1.0, number] for name, number in given.items()})
    for _ in range(3):
        batch.step(np.tile(UP, (2, 1)), 10)
        world.step(base=twist(UP[:3], UP[3:6]), hand=0.5, repeat=10)
    assert batch.state_hashes()[1] == world.state_hash() != batch.state_hashes()[0]
    kept = bytes(world.snapshot())
    batch.restore(0, kept)
    assert batch.state_hashes()[0] == world.state_hash()
    other = World("grasp", "softhand", 1)
    other.restore(Snapshot(kept))
    assert other.parameters["mass"].tolist() == [1.7]
    assert pickle.loads(pickle.dumps(world)).state_hash() == world.state_hash()
    assert world.varied
    assert world.result().status == "training"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"weight": [1.0, 1.0]},
            "found 'weight'; wanted some of mass, friction, size, link_mass, gravity, hand_NAME",
        ),
        ({"mass": [1.0]}, "found shape (1,)"),
        ({"mass": [1.0, -1.0]}, "mass: found -1; wanted 0.01 to 100"),
        ({"hand_slip": [1.0, 1.0]}, "found hand_slip; hand `softhand` has in [uncertain]"),
        ({"hand_friction": [9.0, 1.0]}, "hand_friction: found 9; wanted"),
        ({"size": [1.0, np.nan]}, "wanted finite numbers"),
    ],
)
def test_numbers_that_cannot_be_given_are_refused(parameters: dict[str, list[float]], message: str) -> None:
    batch = Batch("grasp", "softhand", 2)
    batch.reset([1, 2])
    before = batch.state_hashes()
    with pytest.raises(ValueError, match=re.escape(message)):
        batch.reset([3, 4], parameters=parameters)
    assert batch.state_hashes() == before


def test_a_longer_step_is_for_learning_and_near_the_exact_one() -> None:
    worlds = [World("grasp", "softhand", 3, training=Training(step_ms=step)) for step in (2, 4)]
    exact = World("grasp", "softhand", 3)
    for world in [*worlds, exact]:
        world.step(base=twist([0.0, 0.0, -0.1], [0.0, 0.0, 0.0]), hand=0.7, repeat=60)
    for world in worlds:
        assert world.varied
        assert world.state_hash() != exact.state_hash()
        np.testing.assert_allclose(world.state().q, exact.state().q, atol=5e-3)
        with pytest.raises(ValueError, match="another task"):
            exact.restore(world.snapshot())
    assert not World("grasp", "softhand", 3, training=Training(step_ms=1)).varied
    with pytest.raises(ValueError, match=r"step_ms: found 0\.5; wanted 1 to 10"):
        World("grasp", "softhand", 3, training=Training(step_ms=0.5))


def test_longer_steps_try_out_what_the_exact_run_does_next() -> None:
    exact = Batch("grasp", "softhand", 1, threads=1)
    plans = Batch("grasp", "softhand", 2, threads=1, training=Training(step_ms=5, shaping=True))
    exact.reset([3])
    plans.reset([3, 4])
    down = np.array([[0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.5]])
    exact.step(down, 30)
    for row in (0, 1):
        plans.restore(row, exact.snapshot(0))
    exact.step(down, 30)
    plans.step(np.repeat(down, 2, axis=0), 30)
    for name in ("base", "objects", "motors"):
        expected = exact.observe()[name]
        assert np.abs(plans.observe()[name] - expected).max() < 5e-3
    with pytest.raises(ValueError, match="another task"):
        exact.restore(0, plans.snapshot(0))


def test_actions_arrive_late_and_with_errors() -> None:
    late = Batch("grasp", "softhand", 2, training=Training(action_delay=(0, 5), action_noise=0.05))
    late.reset([1, 2])
    twin = World("grasp", "softhand", 2, training=Training(action_delay=(0, 5), action_noise=0.05))
    for _ in range(4):
        late.step(np.tile(UP, (2, 1)), 5)
        twin.step(base=twist(UP[:3], UP[3:6]), hand=0.5, repeat=5)
    assert late.state_hashes()[1] == twin.state_hash()
    with pytest.raises(ValueError, match=r"action_delay\[1\]: found 101"):
        Training(action_delay=(0, 101))
    with pytest.raises(ValueError, match="action_noise: found -1; wanted 0 to 1"):
        Training(action_noise=-1)


def test_pose_actions_are_those_of_a_world() -> None:
    batch, world = Batch("grasp", "softhand", 1, base="pose"), World("grasp", "softhand", 4)
    batch.reset([4])
    at = world.state().base
    pose = np.concatenate([at[:3] + np.array([0.01, 0.0, -0.02]), at[3:7]])
    batch.step(np.concatenate([pose, [0.3]])[np.newaxis], 20)
    world.step(base=(pose[:3], pose[3:]), hand=0.3, repeat=20)
    assert batch.state_hashes() == [world.state_hash()]
    with pytest.raises(ValueError, match=r"actions\[0, 3:7\] has zero length"):
        batch.step(np.zeros((1, 8)))
    with pytest.raises(ValueError, match=r"wanted \(1, 8\)"):
        batch.step(np.zeros((1, 7)))


def test_a_push_is_that_of_a_world() -> None:
    batch, world = Batch("grasp", "softhand", 2), World("grasp", "softhand", 4)
    batch.reset([4, 4])
    link = Hand("softhand").links[3]
    batch.push(link, force=np.tile([0.0, 3.0, 0.0], (2, 1)), duration_s=0.05, mask=[True, False])
    world.perturb(link, force=(0.0, 3.0, 0.0), duration_s=0.05)
    batch.step(np.tile(UP, (2, 1)), 10)
    world.step(base=twist(UP[:3], UP[3:6]), hand=0.5, repeat=10)
    assert batch.state_hashes()[0] == world.state_hash() != batch.state_hashes()[1]
    with pytest.raises(ValueError, match="no link"):
        batch.push("tail", force=np.zeros((2, 3)))
