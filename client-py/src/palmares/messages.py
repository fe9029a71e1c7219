"""What the server says in protocol v1, as typed structs. Units are SI; quaternions are x, y, z, w.

Fields the server adds later are ignored here, so that an older client keeps working. Structs of which an
observation has many are exempt from Python's cyclic garbage collection (``gc=False``): they form no cycles,
and thousands of them per second would keep the collector busy.
"""

from __future__ import annotations

from typing import Any

import msgspec

from palmares.scene import Quat, Scene, Vec3
from palmares.truth import BodyState, Truth


class Reply(msgspec.Struct, kw_only=True, tag_field="op"):
    """A message from the server; `op` tells which."""

    reply_to: int | None = msgspec.field(name="id", default=None)
    """`id` of the request it answers; ``None`` for a message nobody asked for."""


class BaseTarget(msgspec.Struct, omit_defaults=True, kw_only=True, gc=False):
    """Where the hand's base should go: a pose or a velocity, never both. See `pose` and `twist`."""

    position: Vec3 | None = None
    """m, world frame"""
    quat_xyzw: Quat | None = None
    linear: Vec3 | None = None
    """m/s, world frame"""
    angular: Vec3 | None = None
    """rad/s, world frame"""


class Action(msgspec.Struct, omit_defaults=True, kw_only=True, gc=False):
    """Targets for one tick; what is left out keeps its last target."""

    base: BaseTarget | None = None
    hand: list[float] | None = None
    """σ of every motor in [0, 1], in the hand's motor order"""


class Actuator(msgspec.Struct, kw_only=True, gc=False):
    """What a motor's sensors read."""

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
    """What the hand's own sensors read."""

    base: BodyState
    actuators: list[Actuator]
    wrist: Wrench


class Event(msgspec.Struct, kw_only=True, gc=False):
    """Something the referee noted; which kinds there are depends on the task (docs/protocol.md)."""

    kind: str
    tick: int = 0
    object: int | None = None


class Opened(msgspec.Struct, kw_only=True):
    """How a run was opened."""

    task: str
    hand: str
    mode: str
    sensing: str
    tick_s: float
    """Length of a tick, s"""
    time_limit_s: float
    """Longest run, s of simulated time"""
    seed: int | None = None
    """In practice: what `reset` takes to build this scene again"""


class Observation(Reply, kw_only=True, tag="obs"):
    """State after a tick."""

    run_id: str
    tick: int
    """Ticks since reset."""
    sim_time_s: float
    applied_action: Action
    """The action as applied: clipped to the spec, with what was left out filled in."""
    hand: HandState
    session_left_s: float | None = None
    """What is left of the session; ``None`` in a practice session without a limit."""
    truth: Truth | None = None
    events: list[Event] = []
    score: float = 0.0
    """If the run ended now, without the settling rule."""
    terminated: bool = False
    """Nothing more can be gained."""
    truncated: bool = False
    """Cut short by a limit."""
    late_s: float | None = None
    """Realtime: how long after its tick was due it was sent, s"""
    reason: str | None = None
    run: Opened | None = None
    """Only in the reply to `reset`."""
    scene: Scene | None = None
    """Only in the reply to `reset`; `Client.scene` keeps it."""

    @property
    def done(self) -> bool:
        """True when the run cannot go on: stop it to get the result."""
        return self.terminated or self.truncated


class Replay(msgspec.Struct, kw_only=True):
    """The file that plays a run again: ``GET /v1/runs/{id}/replay``."""

    sha256: str
    bytes: int
    """Size of the file"""


class Result(Reply, kw_only=True, tag="result"):
    """What a finished run is worth."""

    run_id: str
    task: str
    hand: str
    status: str
    """``practice``; ``provisional`` in a competition until verified; ``voided`` after a fault of ours"""
    score: float
    in_goal: int
    """Objects in the goal"""
    outside: int
    """Objects outside both boxes"""
    reason: str
    """Why it ended: ``stopped``, ``complete``, ``time_limit``, ``session_over``, …"""
    ticks: int
    sim_time_s: float
    """s of simulated time played"""
    state_hash: str
    """Hash of the final state: the same for the same seed and actions"""
    missed_ticks: int = 0
    """Realtime: ticks for which no new action had come"""
    late_ticks: int = 0
    """Realtime: ticks that the server began late, by more than half a tick"""
    late_max_s: float = 0.0
    """Realtime: the latest beginning of a tick, s"""
    dropped_obs: int = 0
    """Realtime: observations that the server dropped because this client did not take them in time"""
    mode: str = "lockstep"
    """``lockstep`` or ``realtime``"""
    events: list[Event] = []
    replay: Replay | None = None
    """``None`` when the server does not record, or does not tell"""
    session_left_s: float | None = None

    @property
    def voided(self) -> bool:
        """True when the run counts for nothing, through a fault of the server or by the organizer."""
        return self.status == "voided"


class RunInfo(msgspec.Struct, kw_only=True):
    """The session's present run."""

    run_id: str
    task: str
    hand: str
    tick: int
    """The tick the next step must name"""
    open: bool
    """False when the server closed it: `Client.stop` fetches the result"""


class Time(Reply, kw_only=True, tag="time"):
    """How the session's clock stands."""

    session_left_s: float | None
    """s; ``None`` when the session has no limit"""
    session_s: float | None
    """Length of the session, s; ``None`` for no limit"""
    elapsed_s: float
    """The greater of the next two, s"""
    wall_s: float
    """Wall-clock time since the first reset, s"""
    simulated_s: float
    """Simulated time of all runs, s"""
    run: RunInfo | None = None


class TaskInfo(msgspec.Struct, kw_only=True):
    """A task in short."""

    name: str
    description: str
    tick_s: float
    step_s: float
    time_limit_s: float


class HandInfo(msgspec.Struct, kw_only=True):
    """A hand in short; `Client.describe_hand` has the rest."""

    name: str
    description: str
    motors: list[str]
    """In the order of the command `hand`"""
    joints: list[str]
    """In the order of `Truth.joints`"""


class Limits(msgspec.Struct, kw_only=True):
    """What a client must keep to."""

    message_bytes: int
    repeat: int
    """Largest `repeat` of a step"""
    requests_per_s: float
    requests_burst: float
    resume_grace_s: float
    """How long a session waits for its client to come back, s"""
    hello_timeout_s: float | None = None
    """How long a connection may be open before it says hello, s"""
    hold_ticks: int | None = None
    """Realtime: for so many ticks a silent controller's last action goes on; then the hand holds still"""


class Welcome(Reply, kw_only=True, tag="welcome"):
    """What the server says when a session begins or is taken up again."""

    session_id: str
    resume_token: str
    team: str
    """Name on the leaderboard"""
    tasks: list[TaskInfo]
    hands: list[HandInfo]
    limits: Limits
    session_left_s: float | None = None
    competition: dict[str, Any] = {}
    server: dict[str, Any] = {}
    specs: dict[str, Any] = {}
    run: RunInfo | None = None
    """The run that goes on, when a session is taken up again"""


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
    session_left_s: float


class Ack(Reply, kw_only=True, tag="ack"):
    """An action or a push was taken."""

    tick: int = 0
    """The tick at which it takes effect"""


class ErrorMessage(Reply, kw_only=True, tag="error"):
    """A refused request."""

    code: str
    message: str = ""
    fatal: bool = False
    retry_after_s: float | None = None


class Envelope(msgspec.Struct, kw_only=True):
    """What every message from the server carries."""

    op: str
    id: int | None = None
