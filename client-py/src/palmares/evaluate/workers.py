"""A pool of processes on this machine that play runs."""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import TypeAlias

from palmares.evaluate.play import Job, Played, play

Pool: TypeAlias = Callable[[Sequence[Job]], Iterator[tuple[Job, Played]]]
"""Plays jobs and yields each with its outcome, in any order"""


def cores() -> int:
    """Return how many cores this process can use; macOS and Windows know only how many there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processes(count: int | None = None, timeout_s: float | None = None) -> Pool:
    """Return a pool of `count` processes of this machine; left out, one for each core.

    A run fails if its process ends, for example by a crash of compiled code, or if it takes longer than
    `timeout_s`; another process then replaces the first. After Ctrl-C the exception's notes name the open
    runs.
    """

    def pool(jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
        waiting, idle, busy = deque(jobs), list[_Worker](), list[_Worker]()
        try:
            while waiting or busy:
                while waiting and len(busy) < (count or cores()):
                    worker = idle.pop() if idle else _Worker()
                    worker.give(waiting.popleft())
                    busy.append(worker)
                for worker in _ended(busy, timeout_s):
                    busy.remove(worker)
                    played = worker.take(timeout_s)
                    if worker.process.is_alive():
                        idle.append(worker)
                    yield worker.job, played
        except KeyboardInterrupt as stop:
            if busy:
                stop.add_note(", ".join(f"{each.job.controller} seed {each.job.seed}" for each in busy))
            raise
        finally:
            for worker in [*idle, *busy]:
                worker.end()

    return pool


def _ended(busy: Sequence[_Worker], timeout_s: float | None) -> list[_Worker]:
    """Wait until runs have ended or exceeded their time; return their workers."""
    left_s = None
    if timeout_s is not None:
        left_s = max(0.0, min(worker.begun for worker in busy) + timeout_s - time.monotonic())
    ready = wait([worker.connection for worker in busy], left_s)
    late = time.monotonic() - (timeout_s or math.inf)
    return [worker for worker in busy if worker.connection in ready or worker.begun <= late]


class _Worker:
    """A process that plays one run at a time.

    Attributes:
        job: Its current or last run.
        begun: Start of that run, monotonic clock, s.

    """

    job: Job
    begun: float

    def __init__(self) -> None:
        # A spawned process inherits no open files or locks.
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def give(self, job: Job) -> None:
        """Send it a run."""
        self.job, self.begun = job, time.monotonic()
        with contextlib.suppress(BrokenPipeError):  # `take` reports it.
            self.connection.send(job)

    def take(self, timeout_s: float | None) -> Played:
        """Return the outcome of its run; end the process if there is none."""
        try:
            if self.connection.poll():
                played: Played = self.connection.recv()
                return played
            error = f"it took longer than {timeout_s:g} s"
            self.end()
        except (EOFError, ConnectionResetError):
            self.process.join()
            code = self.process.exitcode
            how = f"exit code {code}" if code is None or code >= 0 else signal.Signals(-code).name
            error = f"its process ended: {how}"
            self.end()
        wall_s = time.monotonic() - self.begun
        return Played(self.job.controller, "", "", self.job.seed, wall_s=wall_s, error=error)

    def end(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def _serve(connection: Connection) -> None:
    """Play runs until the parent closes the pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # The parent handles Ctrl-C.
    with contextlib.suppress(EOFError):
        while True:
            connection.send(play(connection.recv()))
