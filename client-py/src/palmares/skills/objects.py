"""Bounding boxes of objects, from the full state (``sensing="truth"``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.messages import Observation
from palmares.reproducible import matmul
from palmares.rotation import rot_z
from palmares.scene import Scene, SceneBody
from palmares.truth import Truth
from palmares.wire import Shape

__all__ = [
    "ObjectBounds",
    "Rolling",
    "half_extents",
    "largest_radius",
    "object_bounds",
    "rolling",
    "truth_of",
    "upright_box",
]

Rolling = frozenset[int]
"""Rows of the objects that roll, in `Truth.positions`"""


def truth_of(obs: Observation) -> Truth:
    """Return the full state; `ValueError` in a run with ``sensing="sensors"``."""
    if not obs.has_truth:
        raise ValueError('poses of objects need a run with sensing="truth"')
    return obs.truth


def largest_radius(scene: Scene) -> float:
    """Return the largest radius among the shapes of the free bodies, m; 0 if no shape has one."""
    return max((part.shape.radius or 0.0 for body in scene.free for part in body.parts), default=0.0)


@dataclass(frozen=True)
class ObjectBounds:
    """A free object: its bounding box along the world's axes and its centre of mass, each (3,), m."""

    index: int
    """Row in `Truth.positions`"""
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

    For spheres, capsules, cylinders and boxes; a hull, which has no such fields, counts as a point.
    """
    if shape.type == "box" and shape.half_extents is not None:
        return matmul(np.abs(rotation), array(shape.half_extents))
    axis = np.abs(rotation[:, 2])
    rim = np.sqrt(np.clip(1.0 - axis * axis, 0.0, 1.0)) if shape.type == "cylinder" else 1.0
    return array(axis * (shape.half_length or 0.0) + (shape.radius or 0.0) * rim)


def object_bounds(scene: Scene, obs: Observation, yaw_rad: float = 0.0) -> list[ObjectBounds]:
    """Return the bounding boxes of the free objects, in the order of `Truth.objects`.

    `yaw_rad` turns the axes of boxes and centres about the vertical.
    """
    found = []
    turned = rot_z(-yaw_rad)
    for body, state in zip(scene.free, truth_of(obs).objects, strict=True):
        rotation, origin = matmul(turned, state.rotation), matmul(turned, state.xyz)
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for part in body.parts:
            middle = origin + matmul(rotation, part.xyz)
            half = half_extents(part.shape, matmul(rotation, part.rotation))
            low, high = np.minimum(low, middle - half), np.maximum(high, middle + half)
        com = origin + matmul(rotation, body.com)
        found.append(ObjectBounds(state.id, state.name, low, high, com))
    return found


def upright_box(scene: Scene, obs: Observation, index: int) -> tuple[ObjectBounds, float]:
    """Return the smallest upright box around object `index`, and the direction of its longer side, rad.

    The returned box is turned about its middle until that side is along x, as `TopGrasp.base_position` needs
    it. Of several equal directions, as for a round object, it is the one nearest to x.
    """
    best: tuple[float, float, ObjectBounds] | None = None
    for degrees in sorted(range(-87, 91, 3), key=abs):
        yaw_rad = math.radians(degrees)
        box = object_bounds(scene, obs, yaw_rad)[index]
        x, y, _ = box.high - box.low
        # Rounding of the area must not turn the hand.
        if y < 1.01 * x and (best is None or x * y < 0.99 * best[0]):
            best = float(x * y), yaw_rad, box
    assert best is not None
    _, yaw_rad, box = best
    back, half = rot_z(yaw_rad), (box.high - box.low) / 2
    middle, com = matmul(back, box.middle), matmul(back, box.com)
    return ObjectBounds(index, box.name, middle - half, middle + half, com), yaw_rad


def rolling(bodies: Sequence[SceneBody]) -> Rolling:
    """Return the rows of the free bodies that roll: those made of spheres and capsules alone."""
    return frozenset(
        row
        for row, body in enumerate(bodies)
        if all(part.shape.type in ("sphere", "capsule") for part in body.parts)
    )
