"""Forms of observations: groups for a policy and a critic, and goals."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

from palmares.gym import BatchEnv, FlatEnv, Goal
from tests.fake_server import FakeServer

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

NAME = "palmares/Grasp-SoftHand-v1"


@pytest.mark.parametrize(
    "options", [{"observations": "groups"}, {"observations": "goal", "cameras": ["top"]}]
)
def test_the_checker_of_gymnasium_accepts_every_form(options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(NAME, **options)
        check_env(env.unwrapped, skip_render_check=True)
    envs = gymnasium.make_vec(NAME, num_envs=2, **options)
    assert envs.single_observation_space == env.observation_space
    assert envs.unwrapped.layout == env.unwrapped.layout  # type: ignore[attr-defined]
    found = envs.reset(seed=4)[0]
    assert envs.observation_space.contains(found)
    alone = env.reset(seed=5)[0]
    for name, values in alone.items():
        if not name.startswith("depth_"):
            np.testing.assert_array_equal(found[name][1], values)


def test_a_policy_has_the_sensors_and_a_critic_everything() -> None:
    options: dict[str, Any] = {"hand": "softhand_skin", "noise": "real"}
    envs = BatchEnv("grasp", num_envs=2, observations="groups", randomise=["hand"], **options)
    sensors = BatchEnv("grasp", num_envs=2, sensing="sensors", randomise=["hand"], **options)
    truth = BatchEnv("grasp", num_envs=2, randomise=["hand"], **options)
    for there in (envs, sensors, truth):
        there.reset(seed=3)
    actions = np.full((2, 7), 0.1)
    found, infos = envs.step(actions)[::4]
    for group, fields in (("policy", sensors.step(actions)[0]), ("critic", truth.step(actions)[0])):
        assert set(envs.layout[group]) == set(fields)
        assert found[group].dtype == np.float32
        for name, columns in envs.layout[group].items():
            expected = fields[name].reshape(2, -1).astype(np.float32)
            np.testing.assert_array_equal(found[group][:, columns], expected)
    drawn = found["critic"][:, envs.layout["critic"]["hand_drawn"]]
    np.testing.assert_array_equal(drawn, infos["hand_drawn"].astype(np.float32))
    assert "hand_drawn" not in envs.layout["policy"]
    with pytest.raises(ValueError, match="wanted sensing='truth' for the critic"):
        BatchEnv("grasp", observations="groups", sensing="sensors")
    with pytest.raises(ValueError, match="observations: found 'both'; wanted 'fields' or 'groups' or 'goal'"):
        FlatEnv("grasp", "softhand", observations="both")


def test_a_goal_is_drawn_by_the_scene_and_rewards_its_neighbourhood() -> None:
    goal = Goal(low=(-0.1, -0.1, 0.1), high=(0.1, 0.1, 0.3), tolerance_m=0.02)
    env = FlatEnv("grasp", "softhand", observations="goal", goal=goal, sensing="sensors")
    envs = BatchEnv("grasp", "softhand", 2, observations="goal", goal=goal, sensing="sensors")
    found, alone = envs.reset(seed=8)[0], env.reset(seed=9)[0]
    assert set(found) == {"observation", "achieved_goal", "desired_goal"}
    assert "objects" not in env.layout["observation"]
    offset = alone["desired_goal"] - alone["achieved_goal"]
    assert (np.abs(offset - [0.0, 0.0, 0.2]) <= 0.1001).all()
    assert np.linalg.norm(found["desired_goal"][0] - found["desired_goal"][1]) > 0.01
    assert isinstance(env.observation_space, spaces.Dict)
    for _ in range(2):
        found, rewards, _, _, infos = envs.step(np.zeros((2, 7)))
        alone, reward, terminated, truncated, info = env.step(np.zeros(7))
        np.testing.assert_array_equal(found["desired_goal"][1], alone["desired_goal"])
        assert reward == rewards[1] == -1.0
        assert not terminated | truncated | info["is_success"] | infos["is_success"][1]
    # Learners compute the rewards of other goals.
    there = found["achieved_goal"]
    relabelled = there + np.array([0.0, 0.019, 0.021])[:, None, None] * [0.0, 0.0, 1.0]
    for of in (env, envs):
        found = of.compute_reward(np.broadcast_to(there, (3, 2, 3)), relabelled, {})
        assert found.tolist() == [[0.0, 0.0], [0.0, 0.0], [-1.0, -1.0]]
        assert found.dtype == np.float32
    assert env.compute_reward(there[0], there[0], {}) == 0.0
    assert not env.compute_terminated(there, there, {}) | env.compute_truncated(there, there, {})
    # The next episode has another goal, for any way to begin it.
    kept = alone["desired_goal"]
    assert (env.reset()[0]["desired_goal"] != kept).any()
    assert (env.reset(seed=9)[0]["desired_goal"] == kept).all()


def test_a_reached_goal_is_a_success_and_no_end() -> None:
    here = Goal(low=(0.0, 0.0, 0.0), high=(0.0, 0.0, 0.0), tolerance_m=0.01)
    env = FlatEnv("grasp", "softhand", observations="goal", goal=here)
    env.reset(seed=2)
    _, reward, terminated, truncated, info = env.step(np.zeros(7))
    assert (reward, terminated, truncated) == (0.0, False, False)
    assert (info["is_success"], info["score"]) == (True, 0.0)
    envs = BatchEnv("balls", "softhand", 2, observations="goal", shaping="info",
                    goal=Goal((0.7, 0.0, 0.05), (0.7, 0.0, 0.05), "world", object=3))  # fmt: skip
    found = envs.reset(seed=1)[0]
    np.testing.assert_allclose(found["desired_goal"], [[0.7, 0.0, 0.05]] * 2, rtol=1e-6)
    objects = found["observation"][:, envs.layout["observation"]["objects"]].reshape(2, 10, 13)
    np.testing.assert_array_equal(found["achieved_goal"], objects[:, 3, :3])
    _, rewards, _, _, infos = envs.step(np.zeros((2, 7)))
    assert rewards.tolist() == [-1.0, -1.0]
    assert infos["_shaping"].all()


def test_what_is_no_goal_is_refused() -> None:
    for options, message in (
        ({"low": (0.0, 0.0, 0.2)}, "low: found .* wanted at most high"),
        ({"high": (0.0, 1.0)}, "high: found .* wanted three finite numbers"),
        ({"origin": "hand"}, "origin: found 'hand'; wanted 'object' or 'world'"),
        ({"tolerance_m": 0.0}, "tolerance_m: found 0.0; wanted more than 0"),
    ):
        with pytest.raises(ValueError, match=message):
            Goal(**options)
    for make in (FlatEnv, BatchEnv):
        with pytest.raises(ValueError, match="goal: object: found 4; wanted 0 to 0"):
            make("grasp", "softhand", observations="goal", goal=Goal(object=4))
        with pytest.raises(ValueError, match="shaping: found True; wanted False or 'info'"):
            make("grasp", "softhand", observations="goal", shaping=True)
        with pytest.raises(ValueError, match="wanted None, or observations='goal'"):
            make("grasp", "softhand", goal=Goal())
        # Learners take it for an environment with goals otherwise.
        assert not hasattr(make("grasp", "softhand"), "compute_reward")


def test_forms_are_those_of_a_server_too() -> None:
    with FakeServer() as server:
        env = FlatEnv("balls", "softhand", url=server.url, observations="groups", objects=3)
        observation, _ = env.reset(seed=1)
        assert env.observation_space.contains(observation)
        env.close()
        with pytest.raises(ValueError, match="objects: found None; observations='goal' needs their number"):
            FlatEnv("balls", "softhand", url=server.url, observations="goal", objects=None)
