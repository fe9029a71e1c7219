"""Messages of the server in protocol v1, as typed structs. Units are SI; quaternions are x, y, z, w.

Unknown fields are ignored, so that this client works with a newer server. Structs of which an observation
has many are exempt from Python's cyclic garbage collection (``gc=False``): they form no cycles, and thousands
of them per second would keep the collector busy.
"""

from __future__ import annotations

import math

import msgspec

from palmares.arrays import Array, array
from palmares.cameras import CameraImage
from palmares.scene import Quat, Scene, Vec3, named
from palmares.truth import BodyState, Table, Truth
from palmares.views import Rows, Viewed, first, vector


class Reply(msgspec.Struct, kw_only=True, tag_field="op"):
    """A message from the server; `op` is its kind."""

    reply_to: int | None = msgspec.field(name="id", default=None)
    """`id` of the request it answers; ``None`` for a message that answers none"""


class BaseTarget(msgspec.Struct, omit_defaults=True, kw_only=True, gc=False):
    """Target of the hand's base: a pose or a velocity, never both. See `pose` and `twist`."""

    position: Vec3 | None = None
    """m, world frame"""
    quat_xyzw: Quat | None = None
    linear: Vec3 | None = None
    """m/s, world frame"""
    angular: Vec3 | None = None
    """rad/s, world frame"""


class Action(msgspec.Struct, omit_defaults=True, kw_only=True, gc=False):
    """Targets for one tick; ``None`` keeps the last target."""

    base: BaseTarget | None = None
    hand: list[float] | None = None
    """σ of every motor in [0, 1], in the hand's motor order"""


class Actuator(msgspec.Struct, kw_only=True, gc=False):
    """State of a motor, as its sensors read it."""

    name: str
    command: float
    """Commanded σ, 0 to 1."""
    position: float
    """σ the motor has reached."""
    velocity: float
    """dσ/dt, 1/s."""
    tension: float
    """Tension of its tendons, in the tendon's unit (see the hand's description)."""


class Wrench(msgspec.Struct, kw_only=True, gc=False):
    """Force (N) and torque about the base origin (N·m), world frame."""

    force: Vec3
    torque: Vec3


class HandState(msgspec.Struct, kw_only=True, gc=False):
    """State of the hand, as its own sensors read it."""

    base: BodyState
    actuators: list[Actuator]
    wrist: Wrench
    """What the arm holds the hand with: at rest the weight of the hand and of what it holds"""
    _joints: Table = msgspec.field(name="joints", default_factory=list)
    _touch: Table = msgspec.field(name="touch", default_factory=list)
    acceleration: Vec3 | None = None
    """Acceleration minus gravity in the frame of the accelerometer's link, m/s²; ``None`` without one"""

    @property
    def joints(self) -> Array:
        """Joint encoders in the order of `HandInfo.encoders`, shape (n,), rad; empty if the hand has none."""
        return array(self._joints)

    @property
    def touch(self) -> Array:
        """Force on every taxel in the order of `HandInfo.taxels`, shape (n, 3), N.

        Along x and y of the taxel's patch, and into the patch. Empty if the hand feels no touch.
        """
        return array(self._touch, -1, 3)


class Event(msgspec.Struct, kw_only=True, gc=False):
    """An event that the referee recorded."""

    kind: str
    """Such as ``in_goal``; docs/protocol.md lists the kinds of every task"""
    tick: int = 0
    object: int | None = None
    """Row of the object in `Truth.positions`"""


class Opened(msgspec.Struct, kw_only=True):
    """The parameters of a run."""

    task: str
    hand: str
    mode: str
    sensing: str
    tick_s: float
    """Length of a tick, s"""
    time_limit_s: float
    """Longest run, s of simulated time"""
    noise: str = "none"
    """``none`` or ``real``"""
    seed: int | None = None
    """In practice: `Client.reset` with this seed gives the same scene"""


