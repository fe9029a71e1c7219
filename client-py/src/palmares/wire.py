"""Messages of protocol v1 as typed structs, derived from docs/schema: `cargo xtask generate` writes them.

Units are SI unless a field says otherwise; vectors are in the world frame, quaternions are x, y, z, w. Fields
that this client does not know are ignored, so that it works with a newer server. The structs are exempt from
cyclic garbage collection (``gc=False``): they form no cycles, and thousands of them come every second.
Methods of a struct are in a subclass of the same name, in `palmares.messages` and what that imports.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal

import msgspec

from palmares.arrays import Array, Quat, Table, Vec3, array
from palmares.views import Brief


class Request(Brief, msgspec.Struct, kw_only=True, omit_defaults=True, gc=False, tag_field="op"):
    """A message to the server; the connection fills in its `id`."""

    id: int = 0


class Reply(Brief, msgspec.Struct, kw_only=True, gc=False, tag_field="op"):
    """A message from the server; `op` is its kind."""

    reply_to: int | None = msgspec.field(name="id", default=None)
    """`id` of the request it answers; ``None`` for a message that answers none"""


class BaseTarget(Brief, msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """A pose or velocity of the hand's base in the world frame, or the joints of its arm."""

    position: Vec3 | None = None
    """m"""
    quat_xyzw: Quat | None = None
    """Unit quaternion x, y, z, w; normalised on arrival, a length below 1e-6 is refused."""
    linear: Vec3 | None = None
    """m/s"""
    angular: Vec3 | None = None
    """rad/s"""
    joints: list[float] | None = None
    """rad, or m of a joint that slides; in the order of the task's ``arm``."""


