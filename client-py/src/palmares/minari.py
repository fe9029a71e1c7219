"""Runs of a policy as a Minari dataset, for offline learning. Needs ``pip install 'palmares[minari]'``.

>>> import palmares.minari                                                   # doctest: +SKIP
... dataset = palmares.minari.collect(
...     "palmares/grasp-softhand/mine-v0", policy, "palmares/Grasp-SoftHand-v1", seeds=range(100)
... )
... dataset[0].observations["objects"]                                       # (steps + 1, 1, 13)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

try:
    from minari import MinariDataset, StepDataCallback, create_dataset_from_buffers
    from minari.data_collector import EpisodeBuffer
except ImportError as missing:
    raise ImportError("palmares.minari needs minari: pip install 'palmares[minari]'") from missing

from palmares.arguments import MAX_SEED, short, whole
from palmares.arrays import Array
from palmares.gym.batch import BatchEnv
from palmares.gym.fields import Arrays
from palmares.version import VERSION

INFOS = {"tick": 0, "score": 0.0, "is_success": False, "shaping": 0.0}
"""Entries of infos that a dataset keeps, each (steps + 1,), with their values after a reset"""


class Infos(StepDataCallback):  # type: ignore[misc]
    """Keeps `INFOS` of each step, for a ``minari.DataCollector`` around an environment.

    >>> minari.DataCollector(env, step_data_callback=Infos, record_infos=True)   # doctest: +SKIP
    """

    def __call__(self, *args: Any, **step: Any) -> Any:
        """Return the data of a step."""
        data = super().__call__(*args, **step)
        data["info"] = {name: data["info"].get(name, first) for name, first in INFOS.items()}
        return data


class _Episode:
    """An episode that is being played."""

    def __init__(self, first: Arrays) -> None:
        self._observations = [first]
        self._actions: list[Array] = []
        self._rewards: list[float] = []
        self._infos: list[dict[str, Any]] = []
        self._terminated = False

    def add(self, action: Array, outcome: tuple[Arrays, float, bool, dict[str, Any]]) -> None:
        observation, reward, self._terminated, info = outcome
        self._observations.append(observation)
        self._actions.append(action)
        self._rewards.append(reward)
        self._infos.append(info)

    def buffer(self, number: int, seed: int) -> EpisodeBuffer:
        """Return it as Minari takes it; it is over."""
        steps, first = len(self._rewards), self._observations[0]
        ends = np.arange(steps) == steps - 1
        kept = [name for name in INFOS if name in self._infos[0]]
        columns = {name: [info[name] for info in self._infos] for name in kept}
        return EpisodeBuffer(
            id=number,
            seed=seed,
            observations={name: np.stack([row[name] for row in self._observations]) for name in first},
            actions=np.stack(self._actions),
            rewards=self._rewards,
            terminations=list(ends & self._terminated),
            truncations=list(ends & (not self._terminated)),
            infos={name: np.array([INFOS[name], *values]) for name, values in columns.items()},
        )


def collect(
    dataset_id: str,
    policy: Callable[[Arrays], Array],
    env: str,
    seeds: Sequence[int],
    *,
    num_envs: int = 16,
    options: dict[str, Any] | None = None,
    **metadata: Any,
) -> MinariDataset:
    """Play a policy in one episode for each seed, many at once; keep them as a dataset of Minari.

    The episodes are in the order of the seeds, and the same for any `num_envs`. Their infos have the entries
    `INFOS`. The dataset knows its environment, which ``dataset.recover_environment()`` makes.

    Args:
        dataset_id: ``NAMESPACE/NAME-v0``, as Minari has it.
        policy: Takes observations, arrays (num_envs, …); returns actions (num_envs, 6 + motors) in [−1, 1].
        env: Id of the environment, such as ``palmares/Grasp-SoftHand-v1``.
        seeds: The scenes, 0 to 2**53 - 1.
        num_envs: Episodes at once.
        options: Arguments of ``gymnasium.make`` for the environment, such as ``max_episode_steps``.
        metadata: Arguments of ``minari.create_dataset_from_buffers``, such as ``author`` and
            ``algorithm_name``.

    Raises:
        ValueError: There are no seeds, one of them is invalid or there twice, the dataset exists, or an
            argument is refused by the environment or Minari.

    """
    seeds = [whole(f"seeds[{k}]", seed, 0, MAX_SEED) for k, seed in enumerate(seeds)]
    if not seeds or len(set(seeds)) < len(seeds):
        raise ValueError(f"seeds: found {short(seeds)}; wanted at least one, each once")
    count = min(whole("num_envs", num_envs, 1, 100_000), len(seeds))
    options = dict(options or {})
    single = gymnasium.make(env, **options)
    mode = AutoresetMode.DISABLED
    envs = gymnasium.make_vec(env, num_envs=count, autoreset_mode=mode, **options)
    assert isinstance(envs, BatchEnv)
    done = _play(envs, policy, seeds)
    buffers = [done[seed].buffer(number, seed) for number, seed in enumerate(seeds)]
    metadata = {"requirements": [f"palmares=={VERSION}"]} | metadata
    return create_dataset_from_buffers(dataset_id, buffers, env=single, **metadata)


def _play(envs: BatchEnv, policy: Callable[[Arrays], Array], seeds: Sequence[int]) -> dict[int, _Episode]:
    """Return the played episode of each seed."""
    count = envs.num_envs
    playing: list[int | None] = list(seeds[:count])
    waiting = list(seeds[count:])[::-1]
    observations = envs.reset(seed=seeds[:count])[0]
    open_ones = [_Episode(_row(observations, k)) for k in range(count)]
    done: dict[int, _Episode] = {}
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
                open_ones[k] = _Episode(_row(observations, k))
    return done


def _row(observations: Arrays, k: int) -> Arrays:
    """Return the observation of one environment."""
    return {name: cast(Array, values[k].copy()) for name, values in observations.items()}
