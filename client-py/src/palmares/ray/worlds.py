"""Worlds on a Ray cluster, many in each worker."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Literal

import ray
from tqdm import tqdm

from palmares.arrays import Array
from palmares.evaluate import Played, Report
from palmares.ray.parcel import Parcel, of_files
from palmares.ray.runs import OPTIONS, build, check_build, connect, finished
from palmares.sim import Batch
from palmares.sim.batch import Arrays
from palmares.training import Training

Policy = Callable[[Arrays], Array]
"""Takes observations, arrays (N, …), and returns actions (N, 6 + motors), as `palmares.sim.Batch` has them"""


class BatchActor(Batch):
    """A `Batch` in a worker, stepped by one thread; `batches` makes actors of it."""

    def __init__(
        self,
        wanted: str,
        task: str,
        hand: str,
        parcels: Sequence[Parcel | None],
        worlds: int,
        kind: dict[str, Any],
    ) -> None:
        check_build(wanted)
        with tempfile.TemporaryDirectory(prefix="palmares-") as folder:
            task, hand = (
                parcel.unpack(Path(folder) / place) if parcel else name
                for name, place, parcel in zip((task, hand), ("task", "hand"), parcels, strict=True)
            )
            super().__init__(task, hand, worlds, threads=1, **kind)


def batches(
    count: int,
    task: str,
    hand: str,
    worlds: int,
    *,
    sensing: Literal["sensors", "truth"] = "truth",
    noise: Literal["none", "real"] = "none",
    training: Training | None = None,
    address: str | None = None,
    **options: Any,
) -> list[Any]:
    """Return actors of Ray with a `palmares.sim.Batch` each, for a training that steps worlds itself.

    >>> actors = batches(4, "balls", "softhand", worlds=16)               # doctest: +SKIP
    ... ray.get([actor.reset.remote(seeds) for actor, seeds in zip(actors, parts)])
    ... steps = ray.get([actor.step.remote(actions) for actor, actions in zip(actors, given)])

    The methods are those of `Batch`. An actor whose worker is lost is started anew by Ray; its worlds have
    no runs then, and `step` says so until they are reset.

    Args:
        count: How many actors.
        task: Name of a task, or the path of your own.
        hand: Name of a hand, or the path of your own.
        worlds: N, the number of worlds of each.
        sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
        noise: ``none`` or ``real``.
        training: Shaped rewards, and runs that differ from the task's, as for `Batch`.
        address: As for `palmares.ray.pool`.
        options: Those of `ray.remote` for an actor; without them a core for each, spread over the machines,
            started anew as often as need be.

    """
    connect(address)
    ours = {"num_cpus": 1, "max_restarts": -1, "scheduling_strategy": "SPREAD"}
    actor = ray.remote(BatchActor).options(**ours | options)
    kind = {"sensing": sensing, "noise": noise, "training": training}
    parcels = (of_files(task), of_files(hand))
    return [actor.remote(build(), task, hand, parcels, worlds, kind) for _ in range(count)]


def rollouts(
    policy: Policy,
    task: str,
    hand: str,
    seeds: Iterable[int],
    *,
    worlds: int = 16,
    ticks: int = 10,
    sensing: Literal["sensors", "truth"] = "truth",
    noise: Literal["none", "real"] = "none",
    name: str | None = None,
    address: str | None = None,
    progress: bool = True,
    **options: Any,
) -> Report:
    """Play a policy over many scenes, some at a time in each worker, up to the end of every run.

    The policy is sent to the workers. Each group of `worlds` seeds is a task of Ray, played by a copy of its
    own of what was given here; if its worker is lost, it is played again elsewhere. So the report depends
    neither on the number of workers nor on what becomes of them.

    Args:
        policy: Takes observations, arrays (N, …), and returns actions (N, 6 + motors), as
            `palmares.sim.Batch` has them: finite, also for runs that are over, which stand still.
        task: Name of a task, or the path of your own.
        hand: Name of a hand, or the path of your own.
        seeds: The scenes.
        worlds: How many seeds are played at a time in one worker.
        ticks: Ticks under each action.
        sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
        noise: ``none`` or ``real``.
        name: What the policy is called in the report.
        address: As for `palmares.ray.pool`.
        progress: Whether to show a bar, on standard error.
        options: As for `palmares.ray.pool`.

    Raises:
        RayTaskError: The policy failed.

    """
    connect(address)
    seeds = list(dict.fromkeys(seeds))
    groups = [seeds[first : first + worlds] for first in range(0, len(seeds), worlds)]
    remote, wanted = ray.remote(_roll_out).options(**OPTIONS | options), build()
    kind = {"sensing": sensing, "noise": noise}
    sent, parcels = ray.put(policy), ray.put((of_files(task), of_files(hand)))
    waiting = {
        remote.remote(sent, wanted, task, hand, parcels, group, ticks, kind): group for group in groups
    }
    called = name or str(getattr(policy, "__name__", type(policy).__name__))
    runs: list[Played] = []
    with tqdm(total=len(seeds), unit="run", file=sys.stderr, disable=not progress) as bar:
        for group, ref in finished(waiting):
            for seed, result in zip(group, ray.get(ref), strict=True):
                runs.append(Played(called, task, hand, seed, **result))
            bar.update(len(group))
    return Report.of(runs)


def _roll_out(
    policy: Policy,
    wanted: str,
    task: str,
    hand: str,
    parcels: Sequence[Parcel | None],
    seeds: list[int],
    ticks: int,
    kind: dict[str, Any],
) -> list[dict[str, Any]]:
    """Play a run for each seed; return the fields of `Played` that the referee knows."""
    batch = BatchActor(wanted, task, hand, parcels, len(seeds), kind)
    observations = batch.reset(seeds)
    while not batch.done.all():
        observations = batch.step(policy(observations), ticks, ~batch.done).observations
    told = []
    for world in range(len(seeds)):
        result = batch.result(world) or {}
        told.append({key: value for key, value in result.items() if key != "ticks"})
    return told
