"""Play controllers over many scenes, as the event would, and say what their scores come to.

>>> from palmares.evaluate import evaluate                              # doctest: +SKIP
... report = evaluate(["my_controller.py"], tasks=["balls"], hands=["softhand"], seeds=range(1, 101))
... print(report)

A controller is a Python file, or a module, with a function ``run(client, seed)``: it opens a run with
``client.reset(…, seed=seed)``, plays it and ends it with ``client.stop()``. If it has parameters named
``task`` and ``hand``, they are given; otherwise it plays what it plays. The examples are such files.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed

from palmares.evaluate.play import ControllerError, Job, Played, parameters, play
from palmares.evaluate.report import Report
from palmares.evaluate.statistics import Comparison, Spread

Pool = Callable[[Sequence[Job]], Iterator[Played]]
"""Plays jobs somewhere and yields what comes of them, in any order."""


def evaluate(
    controllers: Sequence[str],
    tasks: Sequence[str] = (),
    hands: Sequence[str] = (),
    seeds: Iterable[int] = range(1, 101),
    *,
    url: str = "local",
    replays: str | os.PathLike[str] | None = None,
    pool: Pool | None = None,
    on_played: Callable[[Played], None] = lambda _: None,
) -> Report:
    """Play each controller at each task with each hand over all seeds.

    The report is the same for any pool and any number of processes, if the controllers are deterministic.

    Args:
        controllers: Python files or names of modules; the first is compared with each of the others.
        tasks: Names of tasks, for controllers that take a ``task``; none: whatever they play.
        hands: Names or paths of hands, for controllers that take a ``hand``; none: whatever they play.
        seeds: The scenes.
        url: A server, or ``local`` for worlds in the processes that play.
        replays: Folder for the replay of every run; where `url` is ``local`` each is then played twice.
        pool: Who plays: a process for each core when left out.
        on_played: Called after every run, for progress.

    Raises:
        ControllerError: One cannot be loaded, or does not play what is wanted.

    """
    seeds = list(seeds)
    if replays is not None:
        os.makedirs(replays, exist_ok=True)
    jobs = [
        Job(controller, task, hand, seed, url, None if replays is None else os.fspath(replays))
        for controller in controllers
        for task, hand in _played_by(controller, tasks, hands)
        for seed in seeds
    ]
    outcomes = []
    for played in (pool or processes())(jobs):
        if played.error is None:
            _check(played, tasks, hands)
        outcomes.append(played)
        on_played(played)
    return Report.of(outcomes)


def processes(count: int | None = None) -> Pool:
    """Return a pool of so many processes of this machine, one for each core when left out."""

    def pool(jobs: Sequence[Job]) -> Iterator[Played]:
        context = multiprocessing.get_context("spawn")
        executor = ProcessPoolExecutor(count or len(os.sched_getaffinity(0)), mp_context=context)
        try:
            for done in as_completed([executor.submit(play, job) for job in jobs]):
                yield done.result()
        finally:
            executor.shutdown(cancel_futures=True)

    return pool


def _played_by(
    controller: str, tasks: Sequence[str], hands: Sequence[str]
) -> list[tuple[str | None, str | None]]:
    """Return the tasks and hands that it is told, once each."""
    takes = parameters(controller)
    for word, wanted in (("task", tasks), ("hand", hands)):
        if len(wanted) > 1 and word not in takes:
            raise ControllerError(
                f"{controller}: its `run` has no parameter `{word}`, so it plays one only; "
                f"name at most one of {', '.join(wanted)}"
            )
    told: tuple[Sequence[str | None], Sequence[str | None]] = (tasks or [None], hands or [None])
    return [(task, hand) for task in told[0] for hand in told[1]]


def _check(played: Played, tasks: Sequence[str], hands: Sequence[str]) -> None:
    """Refuse a controller that plays something else."""
    for word, wanted, found in (("task", tasks, played.task), ("hand", hands, played.hand)):
        paths = any(os.sep in name for name in wanted)  # A hand of one's own has a name of its own.
        if wanted and found not in wanted and not paths:
            raise ControllerError(f"{played.controller}: plays the {word} {found!r}, not {', '.join(wanted)}")


__all__ = [
    "Comparison",
    "ControllerError",
    "Job",
    "Played",
    "Pool",
    "Report",
    "Spread",
    "evaluate",
    "processes",
]
