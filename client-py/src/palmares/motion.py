"""Helpers for controllers: rotations, motions of the base, room for the hand, runs from the command line.

All of it is meant to be imported; the examples share nothing else. Units are SI and arrays are float64 by
the rule in the docstring of `palmares`; shapes are stated at every function.

>>> mover = Mover(client, client.reset("balls", "softhand"))      # doctest: +SKIP
... mover.to(1.0, position, quat_xyzw, sigma=0.1)
... mover.wait(0.5)
"""

from __future__ import annotations

import argparse
import json
import logging
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Self

import numpy as np

from palmares.arrays import Array, array
from palmares.client import Client
from palmares.errors import PalmaresError
from palmares.messages import Observation, Result, Specs
from palmares.rotation import angle_between, matrix_of, quat_of, rot_y, rot_z, rot_zyz, slerp
from palmares.scene import Scene, Shape
from palmares.targets import pose
from palmares.truth import Truth

__all__ = [
    "SOFTHAND_PRESHAPED",
    "UP",
    "Array",
    "Attempt",
    "BaseLimits",
    "Capsules",
    "Mover",
    "ObjectBounds",
    "RunOverError",
    "Summary",
    "TopGrasp",
    "angle_between",
    "array",
    "attempts_here",
    "duration",
    "half_extents",
    "largest_radius",
    "matrix_of",
    "object_bounds",
    "play",
    "quat_of",
    "rot_y",
    "rot_z",
    "rot_zyz",
    "slerp",
    "smoothstep",
    "truth_of",
    "upright_box",
]

UP = array([0.0, 0.0, 1.0])
"""Unit vector upwards, (3,), world frame"""

# --- motions of the base ---

SHARE_OF_LIMITS = 0.95
"""`duration` uses this share of the base's limits, so that the servo has some left to correct errors."""


@dataclass(frozen=True)
class BaseLimits:
    """Limits of the servo of the hand's base. It follows a target that keeps to them without lag.

    The speeds are in `Welcome.specs`. No message carries the accelerations: they are those that
    docs/protocol.md states for `step`, and written down nowhere else in this package.
    """

    speed_m_s: float
    angular_speed_rad_s: float
    acceleration_m_s2: float = 4.0
    angular_acceleration_rad_s2: float = 4.0

    @classmethod
    def of(cls, specs: Specs) -> Self:
        """Return the limits with the speeds that the server sent."""
        _, speed_m_s = specs.action_field("base.linear").range
        _, angular_speed_rad_s = specs.action_field("base.angular").range
        return cls(speed_m_s, angular_speed_rad_s)


