"""Poses of the base and joints of an arm as actions, and given numbers of a run, in every environment."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import palmares
from palmares.analysis import RobotArm
from palmares.examples.grasp_arm import TASK
from palmares.gym import BatchEnv, FlatEnv, PalmaresEnv
from tests.fake_server import FakeServer

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

NAME = "palmares/Grasp-Pinch-v1"
POSE = np.array([0.05, -0.02, 0.2, 0.0, 0.5, 0.0, 0.0, -0.4, -0.4])
"""At (0.1, −0.04, 0.4) m, palm down, the two motors of `pinch` at σ = 0.3"""


def test_a_pose_is_the_target_of_single_and_vector_environments_and_of_a_world() -> None:
    one: Any = gymnasium.make(NAME, base="pose")
    many: Any = gymnasium.make_vec(NAME, num_envs=2, base="pose")
    assert one.action_space.shape == many.single_action_space.shape == (9,)
    check_env(gymnasium.make(NAME, base="pose").unwrapped, skip_render_check=True)
    one.reset(seed=4)
    many.reset(seed=3)
    world = sim.World("grasp", "pinch", 4)
    for _ in range(3):
        one.step(POSE)
        many.step(np.tile(POSE, (2, 1)))
        world.step(base=((0.1, -0.04, 0.4), (0.0, 0.5, 0.0, 0.0)), hand=[0.3, 0.3], repeat=10)
    assert one.unwrapped.world.state_hash() == world.state_hash() == many.batch.state_hashes()[1]
    inner = PalmaresEnv(None, task="grasp", hand="pinch", base="pose")
    space: Any = inner.action_space
    assert space["pose"].high.tolist() == [2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0]
    assert "twist" not in space.spaces


def test_a_quaternion_without_length_is_refused() -> None:
    env, envs = FlatEnv("grasp", "pinch", base="pose"), BatchEnv("grasp", "pinch", 1, base="pose")
    env.reset(seed=1)
    envs.reset(seed=1)
    with pytest.raises(palmares.BadActionError, match="quat_xyzw"):
        env.step(np.zeros(9))
    with pytest.raises(ValueError, match=r"actions\[0, 3:7\] has zero length"):
        envs.step(np.zeros((1, 9)))
    for make in (FlatEnv, BatchEnv):
        with pytest.raises(ValueError, match=r"has no arm; wanted .twist. or .pose."):
            make("grasp", "pinch", base="joints")
        with pytest.raises(ValueError, match="base: found 'wrist'; wanted 'twist' or 'pose' or 'joints'"):
            make("grasp", "pinch", base="wrist")


def test_joints_of_an_arm_are_the_target_of_environments_and_of_a_world() -> None:
    one, many = FlatEnv(TASK, "softhand", base="joints"), BatchEnv(TASK, "softhand", 2, base="joints")
    space: Any = one.inner.action_space
    low, high = space["joints"].low, space["joints"].high
    wanted = RobotArm(TASK).start + 0.05
    action = np.append(2.0 * (wanted - low) / (high - low) - 1.0, 0.0)
    one.reset(seed=5)
    many.reset(seed=5)
    observations = one.step(action)[0]
    found = many.step(np.tile(action, (2, 1)))[0]
    np.testing.assert_array_equal(found["arm"][0], observations["arm"])
    world = sim.World(TASK, "softhand", 5)
    world.step(base=palmares.joints(wanted), hand=0.5, repeat=10)
    np.testing.assert_allclose(
        observations["arm"], [world.observe().arm.position, world.observe().arm.velocity], atol=1e-9
    )


def test_a_reset_ignores_the_pose_of_the_run_that_is_over() -> None:
    envs = BatchEnv("grasp", "pinch", 2, base="pose", max_episode_steps=1)
    envs.reset(seed=1)
    assert envs.step(np.tile(POSE, (2, 1)))[3].all()
    envs.step(np.zeros((2, 9)))
    assert envs.batch.ticks == [0, 0]


def test_numbers_given_to_a_reset_are_those_of_the_run() -> None:
    one: Any = FlatEnv("grasp", "softhand")
    many = BatchEnv("grasp", "softhand", 2, autoreset_mode=AutoresetMode.DISABLED)
    own = one.reset(seed=5)[0]["object_mass"].copy()
    found = one.reset(seed=5, options={"parameters": {"mass": 2.0, "hand_friction": 0.8}})[0]
    np.testing.assert_allclose(found["object_mass"], 2.0 * own)
    given = {"mass": np.array([1.0, 2.0]), "hand_friction": [1.0, 0.8]}
    many.reset(seed=[4, 5], options={"parameters": given})
    assert many.batch.parameters["hand_friction"].tolist() == [1.0, 0.8]
    action = np.full(7, 0.1)
    one.step(action)
    many.step(np.tile(action, (2, 1)))
    assert one.world.state_hash() == many.batch.state_hashes()[1]
    twin = copy.deepcopy(one)
    assert twin.world.parameters["mass"].tolist() == [2.0]
    one.reset(seed=5)
    assert one.world.parameters["mass"].tolist() == [1.0]
    # Only these: the other run goes on.
    mask = np.array([True, False])
    many.reset(options={"reset_mask": mask, "parameters": {"mass": [3.0, 9.0]}})
    assert many.batch.parameters["mass"].tolist() == [[3.0], [2.0]]


def test_numbers_that_cannot_be_given_are_refused() -> None:
    env, envs = FlatEnv("grasp", "softhand"), BatchEnv("grasp", "softhand", 2)
    envs.reset(seed=1)
    kept = envs.batch.state_hashes()
    for parameters, message in (
        ({"weight": 1.0}, "found 'weight'; wanted some of mass, friction, size, link_mass, gravity, "),
        ({"mass": -1.0}, "mass: found -1; wanted 0.01 to 100"),
    ):
        rows = {name: [number, number] for name, number in parameters.items()}
        with pytest.raises(ValueError, match=message):
            env.reset(seed=1, options={"parameters": parameters})
        with pytest.raises(ValueError, match=message):
            envs.reset(options={"parameters": rows})
    assert envs.batch.state_hashes() == kept
    # No seed was used up.
    envs.reset()
    other = BatchEnv("grasp", "softhand", 2)
    other.reset(seed=1)
    other.reset()
    assert envs.batch.seeds == other.batch.seeds


def test_a_server_gives_no_numbers() -> None:
    with FakeServer() as server:
        env = PalmaresEnv(server.url)
        with pytest.raises(ValueError, match="parameters: servers do not offer them"):
            env.reset(seed=1, options={"parameters": {"mass": 2.0}})
        env.close()
    with palmares.Client("local") as client:
        client.parameters = {"mass": 2.0}
        client.reset("grasp", "softhand", seed=1)
        assert client.parameters == {"mass": 2.0}
        assert client.world is not None
        assert client.world.parameters["mass"].tolist() == [2.0]
