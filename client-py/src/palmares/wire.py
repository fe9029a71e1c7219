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


class Request(msgspec.Struct, kw_only=True, omit_defaults=True, gc=False, tag_field="op"):
    """A message to the server; the connection fills in its `id`."""

    id: int = 0


class Reply(msgspec.Struct, kw_only=True, gc=False, tag_field="op"):
    """A message from the server; `op` is its kind."""

    reply_to: int | None = msgspec.field(name="id", default=None)
    """`id` of the request it answers; ``None`` for a message that answers none"""


class BaseTarget(msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """A pose to reach, or a velocity to keep, of the hand's base in the world frame."""

    position: Vec3 | None = None
    """m"""
    quat_xyzw: Quat | None = None
    """Unit quaternion x, y, z, w; normalised on arrival, a length below 1e-6 is refused."""
    linear: Vec3 | None = None
    """m/s"""
    angular: Vec3 | None = None
    """rad/s"""


class Action(msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """Targets for one tick. What is left out keeps its last target."""

    base: BaseTarget | None = None
    """Where the hand's base should go."""
    hand: list[float] | None = None
    """σ of every motor, in the hand's motor order, each in [0, 1]."""


class ActRequest(Request, kw_only=True, gc=False, tag="act"):
    """``act``: from its next tick on a realtime world follows this action."""

    action: Action
    """Targets; what is left out keeps its last target."""
    cameras: list[str] = []
    """Cameras whose pictures the next observation shall have; see ``step``."""


class ByeRequest(Request, kw_only=True, gc=False, tag="bye"):
    """``bye``: ends the session; an open run is stopped and scored first."""


class HelloRequest(Request, kw_only=True, gc=False, tag="hello"):
    """``hello``: the first request on every connection."""

    client: str | dict[str, Any]
    """Who is asking. In practice its name is the team's name on the leaderboard."""
    resume_token: str | None = None
    """From an earlier ``welcome``: takes that session up again, within 30 s of losing the connection."""
    session_s: float | None = None
    """Practice only: length of the session in s. Without it a practice session has no limit."""


class PushWrench(msgspec.Struct, kw_only=True, omit_defaults=True, gc=False):
    """Force and torque."""

    force: Vec3
    """N"""
    torque: Vec3
    """N·m; none when left out."""


class PerturbRequest(Request, kw_only=True, gc=False, tag="perturb"):
    """``perturb``: practice only. A wrench acts on a link of the hand from the next tick on."""

    link: str
    """Name of a link of the hand."""
    wrench: PushWrench
    """World frame; the torque is about the link's origin, where the force acts."""
    duration_s: float
    """For how long, s of simulated time."""


class ResetRequest(Request, kw_only=True, gc=False, tag="reset"):
    """``reset``: opens a run at tick 0."""

    task: str
    """Name of a task, see ``welcome.tasks``."""
    hand: str
    """Name of a hand, see ``welcome.hands``."""
    cameras: list[str] = []
    """Cameras to look through at tick 0; see ``step``."""
    mode: Literal["lockstep", "realtime"]
    """How time passes. ``lockstep`` or ``realtime``."""
    noise: Literal["none", "real"] | None = None
    """How good the sensors are; in a competition the organizer says. Left out: as the competition has it.
    ``none`` or ``real``."""
    options: dict[str, Any] = {}
    """None are defined yet; must be left out or empty."""
    seed: int | None = None
    """Practice only: which scene, 0 to 2⁵³ − 1. Left out, the server draws one."""
    sensing: Literal["sensors", "truth"]
    """How much ``obs`` shows. ``sensors`` or ``truth``."""


class StepRequest(Request, kw_only=True, gc=False, tag="step"):
    """``step``: advances the world by ``repeat`` ticks under one action."""

    tick: int
    """The current tick: that of the last ``obs``."""
    action: Action
    """Targets; what is left out keeps its last target."""
    cameras: list[str] = []
    """Cameras whose pictures the observation shall have: ``name`` for depth, or ``name.depth``, ``name.rgb``,
    ``name.bodies``."""
    repeat: int = 1
    """Ticks to advance, 1 to ``welcome.limits.repeat``; 1 when left out. Ends early when the run is over."""


class StopRequest(Request, kw_only=True, gc=False, tag="stop"):
    """``stop``: lets the objects settle, counts, closes the run."""


class TimeRequest(Request, kw_only=True, gc=False, tag="time"):
    """``time``: how the session's clock stands."""


class Ack(Reply, kw_only=True, gc=False, tag="ack"):
    """``ack``: the action or push was taken."""

    tick: int
    """The tick at which it takes effect: the ``obs`` of this tick is the first to show it."""


class ErrorMessage(Reply, kw_only=True, gc=False, tag="error"):
    """``error``: why a request failed. It changed nothing."""

    code: str
    """For programs."""
    message: str
    """For people."""
    fatal: bool
    """The connection closes after this."""
    fault: str | None = None
    """What the world of the run failed of, when that is why; ``None`` otherwise. ``not_finite``,
    ``out_of_bounds``, ``unsolvable``, ``work_exhausted`` or ``crashed``."""
    retry_after_s: float | None = None
    """When asking again makes sense, s."""


class BodyState(msgspec.Struct, kw_only=True, gc=False):
    """Pose and velocity of a body in the world frame."""

    position: Vec3
    """Origin of the body frame, m."""
    quat_xyzw: Quat
    """Orientation, x, y, z, w."""
    linear: Vec3
    """Velocity of the origin, m/s."""
    angular: Vec3
    """rad/s"""


class Actuator(msgspec.Struct, kw_only=True, gc=False):
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


class Wrench(msgspec.Struct, kw_only=True, gc=False):
    """Force and torque in the world frame, torque about the base origin."""

    force: Vec3
    """N"""
    torque: Vec3
    """N·m"""


class HandState(msgspec.Struct, kw_only=True, gc=False):
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


class Event(msgspec.Struct, kw_only=True, gc=False):
    """Something the referee noted."""

    tick: int
    """When, in ticks."""
    kind: str
    """``in_goal``, ``left_goal``, ``outside``, ``back_inside``, ``lifted``, ``dropped``, ``slipped``,
    ``held``, ``shaken``; where objects are arranged, the name of the goal that has been reached."""
    object: int | None = None
    """Which object: told with sensing ``truth``, and in a run's result."""


class CameraImage(msgspec.Struct, kw_only=True, dict=True):
    """What a camera saw."""

    camera: str
    """The camera's name."""
    tick: int
    """The tick after which it was exposed; with ``noise: "real"`` some ticks ago."""
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
    """The optical axis in the picture, pixels."""
    cy: float
    """See ``cx``."""
    position: Vec3
    """Origin of the optical frame (x right, y down, z forward) in the world when it was exposed, m."""
    quat_xyzw: Quat
    """Its orientation, x, y, z, w."""
    depth_unit: float
    """What a step of ``depth`` is, m."""
    _bodies: bytes | None = msgspec.field(name="bodies", default=None)
    _depth: bytes | None = msgspec.field(name="depth", default=None)
    _rgb: bytes | None = msgspec.field(name="rgb", default=None)


class Opened(msgspec.Struct, kw_only=True, gc=False):
    """How a run was opened."""

    task: str
    """Name of the task."""
    hand: str
    """Name of the hand."""
    mode: str
    """How time passes. ``lockstep`` or ``realtime``."""
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


class Shape(msgspec.Struct, kw_only=True, gc=False):
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


class ScenePart(msgspec.Struct, kw_only=True, gc=False):
    """A convex part of a body."""

    position: Vec3
    """In the body frame, m."""
    quat_xyzw: Quat
    """x, y, z, w"""
    shape: Shape
    """Geometry."""


class SceneBody(msgspec.Struct, kw_only=True, gc=False):
    """A body and its shapes."""

    id: int
    """Index in the scene."""
    name: str
    """Unique name: ``ball_3``, ``box_a``."""
    free: bool
    """False for furniture."""
    mass: float
    """kg; 0 for furniture."""
    com: Vec3
    """Centre of mass in the body frame, m."""
    friction: float
    """Coulomb friction coefficient of two surfaces like this one; two bodies have the geometric mean of
    theirs."""
    parts: Sequence[ScenePart]
    """Convex parts in the body frame."""
    color: Vec3
    """sRGB, for viewers."""
    endless: bool = False
    """A horizontal ground that goes on for ever: its surface is the top of its one part, which shows some of
    it."""
    position: Vec3 | None = None
    """Position at tick 0, m; not told of free bodies when the run's sensing is ``sensors``."""
    quat_xyzw: Quat | None = None
    """Orientation at tick 0, x, y, z, w; told or not as the position."""


class Region(msgspec.Struct, kw_only=True, gc=False):
    """An axis-aligned region of space."""

    name: str
    """``box_a``, ``box_b``."""
    min: Vec3
    """m"""
    max: Vec3
    """m"""
    role: str | None = None
    """The part it plays in the rules: ``start``, ``goal``; none for others."""


class Scene(msgspec.Struct, kw_only=True, gc=False):
    """Everything a controller needs to know about the world, sent in the reply to ``reset``."""

    bodies: Sequence[SceneBody]
    """Fixed and free bodies. Free ones come first, in the order of ``truth.objects``."""
    regions: Sequence[Region]
    """Named regions the rules speak of."""
    gravity: Vec3
    """m/s²"""


class ObjectTables(msgspec.Struct, kw_only=True, gc=False):
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


class Joints(msgspec.Struct, kw_only=True, dict=True):
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


class ContactTables(msgspec.Struct, kw_only=True, gc=False):
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


class Truth(msgspec.Struct, kw_only=True, dict=True):
    """The full state."""

    _objects: ObjectTables = msgspec.field(name="objects")
    joints: Joints
    """Joint coordinates, in the hand's coordinate order."""
    _contacts: ContactTables = msgspec.field(name="contacts")
    _predicted_equilibrium: Table = msgspec.field(name="predicted_equilibrium")

    @cached_property
    def predicted_equilibrium(self) -> Array:
        """Shape (n,); Where the free hand would rest at the present motor position, rad.

        empty if that is not defined.
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
    """The action as applied: clipped to the spec, with what was left out filled in."""
    hand: HandState
    """The hand."""
    events: list[Event]
    """What the referee noted in this tick."""
    score: float
    """Score if the run ended now, without the settling rule."""
    terminated: bool
    """The task is complete: nothing more can be gained."""
    truncated: bool
    """The run was cut short by a limit."""
    _cameras: Sequence[CameraImage] = msgspec.field(name="cameras", default_factory=list)
    late_s: float | None = None
    """In a realtime run: how long after the tick was due this was sent, s."""
    reason: str | None = None
    """Why, when ``terminated`` or ``truncated``."""
    run: Opened | None = None
    """How the run was opened; in the reply to ``reset`` only."""
    scene: Scene | None = None
    """What stands in the world; in the reply to ``reset`` only."""
    truth: Truth | None = None
    """The full state, when the run's sensing is ``truth``."""


class Replay(msgspec.Struct, kw_only=True, gc=False):
    """The replay of a run: ``GET /v1/runs/{id}/replay``."""

    sha256: str
    """SHA-256 of the file, 64 hexadecimal digits."""
    bytes: int
    """Its size."""


class Result(Reply, kw_only=True, gc=False, tag="result"):
    """``result``: what a finished run is worth. It stands in the server's database when this is sent."""

    run_id: str
    """Identifies the run."""
    task: str
    """Its task."""
    task_hash: str = ""
    """SHA-256 of everything that the task is, 64 hexadecimal digits."""
    hand: str
    """Its hand."""
    mode: str = "lockstep"
    """How time passed in it. ``lockstep`` or ``realtime``."""
    status: str
    """``practice``, or ``voided`` after a fault of the server."""
    score: float
    """Points."""
    in_goal: int
    """Objects in the goal; where objects are arranged, goals reached."""
    outside: int
    """Objects outside both boxes."""
    reason: str
    """Why the run ended. ``stopped``, ``complete``, ``session_over``, ``disconnected``, ``time_limit``,
    ``world_fault`` or ``voided``."""
    ticks: int
    """Ticks played."""
    sim_time_s: float
    """s of simulated time played."""
    missed_ticks: int = 0
    """In real time: ticks for which no new action had come."""
    late_ticks: int = 0
    """In real time: ticks that the server began more than half a tick after they were due."""
    late_max_s: float = 0.0
    """In real time: the latest beginning of a tick, s."""
    dropped_obs: int = 0
    """In real time: observations that the client did not take in time."""
    state_hash: str
    """Hash of the final state, 16 hexadecimal digits."""
    events: list[Event] = []
    """Everything the referee noted."""
    session_left_s: float | None = None
    """s; ``None`` for a session without a limit."""
    fault: str | None = None
    """What the world failed of; ``None`` when it did not. ``not_finite``, ``out_of_bounds``, ``unsolvable``,
    ``work_exhausted`` or ``crashed``."""
    note: str | None = None
    """For people: what that means and what to try; ``None`` when the world did not fail."""
    replay: Replay | None = None
    """Its replay; ``None`` when the run was not recorded."""


class RunInfo(msgspec.Struct, kw_only=True, gc=False):
    """The session's present run."""

    run_id: str
    """Identifies the run."""
    task: str
    """Its task."""
    hand: str
    """Its hand."""
    mode: str = "lockstep"
    """How time passes in it. ``lockstep`` or ``realtime``."""
    tick: int
    """The current tick, which the next ``step`` must name."""
    open: bool
    """False when the server closed it (time limit, end of the session): ``stop`` fetches the result."""


class Time(Reply, kw_only=True, gc=False, tag="time"):
    """``time``: how the session's clock stands."""

    session_left_s: float | None = None
    """What is left, s; ``None`` for a session without a limit."""
    session_s: float | None = None
    """Length of the session, s; ``None`` for none."""
    elapsed_s: float
    """The greater of the next two, s."""
    wall_s: float
    """Wall-clock time since the first reset, pauses left out, s."""
    simulated_s: float
    """Simulated time of all runs, s."""
    refunded_s: float = 0.0
    """Time given back for faults of the server, s; the other times are without it."""
    paused: bool = False
    """Whether an organizer has stopped the clock."""
    run: RunInfo | None = None
    """The session's run, if any."""
    server_unix_ms: int = 0
    """The server's clock, ms since 1970 UTC."""


class SessionWarning(Reply, kw_only=True, gc=False, tag="warning"):
    """``warning``: the session's time is running out. Sent unasked at 300, 60 and 10 s."""

    mark_s: int
    """Which of the marks was passed, s."""
    session_left_s: float
    """What is left, s."""


class Competition(msgspec.Struct, kw_only=True, gc=False):
    """The competition."""

    name: str
    """For people."""
    mode: str
    """``practice``: no token, own seeds, full state."""
    session_s: float | None = None
    """Length of a session, s; ``None`` for none."""
    reset_cost_s: float = 0.0
    """What each ``reset`` that opens a run takes from the session, s."""
    noise: str = "none"
    """How good the sensors of a run are that does not ask for others; in a competition, of every run.
    ``none`` or ``real``."""
    sensors_only: list[str] = []
    """Tasks that are played with ``sensors`` only."""


class ServerInfo(msgspec.Struct, kw_only=True, gc=False):
    """The program."""

    version: str
    """Version of the program."""
    build_hash: str
    """Commit it was built from."""


class Limits(msgspec.Struct, kw_only=True, gc=False):
    """What a client must keep to."""

    message_bytes: int
    """Largest inbound message."""
    repeat: int
    """Largest ``repeat`` of a ``step``."""
    requests_per_s: float
    """Requests per second that a connection may keep up."""
    requests_burst: float
    """Requests it may send at once beyond that rate."""
    resume_grace_s: float
    """How long a session waits for its client to come back, s."""
    ping_interval_s: float
    """Period of the server's pings, s."""
    ping_timeout_s: float
    """A connection silent for this long, or that does not take a message for this long, is dropped, s."""
    hello_timeout_s: float
    """A connection that has not said hello for this long is closed, s."""
    hold_ticks: int
    """In real time: for so many ticks a silent controller's last action goes on; then the hand holds
    still."""
    outbox_obs: int
    """In real time: observations that wait for a slow client; of more the oldest is dropped."""


class ImageInfo(msgspec.Struct, kw_only=True, gc=False):
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


class CameraInfo(msgspec.Struct, kw_only=True, gc=False):
    """A camera in short."""

    name: str
    """For ``step.cameras``; a hand's is called ``hand_…`` in a task that has one of the same name."""
    width: int
    """Pixels in a row."""
    height: int
    """Rows."""
    fov_deg: float
    """Horizontal field of view, degrees."""
    near: float
    """What is nearer gives no reading, m."""
    far: float
    """What is farther gives no reading, m."""
    images: list[ImageInfo] = []
    """The images that it takes."""


class TaskInfo(msgspec.Struct, kw_only=True, gc=False):
    """A task in short."""

    name: str
    """For ``reset``."""
    description: str
    """For people."""
    tick_s: float
    """Length of a tick, s."""
    step_s: float
    """Length of a physics step, s."""
    time_limit_s: float
    """Longest run, s of simulated time."""
    cameras: list[CameraInfo] = []
    """Its cameras."""
    hash: str = ""
    """SHA-256 of everything that it is, 64 hexadecimal digits."""


class ColumnInfo(msgspec.Struct, kw_only=True, gc=False):
    """Numbers of a channel that have a unit and a range in common."""

    width: int
    """How many numbers."""
    unit: str
    """Unit; empty for a pure number."""
    minimum: float | None = None
    """Least value; ``None`` for none."""
    maximum: float | None = None
    """Largest value; ``None`` for none."""
    name: str = ""
    """Absent where the channel's numbers have no names."""


class ChannelInfo(msgspec.Struct, kw_only=True, gc=False):
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
    truth: bool
    """It is only in observations with sensing ``truth``."""
    description: str
    """For people."""


class HandInfo(msgspec.Struct, kw_only=True, gc=False):
    """A hand in short; ``GET /v1/hands/{name}`` has the rest."""

    name: str
    """For ``reset``."""
    description: str
    """For people."""
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


class FieldSpec(msgspec.Struct, kw_only=True, gc=False):
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


class Specs(msgspec.Struct, kw_only=True, gc=False):
    """Every numeric field a controller writes or reads."""

    action: Sequence[FieldSpec]
    """Fields of ``step.action``."""
    observation: Sequence[FieldSpec]
    """Fields of ``obs``."""


class Welcome(Reply, kw_only=True, gc=False, tag="welcome"):
    """``welcome``: what this server offers."""

    session_id: str
    """Identifies the session."""
    resume_token: str
    """Secret that takes the session up again on a new connection."""
    team: str
    """Name of the team on the leaderboard."""
    session_left_s: float | None = None
    """s; ``None`` for a session without a limit."""
    competition: Competition
    """The competition."""
    server: ServerInfo
    """The program."""
    limits: Limits
    """What a client must keep to."""
    tasks: list[TaskInfo]
    """Tasks that can be played."""
    hands: list[HandInfo]
    """Hands that can be played with."""
    specs: Specs
    """Fields of actions and observations."""
    run: RunInfo | None = None
    """The run that goes on, when a session is taken up again; else ``None``."""
    note: str | None = None
    """For people: what is odd about the team's name. Absent when nothing is."""


class TaskBest(msgspec.Struct, kw_only=True, gc=False):
    """A team's best run of a task."""

    score: float
    """Points."""
    run_id: str
    """The earliest run with this score."""
    status: str
    """``practice``, ``provisional`` or ``verified``."""
    ended_unix_ms: int
    """End of the run, ms since 1970 UTC."""


class LeaderboardRow(msgspec.Struct, kw_only=True, gc=False):
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