def smoothstep(x: float) -> float:
    """Return the quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def duration(distance_m: float, angle_rad: float, limits: BaseLimits, at_least_s: float = 0.0) -> float:
    """Return the shortest time, s, in which a smoothstep over a distance and an angle keeps to `limits`.

    The quintic's greatest velocity is 15/8 of distance per time, its greatest acceleration 10/√3 of distance
    per time squared.
    """
    velocity, acceleration = 15 / 8 / SHARE_OF_LIMITS, 10 / math.sqrt(3) / SHARE_OF_LIMITS
    return max(
        at_least_s,
        velocity * distance_m / limits.speed_m_s,
        velocity * angle_rad / limits.angular_speed_rad_s,
        math.sqrt(acceleration * distance_m / limits.acceleration_m_s2),
        math.sqrt(acceleration * angle_rad / limits.angular_acceleration_rad_s2),
    )


class RunOverError(Exception):
    """The server ended the run: the task is complete, or a limit was reached."""


class Mover:
    """Moves base and fingers of a lockstep run along smoothsteps, with a new target at every tick.

    Attributes:
        obs: The last observation.
        position: The base's last target, (3,), m, world frame.
        quat_xyzw: Its orientation, (4,).
        sigma: The last command of the motors, 0 (open) to 1 (closed).

    Args:
        client: With a lockstep run open.
        first: The observation that `Client.reset` returned.

    """

    def __init__(self, client: Client, first: Observation) -> None:
        self.client = client
        self.obs = first
        self.position = first.hand.base.xyz
        self.quat_xyzw = array(first.hand.base.quat_xyzw)
        self.sigma = first.hand.actuators[0].position
        self._limits = BaseLimits.of(client.welcome.specs)
        self._tick_s = client.run.tick_s
        self._started_s = time.monotonic()

    def to(
        self,
        at_least_s: float,
        position: Array | None = None,
        quat_xyzw: Array | None = None,
        sigma: float | None = None,
    ) -> None:
        """Move base and fingers together, in `at_least_s` or as fast as the base may; what is left out stays.

        Raises:
            RunOverError: The run ended on the way.

        """
        p0, q0, s0 = self.position, self.quat_xyzw, self.sigma
        p1 = p0 if position is None else position
        q1 = q0 if quat_xyzw is None else quat_xyzw
        s1 = s0 if sigma is None else sigma
        distance_m = float(np.linalg.norm(p1 - p0))
        total_s = duration(distance_m, angle_between(q0, q1), self._limits, at_least_s)
        ticks = max(1, math.ceil(total_s / self._tick_s))
        for tick in range(ticks):
            x = smoothstep((tick + 1) / ticks)
            self.position, self.quat_xyzw = p0 + x * (p1 - p0), slerp(q0, q1, x)
            self.sigma = s0 + x * (s1 - s0)
            self._step()

    def wait(self, duration_s: float) -> None:
        """Hold still for a while."""
        for _ in range(round(duration_s / self._tick_s)):
            self._step()

    def wrist_force(self, duration_s: float) -> Array:
        """Hold still for a while; return the mean force at the wrist, (3,), N."""
        forces = []
        for _ in range(round(duration_s / self._tick_s)):
            self._step()
            forces.append(self.obs.hand.wrist.force)
        return array(np.mean(forces, axis=0))

    def command(self) -> list[float]:
        """Return σ of every motor; a hand with several motors overrides this."""
        return [self.sigma]

    def stop(self) -> tuple[Result, Summary]:
        """Stop the run; return its result and a summary."""
        wall_s = time.monotonic() - self._started_s
        result = self.client.stop()
        summary = Summary(
            run_id=result.run_id,
            seed=self.client.run.seed,
            score=result.score,
            sim_time_s=result.sim_time_s,
            rtf=result.sim_time_s / wall_s,
        )
        return result, summary

    def _step(self) -> None:
        self.obs = self.client.step(base=pose(self.position, self.quat_xyzw), hand=self.command())
        if self.obs.done:
            raise RunOverError(self.obs.reason)


# --- where objects are ---


def truth_of(obs: Observation) -> Truth:
    """Return the full state; `ValueError` in a run with ``sensing="sensors"``."""
    if obs.truth is None:
        raise ValueError('where objects are is known with sensing="truth" only')
    return obs.truth


def largest_radius(scene: Scene) -> float:
    """Return the largest radius among the shapes of the free bodies, m; 0 if no shape has one."""
    return max((part.shape.radius or 0.0 for body in scene.free for part in body.parts), default=0.0)


@dataclass(frozen=True)
class ObjectBounds:
    """A free object: its bounding box along the world's axes and its centre of mass, each (3,), m."""

    index: int
    """Row in `Truth.positions`."""
    name: str
    low: Array
    high: Array
    com: Array

    @property
    def size(self) -> Array:
        """Sides of the bounding box, (3,), m."""
        return array(self.high - self.low)

    @property
    def middle(self) -> Array:
        """Middle of the bounding box, (3,), m."""
        return array((self.low + self.high) / 2)


def half_extents(shape: Shape, rotation: Array) -> Array:
    """Return half the extents (3,), m, along the world's axes of a shape turned by `rotation` (3, 3).

    For spheres, capsules, cylinders and boxes; hulls, which have no extents of their own, count as points.
    """
    if shape.type == "box" and shape.half_extents is not None:
        return array(np.abs(rotation) @ array(shape.half_extents))
    axis = np.abs(rotation[:, 2]) * (shape.half_length or 0.0)
    rim = np.sqrt(np.clip(1.0 - rotation[:, 2] ** 2, 0.0, 1.0)) if shape.type == "cylinder" else 1.0
    return array(axis + (shape.radius or 0.0) * rim)


def object_bounds(scene: Scene, obs: Observation, yaw_rad: float = 0.0) -> list[ObjectBounds]:
    """Return where every free object is now, in the order of `Truth.objects`.

    `yaw_rad` turns the axes about the vertical: boxes and centres are then given along the turned ones.
    """
    found = []
    turned = rot_z(-yaw_rad)
    for body, state in zip(scene.free, truth_of(obs).objects, strict=True):
        rotation, origin = turned @ state.rotation, turned @ state.xyz
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for part in body.parts:
            middle = origin + rotation @ part.xyz
            half = half_extents(part.shape, rotation @ part.rotation)
            low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
        found.append(ObjectBounds(state.id, state.name, low, high, origin + rotation @ array(body.com)))
    return found


