"""Recorded runs: replays as arrays and figures."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from palmares._native import Recording as NativeRecording
from palmares.sim.progress import progress
from palmares.sim.state import Arrays
from palmares.views import Rows, Viewed

if TYPE_CHECKING:
    from palmares.sim.plots import Plot


class Recording(Viewed):
    """A recorded run: the replay that a server, or `World.save_replay`, has written.

    Reading checks the file's chain and signature. `arrays` and `plot` simulate the run again, once: their
    numbers are exact, and compared with the recorded states of every tick.

    >>> recording = palmares.sim.Recording("run_7c3d8eb479d7f8ab.mcap")     # doctest: +SKIP
    ... recording.arrays()["score"][-1]
    ... recording.plot().savefig("run.pdf")

    Args:
        source: The file's path, or its bytes.
        tasks: Paths of your own tasks, if the run is of one of them.

    Attributes:
        run_id: Name of the run.
        team: Name of the team.
        task: Name of the task.
        hand: Name of the hand.
        seed: Selects the scene; ``None`` for a hidden one.
        sensing: ``truth`` or ``sensors``.
        noise: ``none`` or ``real``.
        tick_s: Length of a tick, s.
        ticks: Number of ticks.
        score: Final score, after the objects have settled.
        reason: Why it ended.
        state_hash: Digest of the final state.
        signed_by: Public key of the signature, 64 hexadecimal digits.
        sha256: SHA-256 of the file.
        events: The referee's events: tick, kind, and the index of the object or ``None``.

    Raises:
        ValueError: The file is no replay, or damaged; the message begins with the reason of a refusal
            (docs/replays.md).
        OSError: The file cannot be read.

    """

    def __init__(self, source: str | os.PathLike[str] | bytes, tasks: Iterable[str] = ()) -> None:
        if isinstance(source, bytes | bytearray | memoryview):
            data = bytes(source)
        else:
            with open(source, "rb") as file:
                data = file.read()
        self._native, self._tasks = NativeRecording(data), [str(task) for task in tasks]
        facts: dict[str, Any] = json.loads(self._native.facts())
        self.run_id: str = facts["run_id"]
        self.team: str = facts["team"]
        self.task: str = facts["task"]
        self.hand: str = facts["hand"]
        self.seed: int | None = facts["seed"]
        self.sensing: str = facts["sensing"]
        self.noise: str = facts["noise"]
        self.tick_s: float = facts["tick_s"]
        self.ticks: int = facts["ticks"]
        self.score: float = facts["score"]
        self.reason: str = facts["reason"]
        self.state_hash: str = facts["state_hash"]
        self.signed_by: str = facts["signed_by"]
        self.sha256: str = facts["sha256"]
        self.events: list[tuple[int, str, int | None]] = [
            (event["tick"], event["kind"], event.get("object")) for event in facts["events"]
        ]
        self._arrays: Arrays = {}
        self._names: dict[str, list[str]] = {}

    def arrays(self) -> Arrays:
        """Return the run as arrays of float64, one row for each tick from 0 on: T = ticks + 1 rows.

        - ``time`` (T,): s
        - ``base`` (T, 13): position (m), quaternion x y z w, linear (m/s) and angular (rad/s) velocity of
          the hand's base, world frame
        - ``q``, ``joint_velocity`` (T, joints): rad and rad/s
        - ``motors`` (T, motors, 2): σ and dσ/dt (1/s); ``command`` (T, motors): commanded σ
        - ``tension`` (T, tendons): N, or the unit of the tendon
        - ``objects`` (T, objects, 13): as ``base``, for each
        - ``finger_force`` (T, fingers, 3): sum of the contact forces on each finger, world frame, N
        - ``object_force`` (T, objects, 3): sum of the hand's contact forces on each object, N
        - ``score`` (T,): if the run ended there, without the settling

        The first call simulates the run. The arrays are yours to change.

        Raises:
            ValueError: The simulation differs from the recording, or the run is of another engine, task or
                hand; the message begins with the reason of a refusal (docs/replays.md).

        """
        if not self._arrays:
            with progress(self.ticks, "tick", "replay") as report:
                self._arrays, names = self._native.arrays(self._tasks, report)
            self._names = dict(names)
        return {name: values.copy() for name, values in self._arrays.items()}

    @property
    def names(self) -> dict[str, list[str]]:
        """Names of ``motors``, ``tendons``, ``fingers``, ``coordinates``, ``objects``, in their order."""
        if not self._names:
            self.arrays()
        return {kind: list(names) for kind, names in self._names.items()}

    def plot(self) -> Plot:
        """Return a figure: score, motors, tensions, contact forces and height of the base in time.

        Raises:
            ImportError: matplotlib is not installed.
            ValueError: As `arrays`.

        """
        try:
            from palmares.sim.plots import figure
        except ImportError as missing:
            raise ImportError("plot() needs matplotlib: pip install 'palmares[plot]'") from missing
        return figure(self._title(), self.arrays(), self.names, self.events)

    def _title(self) -> str:
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"{self.task} with {self.hand}{seed}: score {self.score:g}"

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed recording."""
        seconds = np.round(self.ticks * self.tick_s, 6)
        return f"Recording of {self._title()}", [
            ("run", f"{self.run_id} of {self.team}"),
            ("length", f"{self.ticks} ticks, {seconds:g} s, {self.reason}"),
            ("sensing", f"{self.sensing}, noise {self.noise}"),
            ("events", str(len(self.events))),
            ("signed by", f"{self.signed_by[:16]}…"),
        ]
