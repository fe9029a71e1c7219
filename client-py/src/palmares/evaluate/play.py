"""One run of a controller, in whatever process."""

from __future__ import annotations

import contextlib
import inspect
import logging
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palmares.client import Client
from palmares.evaluate.controller import ControllerError, loaded
from palmares.messages import Result


@dataclass(frozen=True)
class Job:
    """A run to be played.

    Attributes:
        controller: A Python file, or the name of a module.
        task: Passed to the controller if it takes one.
        hand: Passed to the controller if it takes one.
        seed: The scene.
        url: The server; ``local`` for this process.
        replays: Folder for the replay; ``None`` for no replay.

    """

    controller: str
    task: str | None
    hand: str | None
    seed: int
    url: str = "local"
    replays: str | None = None


@dataclass(frozen=True)
class Played:
    """What came of a run.

    Attributes:
        sensing: ``truth`` or ``sensors``, with ``+ noise`` where they err as real ones do.
        task: The one it played; empty if it failed before.
        hand: Likewise.
        score: What the referee counted, also of a run in which the controller failed; 0 where there was none.
        wall_s: How long it took, with loading the controller, s.
        replay: Path of the replay, or its address on the server.
        error: What the controller raised, if it did.

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


def play(job: Job) -> Played:
    """Play a run; an error of the controller is part of the outcome.

    What the controller prints goes to standard error.
    """
    logging.getLogger().setLevel(logging.ERROR)  # Of a hundred runs nobody reads every step.
    begun, result, replay, error, sensing = time.perf_counter(), None, None, None, ""
    try:
        with (
            contextlib.redirect_stdout(sys.stderr),
            loaded(job.controller) as run,
            Client(job.url, team=Path(job.controller).stem[:64]) as client,
        ):
            error = _failure(run, client, job)
            # Whatever became of the controller, the objects lie somewhere, and are counted.
            result = client.stop() if client.tick is not None else client.result
            if result is not None:
                replay = _kept(client, result, job)
                sensing = client.run.sensing + (" + noise" if client.run.noise == "real" else "")
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
    )


def _failure(run: Callable[..., Any], client: Client, job: Job) -> str | None:
    """Let the controller play; return what it fails with, if it does."""
    takes = inspect.signature(run).parameters
    told_to = (("task", job.task), ("hand", job.hand))
    arguments = {name: value for name, value in told_to if name in takes and value is not None}
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
    """Return an error as one line, with the place in the controller's own code where there is one."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).name == Path(controller).name]
    at = (own or frames)[-1:]
    where = "".join(f" ({Path(frame.filename).name}:{frame.lineno})" for frame in at)
    return f"{type(error).__name__}: {error}{where}".replace("\n", " ")
