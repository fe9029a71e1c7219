"""Runs in processes of this machine."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import TypeAlias

from palmares.evaluate.play import Job, Played, play

Pool: TypeAlias = Callable[[Sequence[Job]], Iterator[tuple[Job, Played]]]
"""Plays jobs somewhere and yields each with what came of it, in any order."""


def processes(count: int | None = None) -> Pool:
    """Return a pool of so many processes of this machine, one for each core when left out.

    A run whose process ends, as by a fault of compiled code, has failed; another process takes its place.
    """

    def pool(jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
        wanted = min(count or len(os.sched_getaffinity(0)), len(jobs))
        waiting, busy = deque(jobs), dict[Connection, tuple[_Worker, Job]]()
        workers: list[_Worker] = []
        try:
            for _ in range(wanted):
                workers.append(_Worker())
                busy[workers[-1].connection] = workers[-1], workers[-1].give(waiting.popleft())
            while busy:
                for ready in wait(list(busy)):
                    assert isinstance(ready, Connection)
                    worker, job = busy.pop(ready)
                    played = worker.take(job)
                    if waiting:
                        if not worker.process.is_alive():
                            worker = _Worker()
                            workers.append(worker)
                        busy[worker.connection] = worker, worker.give(waiting.popleft())
                    yield job, played
        finally:
            for worker in workers:
                worker.process.terminate()
            for worker in workers:
                worker.process.join()
                worker.connection.close()

    return pool


class _Worker:
    """A process that plays one run at a time."""

    def __init__(self) -> None:
        # A process of its own kind: whatever the parent has open is not in it.
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def give(self, job: Job) -> Job:
        """Send it a run."""
        with contextlib.suppress(BrokenPipeError):  # Which `take` tells.
            self.connection.send(job)
        return job

    def take(self, job: Job) -> Played:
        """Return what came of its run; wait for it."""
        try:
            played: Played = self.connection.recv()
        except (EOFError, ConnectionResetError):
            self.process.join()
            code = self.process.exitcode
            how = f"exit code {code}" if code is None or code >= 0 else signal.Signals(-code).name
            return Played(job.controller, "", "", job.seed, error=f"its process ended: {how}")
        return played


def _serve(connection: Connection) -> None:
    """Play runs until the parent ends it, or ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's.
    with contextlib.suppress(EOFError):
        while True:
            connection.send(play(connection.recv()))
