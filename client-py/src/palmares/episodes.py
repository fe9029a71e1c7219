"""Episodes of a policy in many scenes, as rows of arrays, for datasets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from palmares.arguments import MAX_SEED, short, whole
from palmares.arrays import Array
from palmares.gym.batch import BatchEnv
from palmares.gym.fields import Arrays

INFOS = {"tick": 0, "score": 0.0, "is_success": False, "shaping": 0.0}
"""Entries of infos that a dataset keeps, with their values after a reset"""


class Episode:
    """An episode: an observation more than actions."""

    def __init__(self, first: Arrays) -> None:
        self.observations = [first]
        self.actions: list[Array] = []
        self.rewards: list[float] = []
        self.infos: list[dict[str, Any]] = []
        self.terminated = False

    def add(self, action: Array, outcome: tuple[Arrays, float, bool, dict[str, Any]]) -> None:
        """Add an action and what it led to: observation, reward, whether the run ended, info."""
        observation, reward, self.terminated, info = outcome
        self.observations.append(observation)
        self.actions.append(action)
        self.rewards.append(reward)
        self.infos.append(info)


def played(
    policy: Callable[[Arrays], Array],
    env: str,
    seeds: Sequence[int],
    num_envs: int = 16,
    options: dict[str, Any] | None = None,
) -> list[Episode]:
    """Play a policy in one episode for each seed, many at once, in the order of the seeds.

    Args:
        policy: Takes observations, arrays (num_envs, …); returns actions (num_envs, 6 + motors) in [−1, 1].
        env: Id of the environment, such as ``palmares/Grasp-SoftHand-v1``.
        seeds: The scenes, 0 to 2**53 - 1.
        num_envs: Episodes at once.
        options: Arguments of ``gymnasium.make`` for the environment, such as ``max_episode_steps``.

    Raises:
        ValueError: There are no seeds, one of them is invalid or there twice, or the environment refuses an
            argument.

    """
    seeds = [whole(f"seeds[{k}]", seed, 0, MAX_SEED) for k, seed in enumerate(seeds)]
    if not seeds or len(set(seeds)) < len(seeds):
        raise ValueError(f"seeds: found {short(seeds)}; wanted at least one, each once")
    count = min(whole("num_envs", num_envs, 1, 100_000), len(seeds))
    mode = AutoresetMode.DISABLED
    envs = gymnasium.make_vec(env, num_envs=count, autoreset_mode=mode, **(options or {}))
    assert isinstance(envs, BatchEnv)
    done = _play(envs, policy, seeds)
    return [done[seed] for seed in seeds]


def _play(envs: BatchEnv, policy: Callable[[Arrays], Array], seeds: Sequence[int]) -> dict[int, Episode]:
    """Return the played episode of each seed."""
    count = envs.num_envs
    playing: list[int | None] = list(seeds[:count])
    waiting = list(seeds[count:])[::-1]
    observations = envs.reset(seed=seeds[:count])[0]
    open_ones = [Episode(_row(observations, k)) for k in range(count)]
    done: dict[int, Episode] = {}
    while len(done) < len(seeds):
        actions = np.asarray(policy(observations), dtype=np.float64)
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        over = terminated | truncated
        for k, seed in enumerate(playing):
            if seed is None:
                continue
            info = {name: infos[name][k].item() for name in INFOS if name in infos}
            outcome = _row(observations, k), float(rewards[k]), bool(terminated[k]), info
            open_ones[k].add(actions[k].copy(), outcome)
            if over[k]:
                done[seed] = open_ones[k]
                playing[k] = waiting.pop() if waiting else None
        if over.any() and len(done) < len(seeds):
            # An environment without a further seed plays on, unrecorded.
            nexts = [seed if over[k] else None for k, seed in enumerate(playing)]
            observations = envs.reset(seed=nexts, options={"reset_mask": over})[0]
            for k in map(int, np.flatnonzero(over)):
                open_ones[k] = Episode(_row(observations, k))
    return done


def _row(observations: Arrays, k: int) -> Arrays:
    """Return the observation of one environment."""
    return {name: cast(Array, values[k].copy()) for name, values in observations.items()}
