"""One run of a controller, in this process."""

from __future__ import annotations

import contextlib
import inspect
import logging
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palmares.client import Client
from palmares.evaluate.controller import ControllerError, loaded
from palmares.messages import Result
from palmares.training import Training
from palmares.views import Brief


@dataclass(frozen=True)
class Job:
    """A run to be played.

    Attributes:
        controller: A Python file, or the name of a module.
        task: Passed to the controller if it has such a parameter.
        hand: Passed to the controller if it has such a parameter.
        seed: The scene.
        url: The server; ``local`` for this process.
        replays: Folder for the replay; ``None`` for no replay.
        hand_sample: Sample of the hand, as `Training.hand_sample`; ``None`` for the hand itself.
        step_ms: Longest step, as `Training.step_ms`; ``None`` for the task's.

    """

    controller: str
    task: str | None
    hand: str | None
    seed: int
    url: str = "local"
    replays: str | None = None
    hand_sample: tuple[int, int] | None = None
    step_ms: float | None = None


@dataclass(frozen=True, repr=False)
class Played(Brief):
    """Outcome of a run.

    Attributes:
        sensing: ``truth`` or ``sensors``, with ``+ noise`` if the sensors have errors.
        task: Task of the run; empty if the controller failed before it opened one.
        hand: Hand of the run; likewise.
        score: The referee's score, also if the controller failed in the run; 0 without a run.
        wall_s: Duration, with loading the controller, s.
        replay: Path of the replay, or its address on the server.
        error: The controller's exception in one line, if there was one.
        hand_sample: That of the job.
        hand_drawn: The drawn numbers of the hand by name; empty for the hand itself.

    """

    controller: str
    task: str
    hand: str
    seed: int
    sensing: str = ""
    score: float = 0.0
    in_goal: int = 0
    outside: int = 0
    reason: str = "failed"
    sim_time_s: float = 0.0
    wall_s: float = 0.0
    run_id: str = ""
    state_hash: str = ""
    replay: str | None = None
    error: str | None = None
    hand_sample: tuple[int, int] | None = None
    hand_drawn: Mapping[str, float] = field(default_factory=dict)


def play(job: Job) -> Played:
    """Play a run; an error of the controller is part of the outcome.

    Output of the controller goes to standard error.
    """
    logging.getLogger().setLevel(logging.ERROR)  # A log of hundreds of runs would be too long.
    begun, result, replay, error, sensing = time.perf_counter(), None, None, None, ""
    varied = Training(hand_sample=job.hand_sample, step_ms=job.step_ms)
    training = varied if varied.varies else None
    drawn: dict[str, float] = {}
    try:
        with (
            contextlib.redirect_stdout(sys.stderr),
            loaded(job.controller) as run,
            Client(job.url, team=Path(job.controller).stem[:64], training=training) as client,
        ):
            error = _failure(run, client, job)
            # The objects are counted also after an error of the controller.
            result = client.stop() if client.tick is not None else client.result
            if result is not None:
                replay = _kept(client, result, job)
                sensing = client.run.sensing + (" + noise" if client.run.noise == "real" else "")
                drawn = {} if client.world is None else client.world.hand_drawn
    except (Exception, SystemExit) as raised:
        error = error or one_line(raised, job.controller)
    wall_s = time.perf_counter() - begun
    if result is None:
        return Played(job.controller, "", "", job.seed, wall_s=wall_s, error=error)
    return Played(
        job.controller,
        result.task,
        result.hand,
        job.seed,
        sensing,
        result.score,
        result.in_goal,
        result.outside,
        result.reason,
        result.sim_time_s,
        wall_s,
        result.run_id,
        result.state_hash,
        replay,
        error,
        hand_drawn=drawn,
    )


def _failure(run: Callable[..., Any], client: Client, job: Job) -> str | None:
    """Let the controller play; return its error, if there is one."""
    takes = inspect.signature(run).parameters
    choices = (("task", job.task), ("hand", job.hand))
    arguments = {name: value for name, value in choices if name in takes and value is not None}
    try:
        run(client, job.seed, **arguments)
    except (Exception, SystemExit) as raised:
        return one_line(raised, job.controller)
    if client.result is None or client.tick is not None:
        return one_line(ControllerError("it ended without client.stop()"), job.controller)
    return None


def _kept(client: Client, result: Result, job: Job) -> str | None:
    if job.replays is not None:
        path = Path(job.replays) / f"{result.run_id}.mcap"
        client.save_replay(path)
        return str(path)
    return None if client.is_local else f"{job.url.rstrip('/')}/replay/{result.run_id}"


def one_line(error: BaseException, controller: str) -> str:
    """Return an error as one line, with its place in the controller's own code if possible."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).name == Path(controller).name]
    at = (own or frames)[-1:]
    where = "".join(f" ({Path(frame.filename).name}:{frame.lineno})" for frame in at)
    return f"{type(error).__name__}: {error}{where}".replace("\n", " ")
