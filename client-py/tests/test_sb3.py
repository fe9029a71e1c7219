"""The adapter for stable-baselines3, with its learners; skipped where they are not installed."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: palmares[learn]")

import stable_baselines3 as sb3
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize, VecVideoRecorder

from palmares.gym import BatchEnv, FlatEnv, Goal
from palmares.sb3 import PalmaresVecEnv
from tests.short_task import short_grasp

PPO: dict[str, Any] = {"n_steps": 8, "batch_size": 16, "n_epochs": 1, "device": "cpu", "seed": 1}


def made(count: int = 2, **options: Any) -> PalmaresVecEnv:
    return PalmaresVecEnv("grasp", "pinch", count, threads=1, max_episode_steps=5, **options)


@pytest.mark.parametrize("observations", ["fields", "groups", "goal"])
def test_its_checker_accepts_single_environments(observations: Any) -> None:
    check_env(FlatEnv("grasp", "pinch", observations=observations))


def test_ppo_learns_with_a_dictionary_and_with_a_vector() -> None:
    learner = sb3.PPO("MultiInputPolicy", made(shaping=True), **PPO)
    learner.learn(32)
    assert learner.num_timesteps == 32
    assert [episode["l"] for episode in learner.ep_info_buffer] == [5] * 6
    env = VecFrameStack(VecNormalize(made(shaping=True, flat=True, keys=["base", "objects"])), 3)
    assert env.observation_space.shape == (3 * 26,)
    sb3.PPO("MlpPolicy", env, **PPO).learn(16)


def test_statistics_of_episodes_have_entries_of_the_info() -> None:
    env = made(flat=True, info_keywords=("score", "tick"))
    learner = sb3.PPO("MlpPolicy", env, **PPO)
    learner.learn(32)
    assert [episode["tick"] for episode in learner.ep_info_buffer] == [50] * 6
    assert {episode["score"] for episode in learner.ep_info_buffer} == {0.0}
    learner = sb3.PPO("MlpPolicy", made(flat=True, info_keywords=["height"]), **PPO)
    with pytest.raises(ValueError, match=r"info_keywords: found 'height'; wanted some of .*score"):
        learner.learn(32)


def test_its_statistics_are_those_of_vec_monitor() -> None:
    env = made(shaping=True)
    with pytest.warns(UserWarning, match="already wrapped with a `Monitor`"):
        monitor = VecMonitor(made(shaping=True), info_keywords=("score", "is_success"))
    env.seed(3)
    monitor.seed(3)
    env.reset()
    monitor.reset()
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (12, 2, 8))
    ended = 0
    for action in actions:
        _, _, _, own = env.step(action)
        _, _, dones, others = monitor.step(action)
        assert [("episode" in info) for info in own] == list(dones)
        for info, other in zip(own, others, strict=True):
            if "episode" in info:
                ended += 1
                assert info["episode"]["l"] == other["episode"]["l"] == 5
                assert info["episode"]["r"] == pytest.approx(other["episode"]["r"], abs=1e-5)
                assert info["episode"]["t"] > 0.0
                assert info["score"] == other["episode"]["score"]
    assert ended == 4


@pytest.mark.filterwarnings("error")
def test_an_evaluation_takes_its_statistics(tmp_path: Path) -> None:
    # A ball that is held at once: an episode succeeds, by the goal's tolerance.
    goal = Goal(low=(0.0, 0.0, 0.0), high=(0.0, 0.0, 0.0))
    options: dict[str, Any] = {"observations": "goal", "goal": goal}
    learner = sb3.PPO("MultiInputPolicy", made(**options), **PPO)
    callback = EvalCallback(
        made(**options), n_eval_episodes=4, eval_freq=8, log_path=str(tmp_path), verbose=0
    )
    learner.learn(16, callback=callback)
    found = np.load(tmp_path / "evaluations.npz")
    assert found["ep_lengths"].tolist() == [[5] * 4]
    # Each step has the reward 0 of a reached goal.
    assert found["results"].tolist() == [[0.0] * 4]
    assert found["successes"].tolist() == [[True] * 4]


def test_tensorboard_has_rewards_lengths_and_successes(tmp_path: Path) -> None:
    pytest.importorskip("tensorboard", reason="tensorboard is not installed")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    env = made(shaping=True, flat=True)
    learner = sb3.PPO("MlpPolicy", env, tensorboard_log=str(tmp_path), **PPO)
    learner.learn(32, log_interval=1)
    (folder,) = tmp_path.iterdir()
    events = EventAccumulator(str(folder))
    events.Reload()
    scalars = set(events.Tags()["scalars"])
    assert {"rollout/ep_rew_mean", "rollout/ep_len_mean", "rollout/success_rate"} <= scalars
    assert [event.value for event in events.Scalars("rollout/ep_len_mean")] == [5.0, 5.0]
    returns = np.mean([episode["r"] for episode in learner.ep_info_buffer])
    assert events.Scalars("rollout/ep_rew_mean")[-1].value == pytest.approx(returns, rel=1e-5)
    assert events.Scalars("rollout/success_rate")[-1].value == 0.0


def test_ppo_learns_with_a_camera() -> None:
    env = made(cameras=["top.rgb"], keys=["rgb_top", "motors"], render_mode="rgb_array")
    learner = sb3.PPO("MultiInputPolicy", env, **PPO | {"n_steps": 2, "batch_size": 4})
    learner.learn(4)
    assert learner.observation_space["rgb_top"].shape == (3, 240, 320)


@pytest.mark.parametrize("single", [True, False])
def test_hindsight_replays_goals(single: bool) -> None:
    goal = Goal(low=(-0.1, -0.1, 0.0), high=(0.1, 0.1, 0.2))
    options: dict[str, Any] = {"observations": "goal", "goal": goal}
    env: Any = FlatEnv("grasp", "pinch", **options) if single else made(**options)
    if single:
        from gymnasium.wrappers import TimeLimit

        env = TimeLimit(env, 5)
    learner = sb3.SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 4},
        learning_starts=12,
        batch_size=32,
        device="cpu",
        seed=1,
    )
    learner.learn(16)
    sample = learner.replay_buffer.sample(64)
    rewards = goal.reward(sample.next_observations["achieved_goal"], sample.next_observations["desired_goal"])
    np.testing.assert_array_equal(sample.rewards[:, 0], rewards)
    # The object rests: it is where a relabelled goal wants it.
    assert 0 < (rewards == 0.0).sum() < 64


def test_it_steps_as_the_environment_under_it(tmp_path: Path) -> None:
    short = short_grasp(tmp_path, 0.6)
    env = PalmaresVecEnv(short, "pinch", 2, ticks=20, threads=1, shaping=True)
    plain = BatchEnv(short, "pinch", 2, ticks=20, threads=1, shaping=True, autoreset_mode="SameStep")
    env.seed(4)
    np.testing.assert_array_equal(env.reset()["base"], plain.reset(seed=4)[0]["base"].astype(np.float32))
    assert [info["seed"] for info in env.reset_infos] == [4, 5]
    total = np.zeros(2)
    for k in range(4):
        actions = np.full((2, 8), -0.1)
        found, rewards, dones, infos = env.step(actions)
        expected = plain.step(actions)
        np.testing.assert_array_equal(found["base"], expected[0]["base"].astype(np.float32))
        np.testing.assert_array_equal(rewards, expected[1].astype(np.float32))
        assert list(dones) == [k == 2] * 2
        total += expected[1]
        assert ("terminal_observation" in infos[0]) is (k == 2)
        if k == 2:
            last = expected[4]["final_obs"][1]["base"].astype(np.float32)
            np.testing.assert_array_equal(infos[1]["terminal_observation"]["base"], last)
            assert infos[1]["TimeLimit.truncated"]
            assert infos[1]["result"]["reason"] == "time_limit"
            assert infos[1]["episode"]["r"] == pytest.approx(total[1])
            assert infos[1]["seed"] == plain.batch.seeds[1]


def test_attributes_methods_and_pictures(tmp_path: Path) -> None:
    env = PalmaresVecEnv("balls", "pinch", 2, threads=1, render_mode="rgb_array", render_size=(64, 48))
    env.set_attr("fraction", 0.5)
    assert env.get_attr("fraction", indices=[0]) == [0.5]
    with pytest.raises(ValueError, match="leave indices out"):
        env.set_attr("fraction", 0.5, indices=[0])
    with pytest.raises(ValueError, match="keys: found 'colour'; wanted some of base, joints"):
        made(keys=["colour"])
    env.set_options({"pose": 1})
    with pytest.raises(ValueError, match="options: found 'pose'; wanted 'parameters'"):
        env.reset()
    env.set_options([{"parameters": {"mass": 2.0}}, {}])
    with pytest.raises(ValueError, match="found no 'mass' for environments"):
        env.reset()
    env.set_options([{"parameters": {"mass": 2.0}}, {"parameters": {"mass": [0.5] * 10}}])
    env.reset()
    assert env.env.batch.parameters["mass"][:, 0].tolist() == [2.0, 0.5]
    env.set_options()
    env.reset()
    tiles = env.render()
    assert tiles is not None
    assert tiles.shape == (96, 64, 3)
    pytest.importorskip("moviepy", reason="moviepy is not installed")
    film = VecVideoRecorder(env, str(tmp_path), lambda step: step == 0, video_length=3)
    film.reset()
    for _ in range(4):
        film.step(np.zeros((2, 8)))
    film.close()
    assert [path.suffix for path in tmp_path.iterdir()] == [".mp4"]


def test_a_checkpoint_of_the_worlds_goes_on() -> None:
    env = made()
    env.seed(2)
    env.reset()
    env.step(np.zeros((2, 8)))
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(6):
        left, right = env.step(np.full((2, 8), 0.1)), twin.step(np.full((2, 8), 0.1))
    np.testing.assert_array_equal(left[0]["base"], right[0]["base"])
    assert env.env.batch.state_hashes() == twin.env.batch.state_hashes()
