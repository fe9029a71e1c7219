"""Worlds on a Ray cluster, many in each worker."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import ray
from tqdm import tqdm

from palmares.arguments import Noise, Sensing
from palmares.arrays import Array
from palmares.evaluate import Played, Report
from palmares.ray.parcel import Parcel, of_files
from palmares.ray.runs import OPTIONS, build, check_build, connect, finished
from palmares.sim import Batch
from palmares.sim.batch import Arrays
from palmares.training import Training

Policy = Callable[[Arrays], Array]
"""Maps observations, arrays (N, …), to actions (N, 6 + motors), both as in `palmares.sim.Batch`"""


class BatchActor(Batch):
    """A `Batch` in a worker, stepped by one thread; `batches` makes actors from it."""

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
    sensing: Sensing = "truth",
    noise: Noise = "none",
    training: Training | None = None,
    address: str | None = None,
    **options: Any,
) -> list[Any]:
    """Return actors of Ray, each with a `palmares.sim.Batch`, for a training that steps worlds itself.

    >>> actors = batches(4, "balls", "softhand", worlds=16)               # doctest: +SKIP
    ... ray.get([actor.reset.remote(seeds) for actor, seeds in zip(actors, parts)])
    ... steps = ray.get([actor.step.remote(actions) for actor, actions in zip(actors, given)])

    The methods are those of `Batch`. Ray restarts an actor whose worker is lost; its worlds then have no
    runs, and `step` raises an error until they are reset.

    Args:
        count: Number of actors.
        task: Name of a task, or the path of your own.
        hand: Name of a hand, or the path of your own.
        worlds: N, the number of worlds of each actor.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``.
        training: Shaped rewards, and runs that differ from the task's, as for `Batch`.
        address: As for `palmares.ray.pool`.
        options: Options of `ray.remote` for an actor. Default: one core each, spread over the machines, and
            any number of restarts.

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
    sensing: Sensing = "truth",
    noise: Noise = "none",
    name: str | None = None,
    address: str | None = None,
    progress: bool = True,
    **options: Any,
) -> Report:
    """Play a policy in many scenes, several at once in each worker, to the end of every run.

    Each group of `worlds` seeds is a task of Ray with its own copy of the policy; if its worker is lost, it
    is played again elsewhere. So the report does not depend on the number of workers or on lost ones.

    Args:
        policy: Maps observations, arrays (N, …), to actions (N, 6 + motors), both as in `palmares.sim.Batch`.
            Actions are finite, also those of runs that are over, which have no effect.
        task: Name of a task, or the path of your own.
        hand: Name of a hand, or the path of your own.
        seeds: The scenes.
        worlds: Number of seeds that one worker plays at once.
        ticks: Ticks under each action.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``.
        name: Name of the policy in the report.
        address: As for `palmares.ray.pool`.
        progress: Whether to show a bar on standard error.
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
    """Play a run for each seed; return the fields of `Played` that a result has."""
    batch = BatchActor(wanted, task, hand, parcels, len(seeds), kind)
    observations = batch.reset(seeds)
    while not batch.done.all():
        observations = batch.step(policy(observations), ticks, ~batch.done).observations
    known = {field.name for field in fields(Played)}
    results = [batch.result(world) or {} for world in range(len(seeds))]
    return [{key: value for key, value in result.items() if key in known} for result in results]