class Observation(Viewed, Reply, kw_only=True, tag="obs"):
    """State after a tick."""

    run_id: str
    tick: int
    """Ticks since reset."""
    sim_time_s: float
    applied_action: Action
    """The action as applied: clipped to the limits, targets that were left out filled in."""
    hand: HandState
    session_left_s: float | None = None
    """Remaining time of the session; ``None`` in a practice session without a limit."""
    _cameras: list[CameraImage] = msgspec.field(name="cameras", default_factory=list)
    truth: Truth | None = None
    events: list[Event] = []
    score: float = 0.0
    """Score if the run ended now, before the objects settle."""
    terminated: bool = False
    """The task is complete."""
    truncated: bool = False
    """A limit ended the run."""
    late_s: float | None = None
    """Realtime: time from when its tick was due until it was sent"""
    reason: str | None = None
    run: Opened | None = None
    """Only in the reply to `reset`."""
    scene: Scene | None = None
    """Only in the reply to `reset`; `Client.scene` keeps it."""

    @property
    def cameras(self) -> dict[str, CameraImage]:
        """What the cameras saw that were asked for, by name."""
        return {image.camera: image for image in self._cameras}

    @property
    def done(self) -> bool:
        """True when the run cannot go on: stop it to get the result."""
        return self.terminated or self.truncated

    def _lines(self) -> tuple[str, Rows]:
        """Return what the observation shows when it is printed."""
        over = f", over: {self.reason}" if self.done else ""
        title = f"Observation of tick {self.tick} ({self.sim_time_s:.2f} s), score {self.score:g}{over}"
        hand = self.hand
        rows = [("base", f"{vector(hand.base.position)} m, quaternion {vector(hand.base.quat_xyzw)}")]
        for motor in hand.actuators:
            state = f"σ {motor.position:.3f} of {motor.command:.3f} commanded, tension {motor.tension:.3g}"
            rows.append((motor.name, state))
        rows.append(("wrist", f"{vector(hand.wrist.force)} N, {vector(hand.wrist.torque)} N·m"))
        if hand.joints.size:
            rows.append(("encoders", vector(hand.joints.tolist()) + " rad"))
        if hand.touch.size:
            pressed = hand.touch[:, 2]
            taxels = f"{int((pressed > 0.0).sum())} of {pressed.size} taxels"
            rows.append(("touch", f"{taxels}, {pressed.sum():.3g} N in all"))
        for name, image in self.cameras.items():
            rows.append((f"camera {name}", f"{image.width} × {image.height}"))
        if self.truth is not None:
            places = zip(self.truth.names, self.truth.positions.tolist(), strict=True)
            rows += first([(name, f"{vector(at)} m") for name, at in places], "objects")
            rows.append(("contacts", str(self.truth.contact_count)))
        return title, rows + _event_rows(self.events)


class Replay(msgspec.Struct, kw_only=True):
    """The recording of a run: ``GET /v1/runs/{id}/replay``."""

    sha256: str
    bytes: int
    """Size of the file"""


class Result(Viewed, Reply, kw_only=True, tag="result"):
    """Outcome of a finished run."""

    run_id: str
    task: str
    hand: str
    status: str
    """``practice``; ``training`` when `Training` made it another run than the task's; ``provisional``
    in a competition until verified; ``aborted`` when it ended at tick 0;
    ``voided`` after a fault of the server"""
    score: float
    in_goal: int
    """Objects in the goal; where objects are arranged, goals reached"""
    outside: int
    """Objects outside both boxes"""
    reason: str
    """Why it ended: ``stopped``, ``complete``, ``time_limit``, ``session_over``, …"""
    fault: str | None = None
    """Of the reason ``world_fault``: what the world failed of, as in `WorldFaultError`"""
    note: str | None = None
    """For people: of a world that failed, when, what that means and what to try"""
    task_hash: str = ""
    """SHA-256 of everything that the task is"""
    ticks: int
    sim_time_s: float
    """Simulated time"""
    state_hash: str
    """Hash of the final state: the same for the same seed and actions"""
    missed_ticks: int = 0
    """Realtime: ticks without a new action"""
    late_ticks: int = 0
    """Realtime: ticks that the server began more than half a tick after they were due"""
    late_max_s: float = 0.0
    """Realtime: the longest such delay"""
    dropped_obs: int = 0
    """Realtime: observations that the server dropped because this client did not read them in time"""
    mode: str = "lockstep"
    """``lockstep`` or ``realtime``"""
    events: list[Event] = []
    replay: Replay | None = None
    """``None`` when the server does not record"""
    session_left_s: float | None = None

    @property
    def voided(self) -> bool:
        """True when the run does not count, by a fault of the server or a decision of the organizer."""
        return self.status == "voided"

    def _lines(self) -> tuple[str, Rows]:
        """Return what the result shows when it is printed."""
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