def upright_box(scene: Scene, obs: Observation, index: int) -> tuple[ObjectBounds, float]:
    """Return the smallest upright box around object `index`, and the direction of its longer side, rad.

    The box is turned about its middle until that side lies along x, as `TopGrasp.base_position` takes it. The
    direction is the one nearest to x where several do, as for a round object.
    """
    best: tuple[float, float, ObjectBounds] | None = None
    for degrees in sorted(range(-87, 91, 3), key=abs):
        yaw_rad = math.radians(degrees)
        box = object_bounds(scene, obs, yaw_rad)[index]
        x, y, _ = box.high - box.low
        # A little less area, as rounding makes it, should not turn the hand.
        if y < 1.01 * x and (best is None or x * y < 0.99 * best[0]):
            best = float(x * y), yaw_rad, box
    assert best is not None
    _, yaw_rad, box = best
    half, middle = (box.high - box.low) / 2, rot_z(yaw_rad) @ box.middle
    return ObjectBounds(index, box.name, middle - half, middle + half, rot_z(yaw_rad) @ box.com), yaw_rad


# --- room for the hand, and grasps ---


@dataclass(frozen=True)
class Capsules:
    """A body as `n` capsules: the points within `radius` of the segments from `start` to `end`, m."""

    start: Array
    """(n, 3)"""
    end: Array
    """(n, 3)"""
    radius: Array
    """(n,)"""

    def at(self, rotation: Array, position: Array) -> Capsules:
        """Return the capsules of the body placed with `rotation` (3, 3) at `position` (3,), m."""
        return Capsules(self.start @ rotation.T + position, self.end @ rotation.T + position, self.radius)

    def distances(self, points: Array) -> Array:
        """Return how far every point (m, 3) is from the surface of every capsule, (n, m), m; inside, < 0."""
        axis = self.end - self.start
        offset = points[None, :, :] - self.start[:, None, :]
        along = np.einsum("kij,kj->ki", offset, axis) / np.sum(axis**2, axis=1)[:, None]
        nearest = self.start[:, None, :] + np.clip(along, 0.0, 1.0)[:, :, None] * axis[:, None, :]
        return array(np.linalg.norm(points[None, :, :] - nearest, axis=2) - self.radius[:, None])

    def bounds(self) -> tuple[Array, Array]:
        """Return the least and the largest coordinates of every capsule, each (n, 3), m."""
        radius = self.radius[:, None]
        return np.minimum(self.start, self.end) - radius, np.maximum(self.start, self.end) + radius

    def spheres(self, count: int) -> tuple[Array, Array]:
        """Return `count` spheres along every capsule: centres (count·n, 3) and radii (count·n,), m."""
        share = np.linspace(0.0, 1.0, count)[:, None, None]
        centres = self.start[None] * (1 - share) + self.end[None] * share
        return centres.reshape(-1, 3), np.tile(self.radius, count)


def _capsules(*rows: tuple[tuple[float, ...], tuple[float, ...], float]) -> Capsules:
    start, end, radius = zip(*rows, strict=True)
    return Capsules(array(start), array(end), array(radius))


SOFTHAND_PRESHAPED = _capsules(
    ((0.000, 0.000, 0.045), (0.000, 0.000, 0.080), 0.042),  # wrist
    ((-0.006, 0.027, 0.100), (-0.006, 0.027, 0.170), 0.019),  # palm, thumb side
    ((-0.006, 0.005, 0.100), (-0.006, 0.005, 0.185), 0.019),  # palm, middle
    ((-0.006, -0.020, 0.100), (-0.006, -0.022, 0.170), 0.019),  # palm, little finger's side
    ((0.008, 0.037, 0.146), (0.014, 0.069, 0.160), 0.011),  # thumb
    ((0.014, 0.069, 0.160), (0.021, 0.102, 0.181), 0.009),
    ((-0.001, 0.026, 0.184), (0.006, 0.031, 0.227), 0.009),  # index
    ((0.006, 0.031, 0.227), (0.022, 0.034, 0.263), 0.009),
    ((-0.001, 0.007, 0.191), (0.006, 0.007, 0.234), 0.009),  # middle
    ((0.006, 0.007, 0.234), (0.022, 0.007, 0.270), 0.009),
    ((-0.001, -0.013, 0.184), (0.006, -0.015, 0.227), 0.009),  # ring
    ((0.006, -0.015, 0.227), (0.022, -0.018, 0.263), 0.009),
    ((-0.001, -0.032, 0.174), (0.006, -0.037, 0.217), 0.009),  # little
    ((0.006, -0.037, 0.217), (0.022, -0.041, 0.253), 0.009),
)
"""The SoftHand on its way to an object, fingers slightly curled (σ ≈ 0.1), in the hand frame"""


