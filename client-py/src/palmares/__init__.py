"""Control a simulated compliant hand, on a Palmares server or in this process.

>>> with palmares.Client("local") as client:      # doctest: +SKIP
...     obs = client.reset("balls", "softhand", seed=1)
...     obs = client.step(hand=[1.0], repeat=100)
...     print(client.stop().score)

With the address of a server, such as ``http://127.0.0.1:8080``, the same lines play there.

Units are SI. A scalar's name ends in its unit (``tick_s``, ``distance_m``, ``yaw_rad``, ``speed_m_s``). Names
of the protocol have these units: ``position`` m, ``linear`` m/s, ``angular`` rad/s, ``force`` N, ``torque``
N·m, ``mass`` kg, lengths of a `Shape` m. Vectors are in the world frame unless stated otherwise; quaternions
are x, y, z, w.

Fields of messages are tuples, as they come over the wire. Arrays are NumPy arrays of float64; every function
and property states the shapes it takes and returns. `array` makes an array of any numbers; ``xyz`` and
``rotation`` of every pose are arrays.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from palmares.arrays import Array, array
from palmares.cameras import CameraImage, Intrinsics
from palmares.client import Client
from palmares.clipping import ClippedActionWarning, HeldHandWarning
from palmares.errors import (
    BadActionError,
    BadJsonError,
    BadRequestError,
    CapacityError,
    ConnectionLostError,
    ForbiddenError,
    HandInTheWayError,
    InternalError,
    InUseError,
    NoServerError,
    NotAuthorizedError,
    NotFoundError,
    NotScheduledError,
    PalmaresError,
    ProtocolError,
    RateLimitedError,
    RunLostError,
    SessionOverError,
    SessionTakenError,
    StaleTickError,
    TooLargeError,
    UnknownCameraError,
    UnknownHandError,
    UnknownOpError,
    UnknownTaskError,
    WorldFaultError,
    WrongStateError,
)
from palmares.messages import FieldSpec, HandState, Observation, Result, Specs, Welcome
from palmares.net.codec import Encoding
from palmares.no_truth import NoTruthError
from palmares.scene import Region, Scene, SceneBody, ScenePart
from palmares.targets import joints, pose, twist
from palmares.training import Training
from palmares.truth import BodyState, Contact, ObjectState, Truth
from palmares.version import VERSION as __version__
from palmares.wire import (
    Action,
    Actuator,
    BaseTarget,
    CameraInfo,
    Competition,
    Event,
    HandInfo,
    Joints,
    LeaderboardRow,
    Limits,
    Opened,
    Replay,
    RunInfo,
    ServerInfo,
    Shape,
    TaskBest,
    TaskInfo,
    Time,
    Wrench,
)

__all__ = [
    "Action",
    "Actuator",
    "Array",
    "BadActionError",
    "BadJsonError",
    "BadRequestError",
    "BaseTarget",
    "BodyState",
    "CameraImage",
    "CameraInfo",
    "CapacityError",
    "Client",
    "ClippedActionWarning",
    "Competition",
    "ConnectionLostError",
    "Contact",
    "Encoding",
    "Event",
    "FieldSpec",
    "ForbiddenError",
    "HandInTheWayError",
    "HandInfo",
    "HandState",
    "HeldHandWarning",
    "InUseError",
    "InternalError",
    "Intrinsics",
    "Joints",
    "LeaderboardRow",
    "Limits",
    "NoServerError",
    "NoTruthError",
    "NotAuthorizedError",
    "NotFoundError",
    "NotScheduledError",
    "ObjectState",
    "Observation",
    "Opened",
    "PalmaresError",
    "ProtocolError",
    "RateLimitedError",
    "Region",
    "Replay",
    "Result",
    "RunInfo",
    "RunLostError",
    "Scene",
    "SceneBody",
    "ScenePart",
    "ServerInfo",
    "SessionOverError",
    "SessionTakenError",
    "Shape",
    "Specs",
    "StaleTickError",
    "TaskBest",
    "TaskInfo",
    "Time",
    "TooLargeError",
    "Training",
    "Truth",
    "UnknownCameraError",
    "UnknownHandError",
    "UnknownOpError",
    "UnknownTaskError",
    "Welcome",
    "WorldFaultError",
    "Wrench",
    "WrongStateError",
    "__version__",
    "array",
    "joints",
    "pose",
    "twist",
]

if TYPE_CHECKING:
    from palmares import analysis, evaluate, gym, rotation, server, sim, skills  # noqa: F401

_MODULES = ("analysis", "evaluate", "gym", "motion", "rotation", "server", "sim", "skills")


def __getattr__(name: str) -> Any:
    """Import a module of the package at its first use, so that ``import palmares`` is enough."""
    if name in _MODULES:
        return import_module(f"palmares.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
