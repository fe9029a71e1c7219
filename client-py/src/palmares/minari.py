"""Runs of a policy as a Minari dataset, for offline learning. Needs ``pip install 'palmares[minari]'``.

>>> import palmares.minari                                                   # doctest: +SKIP
... dataset = palmares.minari.collect(
...     "palmares/grasp-softhand/mine-v0", policy, "palmares/Grasp-SoftHand-v1", seeds=range(100)
... )
... dataset[0].observations["objects"]                                       # (steps + 1, 1, 13)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np

try:
    from minari import MinariDataset, StepDataCallback, create_dataset_from_buffers
    from minari.data_collector import EpisodeBuffer
except ImportError as missing:
    raise ImportError("palmares.minari needs minari: pip install 'palmares[minari]'") from missing

from palmares.arrays import Array
from palmares.episodes import INFOS, Episode, played
from palmares.gym.fields import Arrays
from palmares.version import VERSION


class Infos(StepDataCallback):  # type: ignore[misc]
    """Keeps `INFOS` of each step, for a ``minari.DataCollector`` around an environment.

    >>> minari.DataCollector(env, step_data_callback=Infos, record_infos=True)   # doctest: +SKIP
    """

    def __call__(self, *args: Any, **step: Any) -> Any:
        """Return the data of a step."""
        data = super().__call__(*args, **step)
        data["info"] = {name: data["info"].get(name, first) for name, first in INFOS.items()}
        return data


def _buffer(episode: Episode, number: int, seed: int) -> EpisodeBuffer:
    """Return an episode that is over as Minari takes it."""
    steps, first = len(episode.rewards), episode.observations[0]
    ends = np.arange(steps) == steps - 1
    kept = [name for name in INFOS if name in episode.infos[0]]
    columns = {name: [info[name] for info in episode.infos] for name in kept}
    return EpisodeBuffer(
        id=number,
        seed=seed,
        observations={name: np.stack([row[name] for row in episode.observations]) for name in first},
        actions=np.stack(episode.actions),
        rewards=episode.rewards,
        terminations=list(ends & episode.terminated),
        truncations=list(ends & (not episode.terminated)),
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
    options = dict(options or {})
    single = gymnasium.make(env, **options)
    episodes = played(policy, env, seeds, num_envs, options)
    buffers = [
        _buffer(it, number, seed) for number, (it, seed) in enumerate(zip(episodes, seeds, strict=True))
    ]
    metadata = {"requirements": [f"palmares=={VERSION}"]} | metadata
    return create_dataset_from_buffers(dataset_id, buffers, env=single, **metadata)