@dataclass(frozen=True)
class TopGrasp:
    """How the SoftHand takes an object from above. Hand frame: fingers +z, palm normal +x, thumb +y."""

    name: str
    pitch_rad: float
    """π/2 holds the fingers level, more points them down"""
    roll_rad: float
    """Turns the palm about the fingers' axis"""
    above_m: float
    """Height of the hand's origin over the object's top, along the palm normal"""
    aside_m: float
    """The object's middle in the hand frame along y"""
    along_m: float
    """The object's middle in the hand frame along the fingers"""
    sigma_open: float
    """Motor command on the way to the object"""
    sigma_closed: float
    """Motor command of the grasp"""
    sink_m: float
    """The hand approaches this much farther from the object and then sinks onto it"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3): fingers along +y, turned by `yaw_rad` about the vertical."""
        return rot_zyz(math.pi / 2 + yaw_rad, self.pitch_rad, self.roll_rad)

    def base_position(self, target: ObjectBounds, rotation: Array) -> Array:
        """Return where the hand's base is when the fingers close on `target`, (3,), m."""
        height_m = float(target.high[2] - target.low[2])
        in_hand = array([height_m / 2 + self.above_m, self.aside_m, self.along_m])
        return array(target.middle - rotation @ in_hand)


@dataclass(frozen=True)
class Attempt:
    """A grasp that was tried."""

    index: int
    """Which object, as a row in `Truth.positions`"""
    position: Array
    """Where the object was, (3,), m"""
    yaw_rad: float
    grasp: str = ""
    """Name of the grasp, for a controller that has several"""


def attempts_here(attempts: Sequence[Attempt], index: int, position: Array, moved_m: float) -> list[Attempt]:
    """Return the attempts on object `index` when it was within `moved_m` of its present `position` (3,)."""
    same = [attempt for attempt in attempts if attempt.index == index]
    return [attempt for attempt in same if np.linalg.norm(attempt.position - position) < moved_m]


# --- runs from the command line ---


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The outcome of a run. Controllers add fields of their own; `play` prints them all."""

    run_id: str
    seed: int | None
    score: float
    sim_time_s: float
    rtf: float
    """Real-time factor: simulated time per wall time"""

    def __str__(self) -> str:
        common = {field.name for field in fields(Summary)}
        own = {name: value for name, value in vars(self).items() if name not in common}
        listed = {k: ", ".join(map(str, v)) or "none" if isinstance(v, list) else v for k, v in own.items()}
        extra = "".join(f"; {name.replace('_', ' ')}: {value}" for name, value in listed.items())
        return (
            f"run {self.run_id}: score {self.score:.4g}{extra}; "
            f"{self.sim_time_s:.1f} s simulated, {self.rtf:.1f} x real time"
        )


def play(run: Callable[[Client, int | None], Summary], doc: str | None) -> None:
    """Play runs as the command line says and print their summaries: the main program of a controller.

    Args:
        run: Plays one run of the scene with this seed; ``None`` lets the server draw one.
        doc: Docstring of the controller; its first line is shown by ``--help``.

    """
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    parser.add_argument("--seed", type=int, help="scene of the first run; the next runs count up")
    parser.add_argument("--runs", type=int, default=1, help="how many runs")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    parser.add_argument("--json", action="store_true", help="one JSON object per run on standard output")
    args = parser.parse_args()
    logging.basicConfig(level=logging.WARNING if args.quiet else logging.INFO, format="%(message)s")
    scores = []
    try:
        with Client(args.url, team=args.team) as client:
            for k in range(args.runs):
                summary = run(client, None if args.seed is None else args.seed + k)
                scores.append(summary.score)
                print(json.dumps(asdict(summary)) if args.json else summary, flush=True)
    except PalmaresError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("interrupted")
    if args.runs > 1 and not args.json:
        print(f"{len(scores)} runs: score {sum(scores) / len(scores):.4g} on average")