class RunInfo(msgspec.Struct, kw_only=True):
    """The session's current run."""

    run_id: str
    task: str
    hand: str
    mode: str = "lockstep"
    """``lockstep`` or ``realtime``"""
    tick: int
    """The tick the next step must name"""
    open: bool
    """False when the server closed it; `Client.stop` then returns the result"""


class Time(Reply, kw_only=True, tag="time"):
    """The session's clock."""

    session_left_s: float | None
    """Remaining time; ``None`` when the session has no limit"""
    session_s: float | None
    """Length of the session; ``None`` for no limit"""
    elapsed_s: float
    """The greater of `wall_s` and `simulated_s`"""
    wall_s: float
    """Wall-clock time since the first reset"""
    simulated_s: float
    """Simulated time of all runs"""
    refunded_s: float = 0.0
    """Time given back for runs that a fault of the server made void"""
    paused: bool = False
    """True while an organizer pauses the session"""
    run: RunInfo | None = None


class CameraInfo(msgspec.Struct, kw_only=True):
    """A camera of a task or of a hand."""

    name: str
    """For ``cameras=`` of `Client.step`; a hand's is called ``hand_…`` in a task that has one of that name"""
    width: int
    """Pixels in a row"""
    height: int
    """Rows"""
    fov_deg: float
    """Horizontal field of view"""
    near: float
    """What is nearer gives no reading, m"""
    far: float
    """What is farther gives no reading, m"""


class TaskInfo(msgspec.Struct, kw_only=True):
    """Constants of a task."""

    name: str
    description: str
    tick_s: float
    """Length of a tick: actions and observations come at this interval"""
    step_s: float
    """Time step of the integrator"""
    time_limit_s: float
    """Longest run, simulated time"""
    cameras: list[CameraInfo] = []
    """Its cameras"""
    hash: str = ""
    """SHA-256 of everything that it is"""


class HandInfo(msgspec.Struct, kw_only=True):
    """Motors and joints of a hand; `Client.describe_hand` returns its geometry."""

    name: str
    description: str
    motors: list[str]
    """In the order of the command `hand`"""
    joints: list[str]
    """In the order of `Truth.joints`"""
    encoders: list[str] = []
    """Joints that have an encoder, in the order of `HandState.joints`"""
    taxels: list[str] = []
    """In the order of `HandState.touch`"""
    cameras: list[CameraInfo] = []
    """Cameras on it"""


class Limits(msgspec.Struct, kw_only=True):
    """Limits of requests and connections; those of actions are in `Specs`."""

    message_bytes: int
    """Largest message of a client"""
    repeat: int
    """Largest `repeat` of a step"""
    requests_per_s: float
    requests_burst: float
    """Requests that may come at once before `requests_per_s` applies"""
    resume_grace_s: float
    """How long a session without a connection waits for its client"""
    ping_interval_s: float | None = None
    ping_timeout_s: float | None = None
    """A connection that is silent for so long is closed"""
    hello_timeout_s: float | None = None
    """How long a connection may be open before `hello`"""
    hold_ticks: int | None = None
    """Realtime: after so many ticks without an action the hand holds still"""
    outbox_obs: int | None = None
    """Realtime: of more unread observations than this the server drops the oldest"""


