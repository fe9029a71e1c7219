"""Rewards and observations of a lab's own."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")
from palmares.arrays import Array
from palmares.gym import BatchEnv, FlatEnv, PalmaresEnv, Transition

Arrays = dict[str, Any]


def lifted(step: Transition) -> Array:
    """Return how far the first object has risen in the step, and what its hand was told."""
    rise = step.after["objects"][:, 0, 2] - step.before["objects"][:, 0, 2]
    found: Array = rise + 0.01 * step.actions[:, -1] + step.rewards
    return found


def places(fields: Arrays) -> Array:
    """Return where hand and object are."""
    found: Array = np.hstack([fields["base"][:, :3], fields["objects"][:, 0, :3]])
    return found


def one_row_is_infinite(fields: Arrays) -> Array:
    """Return observations of which the second is no number."""
    found: Array = np.zeros((len(fields["base"]), 2))
    found[1:2] = np.inf
    return found


def length_of(env: BatchEnv) -> int:
    """Return the length of an action."""
    return int(env.batch.action_len)


def actions(count: int, length: int) -> Array:
    """Return actions that differ by environment and step."""
    return np.random.default_rng(count).uniform(-1.0, 1.0, (count, length))


@pytest.mark.parametrize("autoreset", ["NextStep", "SameStep"])
def test_a_batch_has_the_rewards_and_observations_of_its_functions(autoreset: str) -> None:
    own = BatchEnv(
        "grasp", "pinch", 3, reward=lifted, observe=places, max_episode_steps=3, autoreset_mode=autoreset
    )
    plain = BatchEnv("grasp", "pinch", 3, max_episode_steps=3, autoreset_mode=autoreset)
    first, _ = own.reset(seed=4)
    before, _ = plain.reset(seed=4)
    assert own.single_observation_space["observed"].shape == (6,)  # type: ignore[index]
    np.testing.assert_array_equal(first["observed"], places(before).astype(np.float32))
    before = copy.deepcopy(before)
    act = actions(3, length_of(plain))
    for count in range(7):
        observed, rewards, *_ = own.step(act)
        after, task_rewards, terminated, truncated, infos = plain.step(act)
        ended = infos.get("final_obs", [None] * 3)
        last = {
            name: np.stack([values[k] if ended[k] is None else ended[k][name] for k in range(3)])
            for name, values in after.items()
        }
        events = infos["final_info"]["events"] if "final_info" in infos else infos["events"]
        step = Transition(before, last, act, task_rewards, list(events), terminated, truncated)
        begun = autoreset == "NextStep" and count % 4 == 3
        np.testing.assert_array_equal(rewards, 0.0 if begun else lifted(step))
        np.testing.assert_array_equal(observed["observed"], places(after).astype(np.float32))
        before = copy.deepcopy(after)


def test_a_single_environment_has_the_same_as_a_batch_of_one() -> None:
    options: dict[str, Any] = {"reward": lifted, "observe": places}
    env, batch = FlatEnv("grasp", "pinch", **options), BatchEnv("grasp", "pinch", 1, **options)
    one, _ = env.reset(seed=7)
    many, _ = batch.reset(seed=7)
    for act in actions(4, env.action_space.shape[0]):  # type: ignore[index]
        np.testing.assert_array_equal(one["observed"], many["observed"][0])
        one, reward, *_ = env.step(act)
        many, rewards, *_ = batch.step(act[np.newaxis])
        assert reward == rewards[0]
    check_env(FlatEnv("grasp", "pinch", **options), skip_render_check=True)


def test_the_scale_of_actions_is_a_part_of_their_ranges() -> None:
    act = actions(2, 8)
    scale = np.array([0.25, 0.25, 0.25, 0.4, 0.4, 0.4, 1.0, 0.5])
    scaled, plain = BatchEnv("grasp", "pinch", 2, action_scale=scale), BatchEnv("grasp", "pinch", 2)
    one = FlatEnv("grasp", "pinch", action_scale=scale, reward=lambda step: step.actions[:, 0])
    scaled.reset(seed=3)
    plain.reset(seed=3)
    one.reset(seed=3)
    scaled.step(act)
    plain.step(act * scale)
    assert scaled.batch.state_hashes() == plain.batch.state_hashes()
    # The reward has the action of the learner.
    assert one.step(act[0])[1] == act[0, 0]
    assert one.world is not None
    assert one.world.state_hash() == plain.batch.state_hashes()[0]
    whole = BatchEnv("grasp", "pinch", 2, action_scale=0.5)
    whole.reset(seed=3)
    plain.reset(seed=3)
    whole.step(act)
    plain.step(0.5 * act)
    assert whole.batch.state_hashes() == plain.batch.state_hashes()


@pytest.mark.parametrize("wrong", [0.0, 1.5, "half", [], [0.5, float("nan")], None])
def test_a_scale_that_is_no_part_is_refused(wrong: Any) -> None:
    with pytest.raises(ValueError, match=r"action_scale: found .*; wanted a number above 0 and at most 1"):
        BatchEnv("grasp", "pinch", 1, action_scale=wrong)


def test_a_scale_of_another_length_is_refused() -> None:
    for make in (BatchEnv, FlatEnv):
        with pytest.raises(ValueError, match="action_scale: found 2 numbers; wanted one, or 8"):
            make("grasp", "pinch", action_scale=[0.5, 0.5])
    with pytest.raises(TypeError, match="action_scale"):
        PalmaresEnv("local", task="grasp", hand="pinch", action_scale=0.5)


def test_a_batch_with_functions_of_a_module_is_copied() -> None:
    env = BatchEnv("grasp", "pinch", 2, reward=lifted, observe=places)
    env.reset(seed=3)
    act = actions(2, length_of(env))
    env.step(act)
    again = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(env.step(act)[1], again.step(act)[1])


def test_what_a_function_returns_is_checked() -> None:
    def step_with(**functions: Any) -> None:
        env = BatchEnv("grasp", "pinch", 2, **functions)
        env.reset(seed=1)
        env.step(np.zeros((2, length_of(env))))

    with pytest.raises(ValueError, match=r"reward: found an array of shape \(2, 1\); wanted \(2,\)"):
        step_with(reward=lambda step: step.rewards[:, np.newaxis])
    with pytest.raises(ValueError, match="reward: found nan in row 0; wanted finite numbers"):
        step_with(reward=lambda step: step.rewards * np.nan)
    with pytest.raises(ValueError, match="observe: found inf in row 1"):
        step_with(observe=one_row_is_infinite)
    with pytest.raises(ValueError, match=r"observe: found an array of shape \(1,\); wanted \(1, n\)"):
        step_with(observe=lambda fields: fields["base"][:, 0])
    with pytest.raises(ValueError, match="reward: found 3; wanted a function or None"):
        step_with(reward=3)
    with pytest.raises(ValueError, match="observe: found a function with observations='groups'"):
        step_with(observe=places, observations="groups")
    with pytest.raises(ValueError, match="whose reward is that of the goal"):
        step_with(reward=lifted, observations="goal")
    with pytest.raises(TypeError, match="reward"):
        PalmaresEnv("local", task="grasp", hand="pinch", reward=lifted)


def test_tensors_are_taken() -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed: palmares[learn]")

    def observe(fields: Arrays) -> Any:
        return torch.from_numpy(fields["base"][:, :3])

    def reward(step: Transition) -> Any:
        return torch.from_numpy(step.after["base"][:, 2]).requires_grad_()

    env = BatchEnv("grasp", "pinch", 2, reward=reward, observe=observe)
    env.reset(seed=1)
    observed, rewards, *_ = env.step(np.zeros((2, length_of(env))))
    np.testing.assert_allclose(observed["observed"][:, 2], rewards, rtol=1e-6)
