"""One run of a controller, in whatever process."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
import logging
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palmares.client import Client


class ControllerError(Exception):
    """The controller cannot be loaded or played."""


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
        error: What the controller raised, if it did; the score is then 0.
        replay: Path of the replay.

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
    """Play a run; an error of the controller is part of the outcome."""
    logging.getLogger().setLevel(logging.ERROR)  # Of a hundred runs nobody reads every step.
    failed = Played(job.controller, job.task or "", job.hand or "", job.seed)
    try:
        run, wanted = _loaded(job.controller)
        # What is not told is the controller's own to choose.
        told = (("task", job.task), ("hand", job.hand))
        arguments = {name: value for name, value in told if name in wanted and value is not None}
        begun = time.perf_counter()
        with Client(job.url, team=Path(job.controller).stem[:64]) as client:
            run(client, job.seed, **arguments)
            result = client.result
            if result is None:
                raise ControllerError("it ended without client.stop(): there is no result")
            replay = _kept(client, job)
            opened = client.run
        return Played(
            job.controller,
            result.task,
            result.hand,
            job.seed,
            opened.sensing + (" + noise" if opened.noise == "real" else ""),
            result.score,
            result.in_goal,
            result.outside,
            result.reason,
            result.sim_time_s,
            time.perf_counter() - begun,
            result.run_id,
            result.state_hash,
            replay,
        )
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        return replace(
            failed, error=f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"
        )


def _kept(client: Client, job: Job) -> str | None:
    if job.replays is None or client.result is None:
        return None
    path = Path(job.replays) / f"{client.result.run_id}.mcap"
    client.save_replay(path)
    return str(path)


@functools.cache
def _loaded(controller: str) -> tuple[Callable[..., Any], frozenset[str]]:
    """Return the controller's function `run` and the names of its parameters."""
    path = Path(controller)
    if path.suffix == ".py" or path.exists():
        if not path.is_file():
            raise ControllerError(f"{controller}: no such file")
        sys.path.insert(0, str(path.resolve().parent))  # For what lies beside it, as when Python runs it.
        spec = importlib.util.spec_from_file_location(path.stem, path)
        if spec is None or spec.loader is None:
            raise ControllerError(f"{controller}: not a Python file")
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        spec.loader.exec_module(module)
    else:
        module = importlib.import_module(controller)
    run = getattr(module, "run", None)
    if not callable(run):
        raise ControllerError(f"{controller}: has no function `run(client, seed)`")
    return run, frozenset(inspect.signature(run).parameters)


def parameters(controller: str) -> frozenset[str]:
    """Return the names of the parameters of the controller's `run`.

    Raises:
        ControllerError: It cannot be loaded, or has no such function.

    """
    try:
        return _loaded(controller)[1]
    except ControllerError:
        raise
    except Exception as error:
        raise ControllerError(f"{controller}: {type(error).__name__}: {error}") from error
