"""The messages of protocol v1 as typed structs. Units are SI; quaternions are x, y, z, w.

Fields the server adds later are ignored here, so that an older client keeps working.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import msgspec
import numpy as np

from palmares.rotation import Array, matrix_of

Vec3: TypeAlias = tuple[float, float, float]
Quat: TypeAlias = tuple[float, float, float, float]


class BaseTarget(msgspec.Struct, omit_defaults=True, kw_only=True):
    """Where the hand's base should go: a pose or a velocity, never both. See `pose` and `twist`."""

    position: Vec3 | None = None
    """m, world frame"""
    quat_xyzw: Quat | None = None
    linear: Vec3 | None = None
    """m/s, world frame"""
    angular: Vec3 | None = None
    """rad/s, world frame"""


class Action(msgspec.Struct, omit_defaults=True, kw_only=True):
    """Targets for one tick; what is left out keeps its last target."""

    base: BaseTarget | None = None
    hand: list[float] | None = None
    """σ of every motor in [0, 1], in the hand's motor order"""


class BodyState(msgspec.Struct, kw_only=True):
    """Pose and velocity of a body in the world frame."""

    position: Vec3
    """Origin of the body frame, m."""
    quat_xyzw: Quat
    linear: Vec3
    """Velocity of the origin, m/s."""
    angular: Vec3
    """rad/s"""

    @property
    def xyz(self) -> Array:
        """Position as an array, shape (3,), m."""
        return np.array(self.position)

    @property
    def rotation(self) -> Array:
        """World-from-body rotation matrix, shape (3, 3)."""
        return matrix_of(self.quat_xyzw)


class Actuator(msgspec.Struct, kw_only=True):
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


class Wrench(msgspec.Struct, kw_only=True):
    """Force (N) and torque about the base origin (N·m), world frame."""

    force: Vec3
    torque: Vec3


class HandState(msgspec.Struct, kw_only=True):
    """What the hand's own sensors read."""

    base: BodyState
    actuators: list[Actuator]
    wrist: Wrench


class ObjectState(BodyState, kw_only=True):
    """A free object."""

    id: int
    """Index in the scene."""
    name: str


class Joints(msgspec.Struct, kw_only=True):
    """Joint coordinates of the hand: rad and rad/s."""

    position: list[float]
    velocity: list[float]


class Contact(msgspec.Struct, kw_only=True):
    """A touching contact: force (N, world frame) on body `b` by body `a` at `position` (m)."""

    a: str
    b: str
    position: Vec3
    force: Vec3


class Truth(msgspec.Struct, kw_only=True):
    """The full state; only with ``sensing="truth"``."""

    objects: list[ObjectState]
    """In scene order."""
    joints: Joints
    contacts: list[Contact]
    predicted_equilibrium: list[float]
    """Closed-form joint coordinates of the free hand at the present motor position, rad."""

    @property
    def positions(self) -> Array:
        """Centres of all objects, shape (n, 3), m."""
        return np.array([body.position for body in self.objects]).reshape(-1, 3)


class Event(msgspec.Struct, kw_only=True):
    """Something the referee noted: `in_goal`, `left_goal`, `outside`, `back_inside`, `warning`."""

    kind: str
    tick: int = 0
    object: int | None = None


class Shape(msgspec.Struct, kw_only=True):
    """A convex shape; which fields it has depends on `type`. Cylinders and capsules stand along z."""

    type: str
    """``sphere``, ``capsule``, ``cylinder``, ``box`` or ``hull``"""
    radius: float | None = None
    half_length: float | None = None
    """m, without the caps of a capsule"""
    half_extents: Vec3 | None = None
    points: list[Vec3] | None = None
    rounding: float = 0.0


class ScenePart(msgspec.Struct, kw_only=True):
    """A convex part of a body, placed in the body frame."""

    position: Vec3
    quat_xyzw: Quat
    shape: Shape


class SceneBody(msgspec.Struct, kw_only=True):
    """A body and its shapes."""

    id: int
    name: str
    free: bool
    """False for furniture."""
    mass: float
    """kg; 0 for furniture"""
    friction: float
    position: Vec3
    """At tick 0, m."""
    quat_xyzw: Quat
    parts: list[ScenePart]
    color: Vec3
    """sRGB, 0 to 1"""


class Region(msgspec.Struct, kw_only=True):
    """An axis-aligned region the rules speak of, such as the inside of ``box_b``."""

    name: str
    min: Vec3
    max: Vec3

    def contains(self, point: Array) -> bool:
        """Tell whether `point` (3,) lies inside or on the border."""
        return bool(np.all(point >= self.min) and np.all(point <= self.max))


class Scene(msgspec.Struct, kw_only=True):
    """What stands in the world at tick 0."""

    bodies: list[SceneBody]
    """Free ones first, in the order of `Truth.objects`."""
    regions: list[Region]
    gravity: Vec3

    def region(self, name: str) -> Region:
        """Return the region called `name`; `KeyError` names those there are."""
        for region in self.regions:
            if region.name == name:
                return region
        known = ", ".join(region.name for region in self.regions) or "none"
        raise KeyError(f"no region {name!r} in this scene; there are: {known}")


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


class Observation(msgspec.Struct, kw_only=True):
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
    reason: str | None = None
    run: Opened | None = None
    """Only in the reply to `reset`."""
    scene: Scene | None = None
    """Only in the reply to `reset`; `Client.scene` keeps it."""

    @property
    def done(self) -> bool:
        """True when the run cannot go on: stop it to get the result."""
        return self.terminated or self.truncated


class Result(msgspec.Struct, kw_only=True):
    """What a finished run is worth."""

    run_id: str
    task: str
    hand: str
    status: str
    """``practice``, or ``voided`` after a fault of the server"""
    score: float
    in_goal: int
    """Objects in the goal"""
    outside: int
    """Objects outside both boxes"""
    reason: str
    """Why it ended: ``stopped``, ``time_limit``, ``session_over``, …"""
    ticks: int
    sim_time_s: float
    """s of simulated time played"""
    state_hash: str
    """Hash of the final state: the same for the same seed and actions"""
    events: list[Event] = []
    session_left_s: float | None = None


class RunInfo(msgspec.Struct, kw_only=True):
    """The session's present run."""

    run_id: str
    task: str
    hand: str
    tick: int
    """The tick the next step must name"""
    open: bool
    """False when the server closed it: `Client.stop` fetches the result"""


class Time(msgspec.Struct, kw_only=True):
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


class Welcome(msgspec.Struct, kw_only=True):
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


class SessionWarning(msgspec.Struct, kw_only=True):
    """The session's time is running out."""

    mark_s: float
    session_left_s: float


class Envelope(msgspec.Struct, kw_only=True):
    """What every message from the server carries."""

    op: str
    id: int | None = None


class ErrorMessage(msgspec.Struct, kw_only=True):
    """A refused request."""

    code: str
    message: str = ""
    fatal: bool = False
    retry_after_s: float | None = None