class FieldSpec(msgspec.Struct, kw_only=True):
    """A number or an array of numbers in actions or observations."""

    name: str
    """Path such as ``base.linear``; ``[]`` stands for every entry of a list"""
    shape: list[int | str]
    """Lengths; ``motors``, ``joints`` and ``objects`` depend on hand and scene"""
    unit: str
    """Empty for a pure number"""
    minimum: float | None = None
    maximum: float | None = None

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest value of each entry; infinite where there is no limit."""
        return (
            -math.inf if self.minimum is None else self.minimum,
            math.inf if self.maximum is None else self.maximum,
        )


class Specs(msgspec.Struct, kw_only=True):
    """Every field of actions and observations."""

    action: list[FieldSpec]
    """Values out of range are clipped by the server."""
    observation: list[FieldSpec]

    def action_field(self, name: str) -> FieldSpec:
        """Return a field of an action, such as ``base.linear``; `KeyError` lists the names there are."""
        return named("field of actions", name, self.action)


class Competition(msgspec.Struct, kw_only=True):
    """The competition, or the practice, that the server runs."""

    name: str = ""
    mode: str = "practice"
    """``practice`` or ``official``"""
    session_s: float | None = None
    """Length of a session; ``None`` for no limit"""
    reset_cost_s: float = 0.0
    """Time that each reset takes from the session"""
    noise: str = "none"
    """``none`` or ``real``: the sensors of runs that do not ask for others; in a competition, of all"""
    sensors_only: list[str] = []
    """Tasks that cannot be played with ``sensing="truth"``"""


class ServerInfo(msgspec.Struct, kw_only=True):
    """The program of the server."""

    version: str
    build_hash: str


class Welcome(Reply, kw_only=True, tag="welcome"):
    """The server's greeting when a session begins or is resumed: all that holds for the whole session."""

    session_id: str
    resume_token: str
    team: str
    """Name on the leaderboard"""
    tasks: list[TaskInfo]
    hands: list[HandInfo]
    limits: Limits
    session_left_s: float | None = None
    competition: Competition = msgspec.field(default_factory=Competition)
    server: ServerInfo
    specs: Specs
    run: RunInfo | None = None
    """The current run, when a session is resumed"""
    note: str | None = None
    """A remark on the team's name, for people; `Client` logs it"""

    def task(self, name: str) -> TaskInfo:
        """Return the constants of a task; `KeyError` lists the tasks there are."""
        return named("task", name, self.tasks)

    def hand(self, name: str) -> HandInfo:
        """Return motors and joints of a hand; `KeyError` lists the hands there are."""
        return named("hand", name, self.hands)


class TaskBest(msgspec.Struct, kw_only=True):
    """A team's best run of a task."""

    score: float
    run_id: str
    ended_unix_ms: int


class LeaderboardRow(msgspec.Struct, kw_only=True):
    """A team's place."""

    rank: int
    team: str
    total: float
    """Sum of the best scores"""
    runs: int
    reached_unix_ms: int
    """When the total was reached, ms since 1970 UTC"""
    tasks: dict[str, TaskBest]


class SessionWarning(Reply, kw_only=True, tag="warning"):
    """The session's time is running out."""

    mark_s: float
    """The mark that was passed: 300, 60 or 10 s before the end"""
    session_left_s: float


class Ack(Reply, kw_only=True, tag="ack"):
    """An action or a perturbation was accepted."""

    tick: int = 0
    """The tick at which it takes effect"""


class ErrorMessage(Reply, kw_only=True, tag="error"):
    """A refused request."""

    code: str
    message: str = ""
    fatal: bool = False
    retry_after_s: float | None = None
    fault: str | None = None
    """What the world of the run failed of, when that is why"""


class Envelope(msgspec.Struct, kw_only=True):
    """The fields that every message from the server has."""

    op: str
    id: int | None = None
