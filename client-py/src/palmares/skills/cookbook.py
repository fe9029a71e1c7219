"""Cookbook: how each built-in hand grasps a ball, a cylinder, a box, a plate, a knob, a handle and a peg.

>>> grip = COOKBOOK["softhand"]["ball"]
>>> grip.opened, grip.closed, grip.close_s
((0.0,), (1.0,), 1.2)

docs/cookbook.md shows the same numbers with pictures. With a run open, these lines lift the can of the task:

    mover = GripMover(client, client.reset("grasp", "softhand", seed=1))
    target, yaw_rad = target_of(client.scene, mover.obs, "cylinder")
    pick(mover, COOKBOOK["softhand"]["cylinder"], target, yaw_rad)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palmares.arrays import Array, array
from palmares.messages import Observation
from palmares.reproducible import atan2, matmul, norm
from palmares.rotation import matrix_of, quat_of, rot_z
from palmares.scene import Region, Scene, SceneBody, ScenePart, named
from palmares.skills.grasps import Capsules, SideGrasp, TopGrasp
from palmares.skills.motion import UP, Mover
from palmares.skills.objects import ObjectBounds, object_bounds, truth_of, upright_box
from palmares.skills.recipes import RECIPES, Recipe

__all__ = [
    "BALL",
    "COOKBOOK",
    "KINDS",
    "KNOB",
    "NARROW",
    "SIDE",
    "STANDING",
    "Grip",
    "GripMover",
    "kind_of",
    "most_room",
    "pick",
    "room",
    "target_of",
]

KINDS = ("ball", "ball_in_box", "cylinder", "bottle", "box", "plate", "knob", "handle", "peg")
"""Kinds of objects and of parts to grasp"""
RIM_M = 0.03
"""Depth of the piece of a plate's rim that is grasped"""
BALL_M, TALL_M, SQUARE = 0.085, 0.15, 1.2
"""Diameter from which a ball needs the grip of a ball; height and ratio of the sides of a bottle"""
YAWS_RAD = tuple(2.0 * math.pi * k / 12 for k in range(12))
"""Directions that `most_room` tries"""
HAND_RADIUS_M, WALL_M, BEYOND_M = 0.045, 0.085, 0.05
"""The hand in `room`: radius among balls, radius at walls, reach of the fingers beyond the object's middle"""


