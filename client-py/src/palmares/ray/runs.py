"""Runs of controllers on a Ray cluster."""

from __future__ import annotations

import functools
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import ray
from ray.exceptions import RayError, RayTaskError
from tqdm import tqdm

import palmares.evaluate
from palmares.client import LOCAL
from palmares.evaluate import ControllerError, Job, Played, Pool, Report
from palmares.evaluate.play import play
from palmares.ray.parcel import Parcel, of_controller, of_files
from palmares.version import VERSION

OPTIONS = {"num_cpus": 1, "max_retries": 5, "scheduling_strategy": "SPREAD"}
"""Options of Ray for a run, unless a caller replaces them"""
# Period of the progress bar.
LOOK_S = 0.5

Task = TypeVar("Task")


def evaluate(
    controllers: str | Sequence[str],
    tasks: str | Sequence[str] = (),
    hands: str | Sequence[str] = (),
    seeds: Iterable[int] = range(1, 101),
    *,
    address: str | None = None,
    url: str = LOCAL,
    replays: str | os.PathLike[str] | None = None,
    hand_spread: int = 0,
    step_ms: float | None = None,
    progress: bool = True,
    **options: Any,
) -> Report:
    """Play controllers as `palmares.evaluate.evaluate` does, on all machines of a cluster.

    Args:
        controllers: Python files or names of modules.
        tasks: Names or paths of tasks.
        hands: Names or paths of hands.
        seeds: The scenes.
        address: As for `pool`.
        url: A server that every machine reaches, or ``local`` for worlds in the workers.
        replays: Folder on this machine.
        hand_spread: Number of drawn hands in each scene.
        step_ms: Longest step, as `palmares.Training.step_ms`.
        progress: Whether to show a bar on standard error.
        options: As for `pool`.

    """
    with tqdm(unit="run", file=sys.stderr, disable=not progress) as bar:
        here = pool(address, **options)

        def counted(jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
            bar.reset(len(jobs))
            for job, played in here(jobs):
                yield job, played
                bar.update()

        return palmares.evaluate.evaluate(
            controllers,
            tasks,
            hands,
            seeds,
            url=url,
            replays=replays,
            hand_spread=hand_spread,
            step_ms=step_ms,
            pool=counted,
        )


def pool(address: str | None = None, **options: Any) -> Pool:
    """Return a pool for `palmares.evaluate.evaluate`, in which every run is a task of Ray.

    The worker receives the controller's file, the modules it imports from its folder, and the files of hands
    and tasks given by a path. A controller given as a module must be installed there. When a worker is lost,
    its run is played again elsewhere; after ``max_retries`` losses, for example by a crash of compiled code,
    the run has failed.

    Args:
        address: Address of the cluster, as for `ray.init`. Left out: the cluster of this process, else that
            of this machine, else a new one on this machine alone.
        options: Options of `ray.remote` for a task, such as ``num_cpus``, ``num_gpus`` and ``max_retries``;
            they replace those of `OPTIONS`.

    """

    def play_all(jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
        connect(address)
        send = functools.cache(lambda pack, name: ray.put(pack(name)))
        remote, wanted = ray.remote(_play).options(**OPTIONS | options), build()
        waiting = {
            remote.remote(
                job,
                wanted,
                send(of_controller, job.controller),
                send(of_files, job.task) if job.url == LOCAL else None,
                send(of_files, job.hand) if job.url == LOCAL else None,
            ): job
            for job in jobs
        }
        for job, ref in finished(waiting):
            yield job, _got(job, ref)

    return play_all


def calls(
    address: str | None = None, **options: Any
) -> Callable[[Callable[[Any], Any], Sequence[Any]], Iterator[Any]]:
    """Return a pool for `palmares.grasps.make`, in which every call of a function is a task of Ray.

    Args:
        address: As for `pool`.
        options: As for `pool`.

    """

    def run(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[Any]:
        connect(address)
        remote, wanted, sent = ray.remote(_call).options(**OPTIONS | options), build(), ray.put(function)
        waiting = {remote.remote(wanted, sent, item): item for item in items}
        for _, ref in finished(waiting):
            yield ray.get(ref)

    return run


def connect(address: str | None) -> None:
    """Connect this process to a cluster, unless it is connected."""
    if address is not None or not ray.is_initialized():
        ray.init(address, logging_level=logging.WARNING)


def finished(waiting: Mapping[Any, Task]) -> Iterator[tuple[Task, Any]]:
    """Yield each task with its reference when it has finished; cancel the others at the end."""
    left = dict(waiting)
    try:
        while left:
            ready, _ = ray.wait(list(left), num_returns=len(left), timeout=LOOK_S)
            for ref in ready:
                yield left.pop(ref), ref
    finally:
        for ref in left:
            ray.cancel(ref)


def build() -> str:
    """Return the build of the package on this machine."""
    try:
        from palmares import sim
    except ImportError:
        return f"{VERSION} without its compiled part"
    server = sim.welcome().server
    return f"{server.version}, build {server.build_hash}"


def check_build(wanted: str) -> None:
    """Refuse to play on a machine with another build, whose results may differ.

    Raises:
        RuntimeError: The build differs.

    """
    if build() != wanted:
        node = ray.util.get_node_ip_address()
        raise RuntimeError(f"{node} has palmares {build()}, not {wanted}: install the same wheel everywhere")


def _call(wanted: str, function: Callable[[Any], Any], item: Any) -> Any:
    """Call a function in this worker."""
    check_build(wanted)
    return function(item)


def _play(
    job: Job, wanted: str, controller: Parcel | None, task: Parcel | None, hand: Parcel | None
) -> tuple[Played, bytes | None]:
    """Play a run in this worker; return the outcome and the contents of its replay."""
    check_build(wanted)
    with tempfile.TemporaryDirectory(prefix="palmares-") as name:
        folder = Path(name)
        there = replace(
            job,
            controller=controller.unpack(folder / "controller") if controller else job.controller,
            task=task.unpack(folder / "task") if task else job.task,
            hand=hand.unpack(folder / "hand") if hand else job.hand,
            replays=job.replays and name,
        )
        played = play(there)
        path = played.replay if job.replays else None
        return played, None if path is None else Path(path).read_bytes()


def _got(job: Job, ref: Any) -> Played:
    """Return the outcome of a run; write its replay on this machine."""
    played: Played
    try:
        played, replay = ray.get(ref)
    except RayTaskError as error:
        raise ControllerError(f"on a worker: {error.cause or error}") from error
    except RayError as lost:
        reason = str(lost).split("\n", 1)[0]
        return Played(job.controller, "", "", job.seed, error=f"its worker was lost: {reason}")
    if replay is None or job.replays is None:
        return played
    path = Path(job.replays) / f"{played.run_id}.mcap"
    path.write_bytes(replay)
    return replace(played, replay=str(path))
