"""Messages of the server in protocol v1. Their fields are those of `palmares.wire`."""

from __future__ import annotations

import math

import msgspec

from palmares import wire
from palmares.cameras import CameraImage
from palmares.no_truth import NoTruthError
from palmares.scene import Scene, named
from palmares.truth import BodyState, Truth
from palmares.views import Rows, Viewed, first, vector
from palmares.wire import (
    Event,
    HandInfo,
    TaskInfo,
)


class HandState(Viewed, wire.HandState, kw_only=True):
    """State of the hand, as its own sensors read it."""

    base: BodyState

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed hand."""
        rows = [("base", f"{vector(self.base.position)} m, quaternion {vector(self.base.quat_xyzw)}")]
        for motor in self.actuators:
            state = f"σ {motor.position:.3f} of {motor.command:.3f} commanded, tension {motor.tension:.3g}"
            rows.append((motor.name, state))
        rows.append(("wrist", f"{vector(self.wrist.force)} N, {vector(self.wrist.torque)} N·m"))
        if self.joints.size:
            rows.append(("encoders", vector(self.joints.tolist()) + " rad"))
        if self.touch.size:
            pressed = self.touch[:, 2]
            taxels = f"{int((pressed > 0.0).sum())} of {pressed.size} taxels"
            rows.append(("touch", f"{taxels}, {pressed.sum():.3g} N in all"))
        if self.acceleration is not None:
            rows.append(("acceleration", f"{vector(self.acceleration)} m/s²"))
        return "HandState", rows


class Observation(Viewed, wire.Observation, kw_only=True, tag="obs"):
    """State after a tick."""

    hand: HandState
    _cameras: list[CameraImage] = msgspec.field(name="cameras", default_factory=list)
    _truth: Truth | None = msgspec.field(name="truth", default=None)
    scene: Scene | None = None
    """Only in the reply to `reset`; `Client.scene` keeps it."""

    @property
    def cameras(self) -> dict[str, CameraImage]:
        """Requested images, by the names of their cameras."""
        return {image.camera: image for image in self._cameras}

    @property
    def truth(self) -> Truth:
        """The full state; `NoTruthError` in a run with ``sensing="sensors"``, see `has_truth`."""
        if self._truth is None:
            raise NoTruthError
        return self._truth

    @property
    def has_truth(self) -> bool:
        """Whether it has `truth`: with ``sensing="truth"``."""
        return self._truth is not None

    @property
    def done(self) -> bool:
        """True when the run cannot go on: stop it to get the result."""
        return self.terminated or self.truncated

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed observation."""
        over = f", over: {self.reason}" if self.done else ""
        title = f"Observation of tick {self.tick} ({self.sim_time_s:.2f} s), score {self.score:g}{over}"
        _, rows = self.hand._lines()
        for name, image in self.cameras.items():
            rows.append((f"camera {name}", f"{image.width} × {image.height}"))
        if self.has_truth:
            places = zip(self.truth.names, self.truth.positions.tolist(), strict=True)
            rows += first([(name, f"{vector(at)} m") for name, at in places], "objects")
            rows.append(("contacts", str(self.truth.contact_count)))
        return title, rows + _event_rows(self.events)


class Result(Viewed, wire.Result, kw_only=True, tag="result"):
    """Outcome of a finished run."""

    @property
    def voided(self) -> bool:
        """True when the run does not count, by a fault of the server or a decision of the organizer."""
        return self.status == "voided"

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed result."""
        title = f"Result of {self.task} with {self.hand}: score {self.score:g}, {self.status}"
        rows = [
            ("run", self.run_id),
            ("ended", f"{self.reason} after {self.ticks} ticks, {self.sim_time_s:.2f} s"),
            ("objects", f"{self.in_goal} in the goal, {self.outside} outside"),
        ]
        if self.note is not None:
            rows.append(("note", self.note))
        if self.mode == "realtime":
            rows.append(("real time", f"{self.missed_ticks} ticks missed, {self.late_ticks} late"))
        rows += _event_rows(self.events)
        rows.append(("state hash", self.state_hash))
        if self.replay is not None:
            rows.append(("replay", f"{self.replay.bytes} bytes, SHA-256 {self.replay.sha256[:16]}…"))
        return title, rows


def _event_rows(events: list[Event]) -> Rows:
    rows = []
    for event in events:
        which = "" if event.object is None else f", object {event.object}"
        rows.append((f"tick {event.tick}", event.kind + which))
    return first(rows, "events")


class FieldSpec(wire.FieldSpec, kw_only=True):
    """A number or an array of numbers in actions or observations."""

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value of each entry; infinite without a limit."""
        return (
            -math.inf if self.minimum is None else self.minimum,
            math.inf if self.maximum is None else self.maximum,
        )


class Specs(Viewed, wire.Specs, kw_only=True):
    """Every field of actions and observations."""

    action: list[FieldSpec]
    observation: list[FieldSpec]

    def action_field(self, name: str) -> FieldSpec:
        """Return a field of an action, such as ``base.linear``; the `KeyError` for others lists all names."""
        return named("field of actions", name, self.action)

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of printed specs."""
        rows = [(field.name, f"{field.shape} {field.unit}") for field in [*self.action, *self.observation]]
        return f"Specs of {len(self.action)} fields of actions, {len(self.observation)} of observations", rows


class Welcome(Viewed, wire.Welcome, kw_only=True, tag="welcome"):
    """The server's greeting when a session begins or resumes, with all constants of the session."""

    specs: Specs

    def task(self, name: str) -> TaskInfo:
        """Return the constants of a task; the `KeyError` for others lists all tasks."""
        return named("task", name, self.tasks)

    def hand(self, name: str) -> HandInfo:
        """Return motors and joints of a hand; the `KeyError` for others lists all hands."""
        return named("hand", name, self.hands)

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed greeting."""
        left = "no limit" if self.session_left_s is None else f"{self.session_left_s:.0f} s left"
        return f"Welcome of {self.team} to {self.competition.name}", [
            ("mode", self.competition.mode),
            ("session", left),
            ("tasks", ", ".join(task.name for task in self.tasks)),
            ("hands", ", ".join(hand.name for hand in self.hands)),
        ]
