"""State and mechanics of worlds as arrays: set, read, compared with differences."""

from __future__ import annotations

import numpy as np
import pytest

from palmares import twist
from palmares.sim import Batch, World, linearise
from palmares.sim.state import MECHANICS, STATE, State


def stirred(seed: int = 3) -> World:
    """Return a world that is in motion."""
    world = World("grasp", "softhand", seed)
    world.step(base=([0.0, 0.0, 0.3], [0.0, 1.0, 0.0, 0.0]), hand=[0.6], repeat=80)
    return world


def test_a_state_that_was_read_continues_bit_for_bit_in_another_world_of_another_seed() -> None:
    world, other = stirred(), World("grasp", "softhand", 8)
    state = world.state()
    world.step(hand=[0.9], repeat=20)
    other.set_state(state)
    assert not other.varied
    other.step(hand=[0.9], repeat=20)
    assert other.state_hash() == world.state_hash()


def test_what_is_put_elsewhere_is_there_and_the_run_has_no_replay(tmp_path: object) -> None:
    world = stirred()
    state = world.state().copy()
    state.q[3] += 0.01
    state.objects[0, :3] += [0.0, 0.02, 0.01]
    obs = world.set_state(state)
    assert obs.truth is not None
    assert obs.truth.joints.position[3] == state.q[3]
    np.testing.assert_allclose(obs.truth.positions[0], state.objects[0, :3], atol=1e-15)
    again = world.state()
    for name in ("base", "q", "joint_velocity", "motors"):
        np.testing.assert_array_equal(getattr(again, name), getattr(state, name))
    np.testing.assert_allclose(again.objects, state.objects, atol=1e-14)
    assert world.varied
    assert world.result().status == "training"
    with pytest.raises(ValueError, match="put elsewhere"):
        world.save_replay(f"{tmp_path}/x.mcap")


def test_the_same_placement_gives_the_same_bits_in_world_and_batch() -> None:
    world = World("grasp", "softhand", 5)
    batch = Batch("grasp", "softhand", 3)
    batch.reset([5, 5, 5])
    q = np.array(world.state().q) + 0.1
    world.set_state(q=q)
    batch.set_state(q=np.tile(q, (3, 1)), mask=[True, False, True])
    hashes = batch.state_hashes()
    assert hashes[0] == hashes[2] == world.state_hash() != hashes[1]


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("q", [0.0], "wanted"),
        ("q", [float("nan")] * 19, "finite"),
        ("base", [0.0] * 13, "length 1"),
        ("objects", [[1e9] + [0.0] * 5 + [1.0] + [0.0] * 6], "wanted a number from"),
    ],
)
def test_bad_parts_are_refused_and_change_nothing(part: str, value: object, message: str) -> None:
    world = stirred()
    before = world.state_hash()
    with pytest.raises(ValueError, match=message):
        world.set_state(**{part: value})  # type: ignore[arg-type]
    assert world.state_hash() == before


def test_first_differences_of_a_step_agree_to_six_digits() -> None:
    world = World("grasp", "softhand", 4)
    world.step(hand=[0.3], repeat=30)
    start = world.state()

    def after(joint: float) -> np.ndarray:
        moved = start.copy()
        moved.q[0] += joint
        world.set_state(moved)
        world.step(hand=[0.3])
        return np.array(world.state().q)

    wide, narrow = ((after(h) - after(-h)) / (2.0 * h) for h in (1e-5, 1e-6))
    np.testing.assert_allclose(wide, narrow, rtol=1e-6, atol=1e-6)