class Action(Brief, msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """Targets for one tick. An omitted field keeps its last target."""

    base: BaseTarget | None = None
    """Target of the hand's base."""
    effort: list[float] | None = None
    """Part of its largest force that every motor may use, each in [0, 1]; 1 until a run has its first."""
    hand: list[float] | None = None
    """σ of every motor, in the hand's motor order, each in [0, 1]."""


class ActRequest(Request, kw_only=True, gc=False, tag="act"):
    """``act``: sets the action of a realtime run, from the next tick on."""

    action: Action
    """Targets; an omitted field keeps its last target."""
    cameras: list[str] = []
    """Cameras whose images the next observation has; see ``step``."""


class ByeRequest(Request, kw_only=True, gc=False, tag="bye"):
    """``bye``: ends the session; an open run is stopped and scored first."""


class HelloRequest(Request, kw_only=True, gc=False, tag="hello"):
    """``hello``: the first request on every connection."""

    client: str | dict[str, Any]
    """The client program. In practice its name is the team's name on the leaderboard."""
    resume_token: str | None = None
    """From an earlier ``welcome``: resumes that session, within 30 s of the loss of its connection."""
    session_s: float | None = None
    """Practice only: length of the session, s; without it, a practice session has no limit."""


class PushWrench(Brief, msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """Force and torque."""

    force: Vec3
    """N"""
    torque: Vec3
    """N·m"""


class PerturbRequest(Request, kw_only=True, gc=False, tag="perturb"):
    """``perturb``: applies a wrench to a link of the hand, from the next tick on. Practice only."""

    link: str
    """Name of a link of the hand."""
    wrench: PushWrench
    """World frame. The force acts at the origin of the link, and the torque is about it."""
    duration_s: float
    """Duration, s of simulated time."""


class ResetRequest(Request, kw_only=True, gc=False, tag="reset"):
    """``reset``: opens a run at tick 0."""

    task: str
    """Name of a task, see ``welcome.tasks``."""
    hand: str
    """Name of a hand, see ``welcome.hands``."""
    cameras: list[str] = []
    """Cameras whose images the observation of tick 0 has; see ``step``."""
    mode: Literal["lockstep", "realtime"]
    """Pace of the world. ``lockstep`` or ``realtime``."""
    noise: Literal["none", "real"] | None = None
    """The errors of the sensors; without it, those of ``welcome.competition``, which a competition
    prescribes. ``none`` or ``real``."""
    options: dict[str, Any] = {}
    """No options are defined; empty."""
    seed: int | None = None
    """Practice only: number of the scene, 0 to 2⁵³ − 1; without it, the server draws one."""
    sensing: Literal["sensors", "truth"]
    """Part of the state that the observations have. ``sensors`` or ``truth``."""


class StepRequest(Request, kw_only=True, gc=False, tag="step"):
    """``step``: advances the world by ``repeat`` ticks under one action."""

    tick: int
    """The current tick: that of the last observation."""
    action: Action
    """Targets; an omitted field keeps its last target."""
    cameras: list[str] = []
    """Cameras whose images the observation has: ``name`` for depth, or ``name.depth``, ``name.rgb``,
    ``name.bodies``."""
    repeat: int = 1
    """Ticks to advance, 1 to ``welcome.limits.repeat``. The step is shorter if the run ends."""


class StopRequest(Request, kw_only=True, gc=False, tag="stop"):
    """``stop``: lets the objects settle, counts them and closes the run."""


class TimeRequest(Request, kw_only=True, gc=False, tag="time"):
    """``time``: requests the session's clock."""


class Ack(Reply, kw_only=True, gc=False, tag="ack"):
    """``ack``: the action or push is accepted."""

    tick: int
    """The tick at which it takes effect: the observation of this tick is the first with its effect."""


class ErrorMessage(Reply, kw_only=True, gc=False, tag="error"):
    """``error``: why a request failed. A request that fails changes nothing."""

    code: str
    """The kind of the error, for programs."""
    message: str
    """The problem, and the valid values."""
    fatal: bool
    """Whether the connection closes after this error."""
    fault: str | None = None
    """The fault of the run's world, if it is the reason; otherwise ``None``. ``not_finite``,
    ``out_of_bounds``, ``unsolvable``, ``work_exhausted`` or ``crashed``."""
    retry_after_s: float | None = None
    """Time after which to try again, s."""


class BodyState(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Pose and velocity of a body in the world frame."""

    position: Vec3
    """Origin of the body frame, m."""
    quat_xyzw: Quat
    """Orientation, x, y, z, w."""
    linear: Vec3
    """Velocity of the origin, m/s."""
    angular: Vec3
    """rad/s"""


class Actuator(Brief, msgspec.Struct, kw_only=True, gc=False):
    """What a motor's sensors read."""

    name: str
    """Name of the motor."""
    command: float
    """Commanded σ."""
    position: float
    """σ the motor has reached."""
    velocity: float
    """dσ/dt, 1/s."""
    tension: float
    """Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes."""


class Wrench(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Force and torque in the world frame, torque about the base origin."""

    force: Vec3
    """N"""
    torque: Vec3
    """N·m"""


class HandState(Brief, msgspec.Struct, kw_only=True, gc=False):
    """What the hand's own sensors read."""

    base: BodyState
    """Pose and velocity of the base in the world frame, by the arm's encoders."""
    actuators: list[Actuator]
    """Command, position, velocity and tension of every motor, by its encoder and its current."""
    wrist: Wrench
    """Force and torque between arm and hand in the world frame, torque about the base's origin."""
    acceleration: Vec3 | None = None
    """Acceleration minus gravity in the frame of the accelerometer's link, m/s²; ``None`` when the hand has
    none."""
    _joints: Table = msgspec.field(name="joints", default_factory=list)
    _touch: Table = msgspec.field(name="touch", default_factory=list)

    @property
    def joints(self) -> Array:
        """Shape (n,); Joint encoders, in the order of ``welcome.hands[].encoders``, rad.

        empty when the hand has none.
        """
        return array(self._joints)

    @property
    def touch(self) -> Array:
        """Shape (n, 3).

        Force on every taxel along x and y of its patch and into the patch, in the order of
        ``welcome.hands[].taxels``, N; empty when the hand has none.
        """
        return array(self._touch, -1, 3)


class Event(Brief, msgspec.Struct, kw_only=True, gc=False):
    """An event of the referee."""

    tick: int
    """Time of the event, ticks."""
    kind: str
    """Kind of the event: section 4 of docs/tasks.md lists them."""
    object: int | None = None
    """Index of the object: with sensing ``truth``, and in a run's result."""


class ArmReading(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Readings of the joints of an arm, in its order. Their encoders have no error."""

    position: list[float]
    """rad, or m of a joint that slides."""
    velocity: list[float]
    """rad/s or m/s, mean of the last tick."""


class CameraImage(Brief, msgspec.Struct, kw_only=True, dict=True):
    """An image of a camera."""

    camera: str
    """The camera's name."""
    tick: int
    """The tick after which it was exposed; with ``noise: "real"`` some ticks before that of the
    observation."""
    width: int
    """Pixels in a row."""
    height: int
    """Rows."""
    fx: float
    """Focal lengths, pixels. The point (x, y, z) of the optical frame is at u = fx x/z + cx, v = fy y/z + cy,
    where the middle of the first pixel is at 0.5, 0.5."""
    fy: float
    """See ``fx``."""
    cx: float
    """The optical axis in the image, pixels."""
    cy: float
    """See ``cx``."""
    position: Vec3
    """Origin of the optical frame (x right, y down, z forward) in the world when it was exposed, m."""
    quat_xyzw: Quat
    """Orientation of the optical frame, x, y, z, w."""
    depth_unit: float
    """Unit of ``depth``, m."""
    _bodies: bytes | None = msgspec.field(name="bodies", default=None)
    _depth: bytes | None = msgspec.field(name="depth", default=None)
    _rgb: bytes | None = msgspec.field(name="rgb", default=None)


class Opened(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Inputs of the run."""

    task: str
    """Name of the task."""
    hand: str
    """Name of the hand."""
    mode: str
    """Pace of the run. ``lockstep`` or ``realtime``."""
    sensing: str
    """``sensors`` or ``truth``."""
    noise: str
    """``none`` or ``real``."""
    seed: int | None = None
    """In practice: what ``reset`` takes to build this scene again."""
    tick_s: float
    """Length of a tick, s."""
    time_limit_s: float
    """Longest run, s of simulated time."""


class Shape(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A convex shape centred on its own frame. Lengths in m. The axis of cylinders and capsules is z."""

    type: str
    """``sphere``, ``capsule``, ``cylinder``, ``box`` or ``hull``."""
    radius: float | None = None
    """m"""
    half_length: float | None = None
    """m, without the caps"""
    half_extents: Vec3 | None = None
    """m, including the rounding"""
    rounding: float = 0.0
    """m"""
    points: list[Vec3] | None = None
    """m"""


class ScenePart(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A convex part of a body."""

    position: Vec3
    """Origin in the body frame, m."""
    quat_xyzw: Quat
    """Orientation, x, y, z, w."""
    shape: Shape
    """Shape, centred on its own frame."""


class SceneBody(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A body and its shapes, in the world frame at tick 0."""

    id: int
    """Index in the scene."""
    name: str
    """Unique name, such as ``ball_3`` or ``box_a``."""
    free: bool
    """False for furniture."""
    mass: float
    """Mass, kg; 0 for furniture."""
    com: Vec3
    """Centre of mass in the body frame, m."""
    friction: float
    """Coulomb coefficient between two such surfaces; two bodies have the geometric mean of theirs."""
    parts: Sequence[ScenePart]
    """Convex parts in the body frame."""
    color: Vec3
    """sRGB, 0 to 1."""
    endless: bool = False
    """Infinite horizontal ground: its surface is the top of its only part, a box that is for drawing."""
    position: Vec3 | None = None
    """Origin, m; ``None`` for free bodies in a run with sensing ``sensors``."""
    quat_xyzw: Quat | None = None
    """Orientation, x, y, z, w; ``None`` where the position is."""


class Region(Brief, msgspec.Struct, kw_only=True, gc=False):
    """An axis-aligned region that the rules refer to, such as the inside of ``box_b``."""

    name: str
    """Name, such as ``box_b``."""
    min: Vec3
    """Lower corner, m."""
    max: Vec3
    """Upper corner, m."""
    role: str | None = None
    """Role in the rules: ``start`` or ``goal``; ``None`` for others."""


class Within(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A box in the frame of an object."""

    object: str
    """Name of the object."""
    min: Vec3
    """Lowest corner in its frame, m."""
    max: Vec3
    """Highest corner, m."""


class GoalInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A goal of a task with its points and tolerances.

    All given conditions hold at the same time, for ``for_s``.
    """

    name: str
    """Its name, mostly the kind of its event."""
    points: float
    """Points; less than 0 is a penalty."""
    for_s: float = 0.0
    """Time for which the conditions hold without a break, s."""
    above_m: float | None = None
    """Least rise of the point above its height at tick 0, m."""
    hand_off_m: float | None = None
    """Least distance of the object's centre of mass from the hand's base, m."""
    inside: str | None = None
    """The region that contains the point."""
    less_by: str | None = None
    """Where the points shrink in proportion to a measured quantity: ``slip`` from 0 to ``slip_m``, ``time``
    from 0 to ``slow_s``."""
    object: str | None = None
    """The object; ``None`` where the goal holds for each object."""
    outside: list[str] = []
    """The regions of which none contains the point."""
    point: Vec3 | None = None
    """The measured point in the object's frame, m; ``None``: its centre of mass."""
    rest_m_s: float | None = None
    """The object's speed is below this, m/s."""
    slip_m: float | None = None
    """The object moves by less than this in the frame of the hand's base, m."""
    slow_s: float | None = None
    """Simulated time from which on the points are 0, s."""
    upright_deg: float | None = None
    """Largest angle of the object's z from the vertical, degrees."""
    within: Within | None = None
    """The box in another object's frame that contains the point."""


class Scene(Brief, msgspec.Struct, kw_only=True, gc=False):
    """The world at tick 0, in the reply to ``reset``."""

    bodies: Sequence[SceneBody]
    """All bodies: free ones first, in the order of ``truth.objects``."""
    regions: Sequence[Region]
    """Regions that the rules refer to."""
    gravity: Vec3
    """Gravity, m/s²."""
    goals: list[GoalInfo] = []
    """Goals of the task with their points and tolerances, in the order in which they are reached."""


class ObjectTables(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Pose and velocity of the free objects in the world frame: in every table one row for each."""

    _position: Table = msgspec.field(name="position")
    _quat_xyzw: Table = msgspec.field(name="quat_xyzw")
    _linear: Table = msgspec.field(name="linear")
    _angular: Table = msgspec.field(name="angular")

    @property
    def position(self) -> Array:
        """Shape (n, 3); Origin of the body frame, m."""
        return array(self._position, -1, 3)

    @property
    def quat_xyzw(self) -> Array:
        """Shape (n, 4); Orientation, x, y, z, w."""
        return array(self._quat_xyzw, -1, 4)

    @property
    def linear(self) -> Array:
        """Shape (n, 3); Velocity of the origin, m/s."""
        return array(self._linear, -1, 3)

    @property
    def angular(self) -> Array:
        """Shape (n, 3); rad/s."""
        return array(self._angular, -1, 3)


class Joints(Brief, msgspec.Struct, kw_only=True, dict=True):
    """Joint coordinates."""

    _position: Table = msgspec.field(name="position")
    _velocity: Table = msgspec.field(name="velocity")

    @cached_property
    def position(self) -> Array:
        """Shape (n,); rad."""
        return array(self._position)

    @cached_property
    def velocity(self) -> Array:
        """Shape (n,); rad/s."""
        return array(self._velocity)


class ContactTables(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Touching contacts, in every list one entry for each: force on body ``b`` by body ``a``, world frame."""

    a: list[str]
    """Name of the first body."""
    b: list[str]
    """Name of the second body."""
    _position: Table = msgspec.field(name="position")
    _force: Table = msgspec.field(name="force")

    @property
    def position(self) -> Array:
        """Shape (n, 3); m."""
        return array(self._position, -1, 3)

    @property
    def force(self) -> Array:
        """Shape (n, 3); N."""
        return array(self._force, -1, 3)


class Truth(Brief, msgspec.Struct, kw_only=True, dict=True):
    """The full state."""

    _objects: ObjectTables = msgspec.field(name="objects")
    joints: Joints
    """Joint coordinates, in the hand's coordinate order."""
    _contacts: ContactTables = msgspec.field(name="contacts")
    _predicted_equilibrium: Table = msgspec.field(name="predicted_equilibrium")

    @cached_property
    def predicted_equilibrium(self) -> Array:
        """Shape (n,); Equilibrium of the free hand at the present motor position, rad.

        empty if it is not defined.
        """
        return array(self._predicted_equilibrium)


class Observation(Reply, kw_only=True, gc=False, tag="obs"):
    """``obs``: the state after ``reset`` or ``step``, or after a tick of a realtime run."""

    run_id: str
    """Identifies the run."""
    session_left_s: float | None = None
    """s; ``None`` for a session without a limit."""
    tick: int
    """Ticks since reset."""
    sim_time_s: float
    """s since reset."""
    applied_action: Action
    """The action as applied: clipped to the spec, with omitted fields filled in."""
    hand: HandState
    """The hand."""
    events: list[Event]
    """Events of this tick."""
    score: float
    """Score if the run ended now, without the settling rule."""
    terminated: bool
    """The task is complete: nothing more can be gained."""
    truncated: bool
    """The run was cut short by a limit."""
    arm: ArmReading | None = None
    """The arm that carries the hand, where the task has one."""
    _cameras: Sequence[CameraImage] = msgspec.field(name="cameras", default_factory=list)
    late_s: float | None = None
    """In a realtime run: how long after the tick was due this was sent, s."""
    reason: str | None = None
    """The reason, when ``terminated`` or ``truncated``."""
    resumed: bool = False
    """The run has gone back: another host continues it, and this is the first observation."""
    run: Opened | None = None
    """Inputs of the run; only in the reply to ``reset``."""
    scene: Scene | None = None
    """Contents of the world; only in the reply to ``reset``."""
    _truth: Truth | None = msgspec.field(name="truth", default=None)


class Replay(Brief, msgspec.Struct, kw_only=True, gc=False):
    """The replay of a run: ``GET /v1/runs/{id}/replay``."""

    sha256: str
    """SHA-256 of the file, 64 hexadecimal digits."""
    bytes: int
    """Size of the file."""


class Result(Reply, kw_only=True, gc=False, tag="result"):
    """``result``: the outcome of a finished run. The server has stored it before it sends it."""

    run_id: str
    """Identifies the run."""
    task: str
    """Its task."""
    task_hash: str = ""
    """SHA-256 of the whole task, 64 hexadecimal digits."""
    hand: str
    """Its hand."""
    mode: str = "lockstep"
    """Pace of its world. ``lockstep`` or ``realtime``."""
    status: str
    """``practice``; ``training`` for a run with training options; in a competition ``provisional``;
    ``aborted`` if it ended at tick 0; ``voided`` after a fault of the server or by a decision of the
    organizer."""
    score: float
    """Points."""
    in_goal: int
    """Objects in the goal; where objects are arranged, goals reached."""
    outside: int
    """Objects outside both boxes."""
    reason: str
    """Reason why the run ended. ``stopped``, ``complete``, ``session_over``, ``disconnected``,
    ``time_limit``, ``world_fault`` or ``voided``."""
    ticks: int
    """Number of ticks."""
    sim_time_s: float
    """Simulated time, s."""
    missed_ticks: int = 0
    """Realtime: ticks without a new action."""
    late_ticks: int = 0
    """Realtime: ticks that the server began more than half a tick after they were due."""
    late_max_s: float = 0.0
    """Realtime: longest such delay, s."""
    dropped_obs: int = 0
    """Realtime: observations that the server dropped because the client did not read them in time."""
    state_hash: str
    """Hash of the final state, 16 hexadecimal digits."""
    events: list[Event] = []
    """All events of the referee."""
    session_left_s: float | None = None
    """Remaining time, s; ``None`` for a session without a limit."""
    fault: str | None = None
    """The fault of its world; ``None`` if there was none. ``not_finite``, ``out_of_bounds``, ``unsolvable``,
    ``work_exhausted`` or ``crashed``."""
    note: str | None = None
    """Meaning of the fault and advice, for display; ``None`` without a fault."""
    replay: Replay | None = None
    """Its replay; ``None`` if the run was not recorded."""


class RunInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """The session's open run."""

    run_id: str
    """Identifies the run."""
    task: str
    """Its task."""
    hand: str
    """Its hand."""
    mode: str = "lockstep"
    """Pace of its world. ``lockstep`` or ``realtime``."""
    tick: int
    """The current tick, which the next ``step`` must name."""
    open: bool
    """False if the server closed it (time limit, end of the session): ``stop`` returns the result."""


class Time(Reply, kw_only=True, gc=False, tag="time"):
    """``time``: the session's clock."""

    session_left_s: float | None = None
    """Remaining time, s; ``None`` for a session without a limit."""
    session_s: float | None = None
    """Length of the session, s; ``None`` for none."""
    elapsed_s: float
    """The greater of ``wall_s`` and ``simulated_s``, s."""
    wall_s: float
    """Wall-clock time since the first reset, without pauses, s."""
    simulated_s: float
    """Simulated time of all runs, s."""
    refunded_s: float = 0.0
    """Time that was refunded for faults of the server, s; it is not part of the other times."""
    paused: bool = False
    """Whether an organizer pauses the session."""
    run: RunInfo | None = None
    """The session's open run, if any."""
    server_unix_ms: int = 0
    """The server's clock, ms since 1970 UTC."""


class SessionWarning(Reply, kw_only=True, gc=False, tag="warning"):
    """``warning``: the session's time is running out. It comes when 300, 60 and 10 s are left."""

    mark_s: int
    """The mark that was passed: 300, 60 or 10 s."""
    session_left_s: float
    """Remaining time, s."""


class Competition(Brief, msgspec.Struct, kw_only=True, gc=False):
    """The competition, or the practice, that the server runs."""

    name: str
    """Name, for people."""
    mode: str
    """``practice`` (no token, own seeds, full state) or ``official``."""
    session_s: float | None = None
    """Length of a session, s; ``None`` for none."""
    reset_cost_s: float = 0.0
    """Time that each ``reset`` takes from the session, s."""
    noise: str = "none"
    """Sensor errors of runs that request none; in a competition, of every run. ``none`` or ``real``."""
    sensors_only: list[str] = []
    """Tasks whose runs must have sensing ``sensors``."""
    hand_spread: bool = False
    """Whether the seed of a run draws the numbers of its hand that are known as ranges."""
    scenes: str = "shared"
    """Whose scene run ``k`` of a task has, in a competition: one for all teams, or every team's own.
    ``shared`` or ``per_team``."""


class ServerInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """The program of the server."""

    version: str
    """Version."""
    build_hash: str
    """Commit it was built from."""


class Limits(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Limits of requests and connections; those of actions are in ``specs``."""

    message_bytes: int
    """Largest message of a client, bytes."""
    repeat: int
    """Largest ``repeat`` of a ``step``."""
    requests_per_s: float
    """Largest rate of requests of a connection, 1/s."""
    requests_burst: float
    """Requests that a connection may send at once above that rate."""
    resume_grace_s: float
    """Time that a session without a connection waits for its client, s."""
    ping_interval_s: float
    """Period of the server's pings, s."""
    ping_timeout_s: float
    """A connection that is silent, or does not read a message, for this long is closed, s."""
    hello_timeout_s: float
    """Largest time between the opening of a connection and ``hello``, s."""
    hold_ticks: int
    """Realtime: after this number of ticks without an action, the hand holds still."""
    outbox_obs: int
    """Realtime: largest number of unread observations; the server drops the oldest of more."""


class ImageInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """An image of a camera, as clients learn it."""

    name: str
    """Its field in ``obs.cameras[]``, and ``NAME`` in the request ``camera.NAME``."""
    shape: list[int]
    """Shape of the array: rows, pixels in a row, and the numbers of a pixel if it has several."""
    unit: str
    """Unit; empty for a pure number."""
    minimum: float
    """Least value."""
    maximum: float
    """Largest value."""
    truth: bool
    """Only with sensing ``truth``."""
    description: str
    """For people."""


class CameraInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A camera of a task or a hand."""

    name: str
    """Its name in ``step.cameras``. A hand's camera has the prefix ``hand_`` in a task that has a camera of
    its name."""
    width: int
    """Pixels in a row."""
    height: int
    """Rows."""
    fov_deg: float
    """Horizontal field of view, degrees."""
    near: float
    """Shortest distance with a reading, m."""
    far: float
    """Longest distance with a reading, m."""
    images: list[ImageInfo] = []
    """The images that it takes."""


class ArmJointInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A joint of an arm."""

    name: str
    """Its name in the URDF."""
    unit: str
    """``rad``, or ``m`` for a joint that slides."""
    minimum: float | None = None
    """Least position; ``None`` for a joint without end."""
    maximum: float | None = None
    """Largest position; ``None`` for a joint without end."""
    speed: float
    """Largest speed, 1/s."""


class TaskInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Constants of a task."""

    name: str
    """Its name in ``reset``."""
    description: str
    """Text for people."""
    tick_s: float
    """Length of a tick, s."""
    step_s: float
    """Time step of the integrator, s."""
    time_limit_s: float
    """Longest run, s of simulated time."""
    cameras: list[CameraInfo] = []
    """Its cameras."""
    hash: str = ""
    """SHA-256 of the whole task, 64 hexadecimal digits."""
    goals: list[GoalInfo] = []
    """Its goals with their points and tolerances, in the order in which they are reached."""
    arm: list[ArmJointInfo] = []
    """Joints of the arm that carries the hand, in the order of ``base.joints``; empty where the hand flies
    freely."""


class ColumnInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Numbers of a channel that have a unit and a range in common."""

    width: int
    """Number of values."""
    unit: str
    """Unit; empty for a pure number."""
    minimum: float | None = None
    """Least value; ``None`` for none."""
    maximum: float | None = None
    """Largest value; ``None`` for none."""
    name: str = ""
    """Absent where the channel's numbers have no names."""


class ChannelInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A channel of a hand, as clients and viewers learn it."""

    name: str
    """Name of its array in environments and batches."""
    key: str
    """Its key in ``obs.hand``."""
    shape: list[int]
    """Shape of the array."""
    columns: list[ColumnInfo]
    """Columns along the array's last axis. Where a column has a name, ``obs.hand`` has an object with these
    names, or a list of such objects, one for each row."""
    description: str
    """For people."""
    truth: bool = False
    """Present and true if the channel is only in observations with sensing ``truth``."""


class HandInfo(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Names of a hand's parts; ``GET /v1/hands/{name}`` returns its geometry."""

    name: str
    """Its name in ``reset``."""
    description: str
    """Text for people."""
    motors: list[str]
    """Names of the motors, in the order of ``action.hand``."""
    joints: list[str]
    """Names of the joint coordinates, in the order of ``truth.joints``."""
    encoders: list[str] = []
    """Names of the joints that have an encoder, in the order of ``hand.joints``."""
    taxels: list[str] = []
    """Names of the taxels, in the order of ``hand.touch``."""
    channels: list[ChannelInfo] = []
    """The channels of ``obs.hand`` with this hand."""
    cameras: list[CameraInfo] = []
    """Its cameras."""


class FieldSpec(Brief, msgspec.Struct, kw_only=True, gc=False):
    """One field."""

    name: str
    """Path; ``[]`` stands for every entry of a list."""
    shape: list[int | str]
    """Lengths; empty for a single number."""
    unit: str
    """Unit; empty for a pure number."""
    minimum: float | None = None
    """Least value of an entry; ``None`` for none. Commands beyond are clipped."""
    maximum: float | None = None
    """Largest value of an entry; ``None`` for none."""


class Specs(Brief, msgspec.Struct, kw_only=True, gc=False):
    """Every numeric field a controller writes or reads."""

    action: Sequence[FieldSpec]
    """Fields of ``step.action``."""
    observation: Sequence[FieldSpec]
    """Fields of ``obs``."""


class Welcome(Reply, kw_only=True, gc=False, tag="welcome"):
    """``welcome``: everything that holds for the whole session."""

    session_id: str
    """Identifies the session."""
    resume_token: str
    """Secret with which a new connection resumes the session."""
    team: str
    """Name of the team on the leaderboard."""
    session_left_s: float | None = None
    """Remaining time, s; ``None`` for a session without a limit."""
    competition: Competition
    """The competition."""
    server: ServerInfo
    """The program."""
    limits: Limits
    """Limits of requests and connections."""
    tasks: list[TaskInfo]
    """Tasks of the server."""
    hands: list[HandInfo]
    """Hands of the server."""
    specs: Specs
    """Fields of actions and observations."""
    run: RunInfo | None = None
    """The open run of a session that is resumed; otherwise ``None``."""
    note: str | None = None
    """A remark on the team's name, for people; ``None`` if there is none."""


class TaskBest(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A team's best run of a task."""

    score: float
    """Points."""
    run_id: str
    """The earliest run with this score."""
    status: str
    """``practice``, ``provisional`` or ``verified``."""
    ended_unix_ms: int
    """End of the run, ms since 1970 UTC."""


class LeaderboardRow(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A team's row in the ranking."""

    rank: int
    """From 1."""
    team: str
    """The team."""
    total: float
    """Sum of the best scores."""
    runs: int
    """Finished runs."""
    reached_unix_ms: int
    """When the total was reached: the end of the last run in it, ms since 1970 UTC."""
    sensors_only: bool
    """Whether no run of the team had the true state."""
    sensors_rank: int | None = None
    """Its rank among the teams with ``sensors_only``."""
    tasks: dict[str, TaskBest]
    """Best run of each task."""