@dataclass(frozen=True)
class Grip:
    """A grasp of a kind of objects, with its times."""

    grasp: Recipe | TopGrasp | SideGrasp
    """Place of the hand, and σ of the motors"""
    turn_rad: float = 0.0
    """Turn of the hand about the vertical, against the longer side of the object"""
    close_s: float = 1.2
    """Duration of the closing"""
    lift_s: float = 1.2
    """Duration of the lift"""
    lift_m: float = 0.15
    """Height of the lift"""
    rise_m: float = 0.12
    """A recipe's hand comes down from this height over the grasp; other grasps have their own ways in"""

    @property
    def opened(self) -> tuple[float, ...]:
        """σ of every motor on the way to the object."""
        return self.grasp.opened if isinstance(self.grasp, Recipe) else (self.grasp.sigma_open,)

    @property
    def closed(self) -> tuple[float, ...]:
        """σ of every motor in the grasp."""
        return self.grasp.closed if isinstance(self.grasp, Recipe) else (self.grasp.sigma_closed,)

    def motors(self, closed: float) -> list[float]:
        """Return σ of every motor, from the opened hand (0) to the closed one (1)."""
        return [a + closed * (b - a) for a, b in zip(self.opened, self.closed, strict=True)]

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3) for an object whose longer side is at `yaw_rad` from x."""
        return self.grasp.rotation(yaw_rad + self.turn_rad)

    def base_position(self, target: ObjectBounds, rotation: Array) -> Array:
        """Return the position of the base when the fingers close on `target`, (3,), m."""
        return self.grasp.base_position(target, rotation)

    def in_hand(self, target: ObjectBounds) -> Array:
        """Return the middle of `target` in the hand frame when the fingers close, (3,), m."""
        rotation = self.rotation(0.0)
        return matmul(rotation.T, target.middle - self.base_position(target, rotation))

    def way_in(self, at: Array, rotation: Array) -> list[Array]:
        """Return the positions (3,), m, of the base on its way to the grasp at `at` (3,)."""
        if isinstance(self.grasp, Recipe):
            return [array(at + self.rise_m * UP)]
        return self.grasp.way_in(at, rotation)


class GripMover(Mover):
    """A mover whose σ closes the hand of a grip, from 0 (opened) to 1 (closed).

    Without a grip, σ is the command of every motor.
    """

    grip: Grip | None = None

    def command(self) -> list[float]:
        """Return σ of every motor."""
        if self.grip is None:
            return [self.sigma] * len(self.obs.hand.actuators)
        return self.grip.motors(self.sigma)


def pick(mover: GripMover, grip: Grip, target: ObjectBounds, yaw_rad: float) -> None:
    """Come down on `target`, close the hand and lift.

    Raises:
        RunOverError: The run ended during the motion.

    """
    mover.grip, mover.sigma = grip, 0.0
    rotation = grip.rotation(yaw_rad)
    at = grip.base_position(target, rotation)
    way = grip.way_in(at, rotation)
    mover.to(1.0, array([*way[0][:2], max(way[0][2], mover.position[2])]), quat_of(rotation))
    for position in [*way, at]:
        mover.to(0.6, position)
    mover.to(grip.close_s, sigma=1.0)
    mover.wait(0.3)
    mover.to(grip.lift_s, at + grip.lift_m * UP)


def room(grip: Grip, target: ObjectBounds, yaw_rad: float, others: Array, box: Region) -> float:
    """Return the distance of the hand from the walls of `box` and from other balls, m; < 0: an overlap.

    The hand counts as a capsule from its base through the object; `others` (n, 3) are the centres of balls as
    large as `target`. Choose the object and the direction with the most room.
    """
    at = grip.base_position(target, grip.rotation(yaw_rad))
    along = target.middle - at
    tip = target.middle + BEYOND_M / norm(along) * along
    hand = Capsules(at[None], tip[None], array([HAND_RADIUS_M]))
    balls = hand.distances(others) - 0.5 * target.size[2]
    points, _ = hand.spheres(10)
    low = points[points[:, 2] < box.max[2], :2]
    walls = np.minimum(low - box.min[:2], box.max[:2] - low) - WALL_M
    return min(float(balls.min(initial=math.inf)), float(walls.min(initial=math.inf)))


def most_room(scene: Scene, obs: Observation, grip: Grip, box: Region) -> tuple[ObjectBounds, float] | None:
    """Return the ball in `box` and the direction with the most `room`; ``None`` if there is no ball in it."""
    balls = truth_of(obs).positions
    best, best_m = None, -math.inf
    for ball in object_bounds(scene, obs):
        if box.contains(ball.middle):
            others = np.delete(balls, ball.index, axis=0)
            for yaw_rad in YAWS_RAD:
                room_m = room(grip, ball, yaw_rad, others, box)
                if room_m > best_m:
                    best, best_m = (ball, yaw_rad), room_m
    return best


def kind_of(body: SceneBody) -> str:
    """Return the kind whose grip suits a whole object: ``ball``, ``bottle``, ``cylinder`` or ``box``.

    A ball that is as small as the brick of ``box`` is grasped as it is.
    """
    shapes = {part.shape.type for part in body.parts}
    x, y, z = 2.0 * body.half_extents
    if shapes == {"sphere"}:
        return "ball" if x > BALL_M else "box"
    if z > TALL_M and max(x, y) > SQUARE * min(x, y):
        return "bottle"
    return "box" if shapes == {"box"} else "cylinder"


def target_of(
    scene: Scene, obs: Observation, kind: str, name: str | None = None
) -> tuple[ObjectBounds, float]:
    """Return the box around what is grasped, and the direction of its longer side, rad.

    Args:
        scene: The scene.
        obs: An observation with the truth.
        kind: One of `KINDS`. ``knob`` is a sphere of an object, ``handle`` a capsule of it, ``plate`` a
            piece of its rim.
        name: Name of the object; left out, ``lid`` for a knob, ``pan`` for a handle, else the scene's first.

    Raises:
        ValueError: There is no such kind.
        KeyError: There is no such object, or it has no such part.

    """
    if kind not in KINDS:
        raise ValueError(f"kind: found {kind!r}; wanted one of {', '.join(KINDS)}")
    name = name or {"knob": "lid", "handle": "pan"}.get(kind) or scene.free[0].name
    body = named("object", name, scene.free)
    index = scene.free.index(body)
    if kind in ("knob", "handle"):
        return _part(body, index, obs, "sphere" if kind == "knob" else "capsule")
    box, yaw_rad = upright_box(scene, obs, index)
    if kind != "plate":
        return box, yaw_rad
    outward = rot_z(yaw_rad)[:, 1]
    middle = box.middle + (0.5 * box.size[1] - 0.5 * RIM_M) * outward
    half = 0.5 * array([2.0 * RIM_M, RIM_M, box.size[2]])
    return replace(box, low=middle - half, high=middle + half), yaw_rad


def _part(body: SceneBody, index: int, obs: Observation, shape: str) -> tuple[ObjectBounds, float]:
    parts = [part for part in body.parts if part.shape.type == shape]
    if not parts:
        raise KeyError(f"object {body.name!r} has no {shape}")
    part: ScenePart = parts[0]
    state = truth_of(obs).objects[index]
    middle = state.xyz + matmul(state.rotation, part.xyz)
    axis = matmul(state.rotation, matrix_of(part.quat_xyzw)[:, 2])
    radius, length = part.shape.radius or 0.0, part.shape.half_length or 0.0
    half = array([length + radius, radius, radius])
    yaw_rad = 0.0 if length == 0.0 else atan2(axis[1], axis[0])
    return ObjectBounds(index, body.name, middle - half, middle + half, middle), yaw_rad


# The SoftHand: name, pitch, roll, above, aside, along, σ open, σ closed, sink; units as in `TopGrasp`.
KNOB = TopGrasp("knob", 1.5, 0.0, 0.022, -0.004, 0.185, 0.1, 1.0, 0.10)
NARROW = TopGrasp("narrow", 1.6657, 0.3491, 0.0068, 0.0243, 0.1964, 0.0212, 0.9, 0.12)
STANDING = TopGrasp("standing", 1.81, 0.09, 0.006, 0.004, 0.222, 0.01, 1.0, 0.12)
BALL = TopGrasp("ball", 1.722, 0.092, -0.0285, 0.046, 0.2185, 0.0, 1.0, 0.12)
STEEP = TopGrasp("steep", 1.9781, -0.5383, -0.0227, 0.0459, 0.1884, 0.1227, 1.0, 0.32)
RIM = TopGrasp("rim", 1.0992, -0.129, -0.0214, 0.0174, 0.113, 0.0714, 1.0, 0.12)
HANDLE = TopGrasp("handle", 1.5107, 0.0678, 0.0207, -0.0202, 0.1819, 0.1232, 1.0, 0.15)
SIDE = SideGrasp("side", 0.112, 0.018, 0.0022, 0.1815, 0.0945, 1.0, 0.1, 0.15)
PEG = SideGrasp("peg", 0.0, 0.015, 0.055, 0.172, 0.18, 0.88, 0.12, 0.15)

_SOFTHAND = {
    "ball": Grip(BALL, -0.04),
    "ball_in_box": Grip(STEEP, -1.65, 1.0, 3.0, 0.36),
    "cylinder": Grip(STANDING, -0.1),
    "bottle": Grip(SIDE, -0.12),
    "box": Grip(NARROW),
    "plate": Grip(RIM, -1.65),
    "knob": Grip(KNOB, close_s=1.4, lift_s=1.4),
    "handle": Grip(HANDLE, 3.2344, 1.4, 4.0, 0.27),
    "peg": Grip(PEG, -math.pi / 2),
}


MOVED: dict[tuple[str, str], tuple[float, float, float, float, float]] = {
    ("allegro", "bottle"): (3.1559, -0.0763, -0.0105, 0.0083, -0.0063),
    ("allegro", "handle"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("allegro", "knob"): (-0.0897, 0.0102, -0.0329, -0.0121, -0.0283),
    ("allegro", "peg"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("allegro", "plate"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("barrett_bh282", "ball_in_box"): (1.5043, -0.067, 0.0088, 0.0039, 0.0011),
    ("barrett_bh282", "knob"): (1.1176, -0.1065, -0.0267, 0.0084, 0.0038),
    ("ihy", "handle"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("leap", "cylinder"): (1.1467, -0.1279, -0.0382, 0.0049, -0.004),
    ("leap", "handle"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("leap", "knob"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("leap", "peg"): (-0.3868, -0.0395, -0.0355, 0.0046, 0.0026),
    ("leap", "plate"): (1.5335, -0.0884, -0.0028, 0.0003, -0.0066),
    ("pinch", "bottle"): (-1.6496, -0.0121, 0.002, 0.0007, -0.0132),
    ("rbo2", "handle"): (0.0291, -0.0214, -0.0116, -0.0035, -0.0077),
    ("rbo2", "plate"): (-0.005, 0.096, -0.0309, -0.0063, -0.0262),
    ("robotiq_3f", "knob"): (0.0291, -0.0214, -0.0116, -0.0035, -0.0077),
    ("robotiq_3f", "peg"): (-0.1452, -0.0791, 0.0108, 0.0045, -0.0121),
    ("shadow", "ball_in_box"): (-0.1787, -0.0858, 0.0116, -0.0215, -0.005),
    ("shadow", "handle"): (0.0291, -0.0214, -0.0116, -0.0035, -0.0077),
    ("shadow", "peg"): (-0.3576, -0.0609, -0.0471, 0.001, -0.0051),
    ("softhand2", "ball"): (1.5335, -0.0884, -0.0028, 0.0003, -0.0066),
    ("softhand2", "ball_in_box"): (1.1467, -0.1279, -0.0382, 0.0049, -0.004),
    ("softhand2", "bottle"): (1.5043, -0.067, 0.0088, 0.0039, 0.0011),
    ("softhand2", "handle"): (-2.0072, -0.0729, -0.0451, 0.0017, -0.0183),
    ("softhand2", "plate"): (0.0637, -0.0387, -0.0003, 0.0042, -0.0028),
    ("yale_model_o", "handle"): (0.0291, -0.0214, -0.0116, -0.0035, -0.0077),
    ("yale_t42", "handle"): (0.0291, -0.0214, -0.0116, -0.0035, -0.0077),
}
"""Grips that differ from the hand's recipe: turn, and the arguments of `Recipe.moved`"""

WITHOUT = {("pinch", "knob"), ("pinch", "handle"), ("barrett_bh282", "handle"), ("barrett_bh282", "plate")}
"""Kinds for which no grip of a hand was found"""


def _grip(hand: str, kind: str) -> Grip:
    turn_rad, *moved = MOVED.get((hand, kind), (0.0, 0.0, 0.0, 0.0, 0.0))
    recipe = RECIPES[hand].moved(*moved) if any(moved) else RECIPES[hand]
    times = {"handle": (4.0, 0.27, 0.12), "ball_in_box": (3.0, 0.36, 0.32)}.get(kind, (1.2, 0.15, 0.12))
    return Grip(recipe, turn_rad, recipe.close_s, *times)


COOKBOOK: dict[str, dict[str, Grip]] = {
    "softhand": _SOFTHAND,
    "softhand_skin": _SOFTHAND,
    "softhand_strong": _SOFTHAND,
    **{hand: {kind: _grip(hand, kind) for kind in KINDS if (hand, kind) not in WITHOUT} for hand in RECIPES},
}
"""By the name of the hand and the kind of object; a kind for which no grip was found is missing"""