def test_jacobians_are_the_velocities_of_links_and_of_fingertips() -> None:
    world = stirred()
    world.set_state(joint_velocity=np.linspace(-1.0, 1.0, 19))
    state, found = world.state(), world.mechanics()
    assert set(found) == set(MECHANICS)
    velocity = np.concatenate([state.base[7:], state.joint_velocity])
    np.testing.assert_allclose(found["jacobians"] @ velocity, found["link_velocities"], atol=1e-12)
    tips = [int(np.argmin(np.abs(found["links"] - tip).sum(axis=1))) for tip in found["fingertips"]]
    np.testing.assert_array_equal(found["jacobians"][tips], found["fingertip_jacobians"])
    mass = found["mass_matrix"]
    np.testing.assert_allclose(mass, mass.T, atol=1e-15)
    assert np.linalg.eigvalsh(mass).min() > 0.0


def test_quantities_of_a_batch_are_those_of_its_worlds() -> None:
    batch = Batch("balls", "reflex", 2)
    batch.reset([1, 2])
    batch.step(np.full((2, 10), 0.1), 5)
    everything, contacts = batch.mechanics(), batch.contacts(most=40)
    states = batch.state()
    for k, seed in enumerate((1, 2)):
        world = World("balls", "reflex", seed)
        world.restore(batch.snapshot(k))
        for name, array in world.mechanics().items():
            np.testing.assert_array_equal(array, everything[name][k])
        for name in STATE:
            np.testing.assert_array_equal(getattr(world.state(), name), getattr(states, name)[k])
        for name, array in world.contacts(most=40).items():
            np.testing.assert_array_equal(array, contacts[name][k])


def test_contacts_are_padded_and_the_strongest_are_kept() -> None:
    batch = Batch("balls", "softhand", 1)
    batch.reset([1])
    objects = batch.state().objects
    objects[..., 9] = -0.01  # A small velocity wakes what sleeps: sleeping objects have no contacts.
    batch.set_state(objects=objects)
    batch.step(np.zeros((1, 7)), 20)
    everything, two = batch.contacts(most=64), batch.contacts(most=2)
    count = int(everything["count"][0])
    assert count == int(two["count"][0]) > 2
    assert everything["mask"].sum() == count
    forces = np.linalg.norm(everything["force"][0], axis=1)
    np.testing.assert_allclose(
        np.sort(np.linalg.norm(two["force"][0], axis=1)), np.sort(forces)[-2:], rtol=1e-15
    )
    assert (everything["bodies"][0][count:] == -1).all()


def test_a_state_of_a_batch_has_no_memory() -> None:
    batch = Batch("grasp", "softhand", 2)
    batch.reset([1, 2])
    state = batch.state()
    assert isinstance(state, State)
    assert state.memory is None
    before = batch.state_hashes()
    batch.set_state(state)
    assert batch.state_hashes() == before


def test_a_linear_step_predicts_a_small_change() -> None:
    world = World("grasp", "softhand", 4)
    world.step(hand=[0.3], repeat=30)
    action = np.array([0.0, 0.0, 0.05, 0.0, 0.0, 0.1, 0.4])
    fine, coarse = (linearise(world, action, step=step) for step in (1e-6, 1e-5))
    assert fine.A.shape == (2 * 32, 2 * 32)
    assert fine.B.shape == (2 * 32, 7)
    # The object rests on the table: where a change lets it slide, a step is not smooth.
    hand = [k for k, name in enumerate(fine.names) if "object" not in name]
    smooth = np.ix_(hand, hand)
    np.testing.assert_allclose(fine.A[smooth], coarse.A[smooth], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(fine.B[hand], coarse.B[hand], rtol=1e-6, atol=1e-6)
    joints = [fine.names.index(f"q.{k}") for k in range(19)]
    kept, small = world.state(), 1e-5
    change = np.zeros(64)
    change[joints] = small * np.cos(np.arange(19.0))

    def after(sign: float) -> np.ndarray:
        moved = kept.copy()
        moved.q[:] += sign * change[joints]
        world.set_state(moved)
        world.step(base=twist(action[:3], action[3:6]), hand=action[6:])
        return np.array(world.state().q)

    found = 0.5 * (after(1.0) - after(-1.0))
    np.testing.assert_allclose(found, (fine.A @ change)[joints], atol=1e-5 * small)
