"""Episodes that start from recorded states."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
import palmares
from palmares.gym import BatchEnv, FlatEnv, Goal, PalmaresEnv
from palmares.sim import Batch, Snapshot, State, World
from tests.fake_server import FakeServer

ARRAYS = ("base", "q", "joint_velocity", "motors", "objects", "tension")
NO_MOTION = np.zeros(8)


def world_of(task: str = "grasp", hand: str = "pinch", noise: Any = "none") -> World:
    """Return a world after a short motion."""
    world = World(task, hand, 50, noise=noise)
    move(world)
    return world


def move(world: World) -> None:
    """Move the hand of a world."""
    motors = len(world.observe().hand.actuators)
    world.step(base=palmares.twist((0.2, 0.1, -0.3), (0.0, 0.0, 0.4)), hand=[0.6] * motors, repeat=15)


def states(count: int) -> list[State]:
    """Return states with other places of the hand each."""
    world = world_of()
    found = []
    for _ in range(count):
        found.append(world.state())
        move(world)
    return found


def stacked(several: list[State]) -> State:
    """Return states as one with a first axis."""
    arrays: dict[str, Any] = {name: np.stack([getattr(one, name) for one in several]) for name in ARRAYS}
    return State(**arrays)


def check_fields(fields: dict[str, Any], state: State) -> None:
    """Check that fields are those of a state."""
    np.testing.assert_allclose(fields["base"], state.base, atol=1e-12)
    np.testing.assert_allclose(fields["objects"], state.objects, atol=1e-12)
    np.testing.assert_allclose(fields["joints"], [state.q, state.joint_velocity], atol=1e-12)
    np.testing.assert_allclose(fields["motors"][:, 1], state.motors[:, 0], atol=1e-12)


@pytest.mark.parametrize("kind", ["state", "snapshot"])
def test_an_episode_starts_where_the_state_was(kind: str) -> None:
    recorded = world_of()
    state = recorded.state()
    env = FlatEnv("grasp", "pinch")
    given = state if kind == "state" else recorded.snapshot()
    fields, info = env.reset(seed=7, options={"state": given})
    check_fields(fields, state)
    assert (info["seed"], info["start"], fields["time_left"][0]) == (7, 0, 120.0)
    # It is a run of the scene 7 whose state was set.
    world = World("grasp", "pinch", 7)
    world.set_state(State(**{name: getattr(state, name) for name in ARRAYS}))
    env.step(NO_MOTION)
    world.step(base=palmares.twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), hand=[0.5, 0.5], repeat=10)
    assert env.world is not None
    assert env.world.state_hash() == world.state_hash()
    assert env.world.result().status == "training"


def test_each_episode_draws_a_state_by_its_seed_alone() -> None:
    several = states(3)
    env, batch = FlatEnv("grasp", "pinch"), BatchEnv("grasp", "pinch", 4)
    fields, infos = batch.reset(seed=20, options={"state": several})
    drawn = []
    for k in range(4):
        one, info = env.reset(seed=20 + k, options={"state": stacked(several)})
        assert info["start"] == infos["start"][k]
        check_fields(one, several[info["start"]])
        np.testing.assert_array_equal(one["base"], fields["base"][k])
        drawn.append(info["start"])
    assert len(set(drawn)) > 1
    # Each state has its share of the episodes.
    share = [env.reset()[1]["start"] for _ in range(60)]
    assert np.all(np.bincount(share, minlength=3) > 8)


@pytest.mark.parametrize("autoreset", ["NextStep", "SameStep"])
def test_states_hold_after_a_reset_that_comes_by_itself(autoreset: str) -> None:
    several = states(2)
    env = BatchEnv("grasp", "pinch", 3, max_episode_steps=2, autoreset_mode=autoreset)
    env.reset(seed=3, options={"state": several})
    begun = 0
    for _ in range(12):
        fields, _, _, _, infos = env.step(np.tile(NO_MOTION, (3, 1)))
        for k in np.flatnonzero(infos.get("_seed", np.zeros(3))):
            begun += 1
            check_fields({name: rows[k] for name, rows in fields.items()}, several[infos["start"][k]])
    assert begun >= 12
    _, infos = env.reset()
    assert infos["_start"].all()
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(twin.reset()[1]["start"], env.reset()[1]["start"])
    fields, infos = env.reset(seed=3, options={"state": None})
    assert "start" not in infos
    np.testing.assert_array_equal(fields["base"], BatchEnv("grasp", "pinch", 3).reset(seed=3)[0]["base"])


def test_only_the_environments_of_the_mask_start_anew() -> None:
    (state,) = states(1)
    env = BatchEnv("grasp", "pinch", 3)
    before, _ = env.reset(seed=1)
    before = {name: rows.copy() for name, rows in before.items()}
    mask = np.array([False, True, False])
    fields, infos = env.reset(options={"state": state, "reset_mask": mask})
    np.testing.assert_array_equal(fields["base"][[0, 2]], before["base"][[0, 2]])
    check_fields({name: rows[1] for name, rows in fields.items()}, state)
    assert infos["_start"].tolist() == mask.tolist()


def test_the_numbers_of_the_scene_are_drawn_all_the_same() -> None:
    state = states(1)[0]
    options: dict[str, Any] = {"randomise": ["mass", "friction"]}
    env: Any = BatchEnv("grasp", "pinch", 2, shaping="info", **options)
    plain: Any = BatchEnv("grasp", "pinch", 2, **options)
    fields, _ = env.reset(seed=4, options={"state": [state]})
    expected, _ = plain.reset(seed=4)
    np.testing.assert_array_equal(fields["object_mass"], expected["object_mass"])
    assert fields["object_mass"][0] != fields["object_mass"][1]
    for name, values in plain.batch.parameters.items():
        np.testing.assert_array_equal(env.batch.parameters[name], values)
    # A snapshot of a run without randomisation, and of one with it.
    for recorded in (world_of().snapshot(), plain.batch.snapshot(0)):
        env.reset(seed=4, options={"state": recorded})
    # The shaped part has no jump from the place of the scene to that of the state.
    env.reset(seed=4, options={"state": state})
    before = np.sum([*env.batch.potential.values()], axis=0)
    shaping = env.step(np.tile(NO_MOTION, (2, 1)))[4]["shaping"]
    after = np.sum([*env.batch.potential.values()], axis=0)
    np.testing.assert_allclose(shaping, 0.99 * after - before, atol=1e-9)


@pytest.mark.parametrize("make", [FlatEnv, lambda task, hand, **options: BatchEnv(task, hand, 1, **options)])
def test_objects_that_a_state_lacks_stay_where_the_scene_has_them(make: Any) -> None:
    few = Batch("balls", "pinch", 1, threads=1, training=palmares.Training(fraction=0.3))
    few.reset([3])
    state, scene = few.state(), World("balls", "pinch", 8).state().objects
    state.objects[0, :3, 2] += 0.2
    fields, _ = make("balls", "pinch").reset(seed=8, options={"state": state})
    found = fields["objects"].reshape(10, 13)
    np.testing.assert_allclose(found[:3], state.objects[0, :3], atol=1e-12)
    np.testing.assert_allclose(found[3:], scene[3:], atol=1e-12)
    # An environment with as few takes states and snapshots of its own world, and leaves out what it lacks.
    world = World("balls", "pinch", 3, training=palmares.Training(fraction=0.3))
    whole = World("balls", "pinch", 4).state()
    env = make("balls", "pinch", fraction=0.3)
    for given in (world.state(), world.snapshot(), whole):
        fields, _ = env.reset(seed=8, options={"state": given})
        found = fields["objects"].reshape(10, 13)
        expected = world.state().objects if given is not whole else whole.objects[:3]
        np.testing.assert_allclose(found[:3], expected, atol=1e-12)
        assert not found[3:].any()
    with pytest.raises(ValueError, match=r"objects: found shape \(1, 3, 13\); wanted \(1, 10, 13\)"):
        make("balls", "pinch").reset(seed=8, options={"state": world.state()})


def test_goals_images_and_own_functions_are_of_the_state() -> None:
    (state,) = states(1)
    lifted = state.replace(objects=state.objects + np.eye(1, 13, 2) * 0.2)
    env = FlatEnv("grasp", "pinch", observations="goal", goal=Goal(), cameras=["top"])
    found, _ = env.reset(seed=2, options={"state": lifted})
    np.testing.assert_allclose(found["achieved_goal"], lifted.objects[0, :3], rtol=1e-6)
    np.testing.assert_allclose(found["desired_goal"] - found["achieved_goal"], [0.0, 0.0, 0.1], atol=1e-6)
    assert env.world is not None
    np.testing.assert_allclose(found["depth_top"], env.world.pictures("top")["depth"], atol=1e-3)
    batch = BatchEnv(
        "grasp", "pinch", 1, reward=lambda step: step.before["objects"][:, 0, 2], cameras=["top"]
    )
    images, _ = batch.reset(seed=2, options={"state": lifted})
    np.testing.assert_array_equal(images["depth_top"][0], found["depth_top"])
    rewards = batch.step(np.zeros((1, 8)))[1]
    assert rewards[0] == pytest.approx(lifted.objects[0, 2])


@pytest.mark.parametrize("make", [FlatEnv, lambda task, hand: BatchEnv(task, hand, 2)])
def test_states_that_do_not_fit_are_named(make: Any) -> None:
    env, several = make("grasp", "pinch"), states(2)
    env.reset(seed=1, options={"state": several[0]})
    bad = several[1].replace(base=several[1].base * np.nan)
    flat = several[1].replace(base=np.zeros(13))
    for given, text in [
        (3, "options: state: found 3; wanted a palmares.sim.State or Snapshot, several of them in a list"),
        ([], "options: state: found no states; wanted at least one, or None"),
        ([several[0], "start"], r"options: state\[1\]: found 'start'; wanted a palmares.sim.State"),
        (
            world_of("balls").state(),
            r"options: state: objects: found shape \(1, 10, 13\); wanted \(1, 1, 13\)",
        ),
        (world_of(hand="softhand").state(), "state of task 'grasp' and hand 'pinch'"),
        ([several[0], bad], r"options: state\[1\]: base\[0, 0\] is nan; wanted finite numbers"),
        ([flat], r"options: state\[0\]: .*quaternion"),
        (world_of("balls").snapshot(), "options: state: .*task"),
        ([world_of(hand="softhand").snapshot()], r"options: state\[0\]: .*hand"),
        (stacked(several).replace(q=np.zeros((1, 2))), "options: state: q: found 1 rows; wanted 2"),
    ]:
        with pytest.raises(ValueError, match=text):
            env.reset(seed=1, options={"state": given})
    # The earlier one still holds.
    assert np.all(env.reset(seed=1)[1]["start"] == 0)


def test_a_server_starts_no_states() -> None:
    with FakeServer() as server:
        env = PalmaresEnv(server.url, task="balls", hand="softhand")
        with pytest.raises(ValueError, match="options: found 'state' with url"):
            env.reset(options={"state": states(1)[0]})


def test_stable_baselines3_starts_from_states() -> None:
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: palmares[learn]")
    from palmares.sb3 import PalmaresVecEnv

    several = states(2)
    env = PalmaresVecEnv("grasp", "pinch", 2, threads=1, max_episode_steps=2)
    env.set_options({"state": several})
    env.seed(6)
    found = env.reset()
    assert isinstance(found, dict)
    for k in range(2):
        np.testing.assert_allclose(found["base"][k], several[env.reset_infos[k]["start"]].base, rtol=1e-6)
    for _ in range(2):
        _, _, dones, infos = env.step(np.zeros((2, 8)))
    assert dones.all()
    assert all("start" in info for info in infos)
    env.set_options([{"state": several}, {}])
    with pytest.raises(ValueError, match="state: found another for some environments"):
        env.reset()


def test_snapshots_and_rows_of_batches_are_states() -> None:
    batch = Batch("grasp", "pinch", 2, threads=1)
    batch.reset([5, 6])
    batch.step(np.full((2, 8), 0.2), 20)
    env = FlatEnv("grasp", "pinch")
    rows = batch.state()
    for given in (rows, [Snapshot(bytes(batch.snapshot(k))) for k in range(2)]):
        fields, info = env.reset(seed=9, options={"state": given})
        np.testing.assert_allclose(fields["base"], rows.base[info["start"]], atol=1e-12)
        np.testing.assert_allclose(fields["objects"], rows.objects[info["start"]], atol=1e-12)
