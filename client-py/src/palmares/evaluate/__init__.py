"""Play controllers in many scenes, as a competition does, and summarize their scores.

>>> from palmares.evaluate import evaluate                              # doctest: +SKIP
... report = evaluate("my_controller.py", "balls", "softhand", seeds=range(1, 101))
... print(report)

A controller is a Python file, or a module, with a function ``run(client, seed)``: it opens a run with
``client.reset(…, seed=seed)``, plays it and ends it with ``client.stop()``. Parameters named ``task`` and
``hand`` are passed to it; without them the controller chooses both. The examples are such files.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from inspect import Parameter
from itertools import islice

from palmares import own_task
from palmares.arguments import MAX_SEED, whole
from palmares.client import LOCAL, Client
from palmares.errors import UnknownTaskError
from palmares.evaluate.controller import ControllerError, parameters
from palmares.evaluate.effects import Effect
from palmares.evaluate.play import Job, Played
from palmares.evaluate.report import Report
from palmares.evaluate.statistics import Comparison, Spread
from palmares.evaluate.workers import Pool, processes
from palmares.training import MOST_SAMPLES, Training

MAX_SEEDS = 1_000_000
"""Most scenes of one evaluation"""


def evaluate(
    controllers: str | Sequence[str],
    tasks: str | Sequence[str] = (),
    hands: str | Sequence[str] = (),
    seeds: Iterable[int] = range(1, 101),
    *,
    url: str = LOCAL,
    replays: str | os.PathLike[str] | None = None,
    hand_spread: int = 0,
    step_ms: float | None = None,
    pool: Pool | None = None,
    on_played: Callable[[Played], None] = lambda _: None,
) -> Report:
    """Play each controller at each task with each hand over all seeds.

    The report is the same for any pool and any number of processes, if the controllers are deterministic.

    Args:
        controllers: Python files or names of modules; the first is compared with each of the others.
        tasks: Names or paths of tasks, for controllers with a parameter ``task``; default: its own.
        hands: Names or paths of hands, for controllers with a parameter ``hand``; default: its own.
        seeds: The scenes, 0 to 2**53 - 1.
        url: A server, or ``local`` for worlds in the processes that play.
        replays: Folder for the replay of every run; with `url` ``local`` each run is then played twice.
        hand_spread: Number of drawn hands in each scene; 0 for the hand itself. Over all runs of a row the
            uncertain numbers of the hand (``[uncertain]`` in its ``hand.toml``) form a Latin hypercube, the
            same for every controller.
        step_ms: Longest step of the integration, as `Training.step_ms`: quicker and less exact runs.
        pool: Plays the runs; left out, a process for each core. `palmares.ray.pool` is another.
        on_played: Called after every run, for progress.

    Raises:
        ControllerError: A controller cannot be loaded, or plays another task or hand.
        PalmaresError: A task, hand or server does not exist.

    """
    controllers, tasks, hands = _each_once(controllers), _each_once(tasks), _each_once(hands)
    seeds = _scenes(seeds)
    samples = _samples(len(seeds), hand_spread)
    varied = "drawn hands" if hand_spread else "longer steps"
    if (hand_spread or step_ms is not None) and (url != LOCAL or replays is not None):
        raise ControllerError(f"{varied} are played in this process, without url, and have no replays")
    Training(step_ms=step_ms)  # Checks it.
    names = _names(url, tasks, hands, uncertain=hand_spread > 0)
    if url != LOCAL:  # The pool may play on another machine, without the folder of a task.
        tasks = _each_once([names[task] for task in tasks])
        names |= {task: task for task in tasks}
    if replays is not None:
        own = [hand for hand in hands if names[hand] != hand]
        if own and url == LOCAL:
            raise ControllerError(f"replays of hands of your own need a server (url): {', '.join(own)}")
        os.makedirs(replays, exist_ok=True)
    jobs = [
        Job(
            controller,
            task,
            hand,
            seed,
            url,
            None if replays is None else os.fspath(replays),
            sample,
            step_ms,
        )
        for controller in controllers
        for task, hand in _played_by(controller, tasks, hands)
        for k, seed in enumerate(seeds)
        for sample in samples[k]
    ]
    outcomes = []
    for job, played in (pool or processes())(jobs):
        outcomes.append(_under_given_names(job, played, names))
        on_played(outcomes[-1])
    return Report.of(outcomes)


def _each_once(words: str | Sequence[str]) -> list[str]:
    return [words] if isinstance(words, str) else list(dict.fromkeys(words))


def _scenes(seeds: Iterable[int]) -> list[int]:
    """Return the seeds, each once; refuse invalid seeds, no seeds, and more than `MAX_SEEDS`."""
    some = islice(seeds, MAX_SEEDS + 1)
    found = list(dict.fromkeys(whole("seeds", seed, 0, MAX_SEED) for seed in some))
    if not 1 <= len(found) <= MAX_SEEDS:
        count = f"more than {MAX_SEEDS}" if found else "none"
        raise ValueError(f"seeds: found {count}; wanted 1 to {MAX_SEEDS} of them")
    return found


def _samples(scenes: int, hand_spread: int) -> Sequence[Sequence[tuple[int, int] | None]]:
    """Return the samples of the hand in each scene; ``None`` is the hand itself."""
    count = scenes * whole("hand_spread", hand_spread, 0, MOST_SAMPLES)
    if count == 0:
        return [[None]] * scenes
    whole("hand_spread times the number of scenes", count, 1, MOST_SAMPLES)
    return [[(hand_spread * k + j, count) for j in range(hand_spread)] for k in range(scenes)]


def _names(url: str, tasks: Sequence[str], hands: Sequence[str], *, uncertain: bool) -> dict[str, str]:
    """Return the name of each given task and hand; refuse those that do not exist.

    With `uncertain` also hands that have nothing uncertain.
    """
    with Client(url, team="evaluate") as client:
        known = [task.name for task in client.welcome.tasks]
        names = {task: task if task in known else _own_task(client, task, known) for task in tasks}
        described = {hand: client.describe_hand(hand) for hand in hands}
    without = [hand for hand in hands if uncertain and not described[hand].get("uncertain")]
    if without:
        raise ControllerError(f"no [uncertain] in the hand.toml of {', '.join(without)}: nothing to draw")
    return names | {hand: described[hand]["name"] for hand in hands}


def _own_task(client: Client, task: str, known: Sequence[str]) -> str:
    """Return the name of a task given by its path."""
    name = own_task.name_of(task, known)
    if not client.is_local:
        if name in known:
            return name
        raise UnknownTaskError(f"unknown_task: no task {task!r}; there are: {', '.join(known)}")
    from palmares import sim

    try:
        return sim.welcome(own_tasks=[task]).tasks[-1].name
    except ValueError as unreadable:
        raise UnknownTaskError(f"unknown_task: {unreadable}") from None


def _played_by(
    controller: str, tasks: Sequence[str], hands: Sequence[str]
) -> list[tuple[str | None, str | None]]:
    """Return each pair of task and hand that a controller plays; ``None`` for its own."""
    takes = parameters(controller)
    for word, wanted in (("task", tasks), ("hand", hands)):
        if word in takes and takes[word].default is Parameter.empty and not wanted:
            raise ControllerError(f"{controller}: run() needs `{word}`: pass {word}s=… or --{word}s")
        if len(wanted) > 1 and word not in takes:
            raise ControllerError(
                f"{controller}: run() has no parameter `{word}`, so it plays only one; "
                f"name at most one of {', '.join(wanted)}"
            )
    given: tuple[Sequence[str | None], Sequence[str | None]] = (tasks or [None], hands or [None])
    return [(task, hand) for task in given[0] for hand in given[1]]


def _under_given_names(job: Job, played: Played, names: dict[str, str]) -> Played:
    """Return the outcome with controller, task and hand as the caller named them; refuse other ones.

    The paths keep two hands of the same name separate, such as one of the program and a changed copy.
    """
    for word, given, found in (("task", job.task, played.task), ("hand", job.hand, played.hand)):
        wanted = names.get(given or "")
        if wanted and found and found != wanted:
            raise ControllerError(f"{job.controller}: plays the {word} {found!r}, not {wanted!r}")
    return replace(
        played,
        controller=job.controller,
        task=job.task or played.task,
        hand=job.hand or played.hand,
        hand_sample=job.hand_sample,
    )


__all__ = [
    "Comparison",
    "ControllerError",
    "Effect",
    "Job",
    "Played",
    "Pool",
    "Report",
    "Spread",
    "evaluate",
    "processes",
]
