"""What stands in the world at tick 0: bodies, their shapes, and the regions the rules speak of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeAlias, TypeVar

import msgspec
import numpy as np

from palmares.rotation import Array, matrix_of

Vec3: TypeAlias = tuple[float, float, float]
Quat: TypeAlias = tuple[float, float, float, float]


class HasName(Protocol):
    """Anything that can be looked up by its name."""

    name: str


Named = TypeVar("Named", bound=HasName)


def named(kind: str, name: str, things: Sequence[Named]) -> Named:
    """Return the one of `things` called `name`; `KeyError` names those there are."""
    for thing in things:
        if thing.name == name:
            return thing
    known = ", ".join(thing.name for thing in things) or "none"
    raise KeyError(f"no {kind} {name!r}; there are: {known}")


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


class Placed(msgspec.Struct, kw_only=True):
    """What has a frame of its own, and where that is in another one."""

    position: Vec3
    """Origin, m."""
    quat_xyzw: Quat

    @property
    def xyz(self) -> Array:
        """Position as an array, shape (3,), m."""
        return np.array(self.position)

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its own frame to the other, shape (3, 3)."""
        return matrix_of(self.quat_xyzw)


class ScenePart(Placed, kw_only=True):
    """A convex part of a body, placed in the body frame."""

    shape: Shape


class SceneBody(Placed, kw_only=True):
    """A body and its shapes, in the world frame at tick 0."""

    id: int
    name: str
    free: bool
    """False for furniture."""
    mass: float
    """kg; 0 for furniture"""
    friction: float
    """Coulomb coefficient of two such surfaces; a pair of bodies has the geometric mean of theirs"""
    com: Vec3 = (0.0, 0.0, 0.0)
    """Centre of mass in the body frame, m"""
    parts: list[ScenePart]
    color: Vec3
    """sRGB, 0 to 1"""


class Region(msgspec.Struct, kw_only=True):
    """An axis-aligned region the rules speak of, such as the inside of ``box_b``."""

    name: str
    min: Vec3
    max: Vec3
    role: str | None = None
    """The part it plays in the rules: ``start``, ``goal``; ``None`` for others"""

    @property
    def center(self) -> Array:
        """Its middle, shape (3,), m."""
        return 0.5 * np.add(self.min, self.max, dtype=np.float64)

    @property
    def size(self) -> Array:
        """Its edges, shape (3,), m."""
        return np.subtract(self.max, self.min)

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
        return named("region", name, self.regions)

    @property
    def start(self) -> Region | None:
        """The region where the objects are at tick 0; ``None`` in a task without."""
        return next((region for region in self.regions if region.role == "start"), None)

    @property
    def goal(self) -> Region | None:
        """The region where the objects belong; ``None`` in a task without."""
        return next((region for region in self.regions if region.role == "goal"), None)

    def body(self, name: str) -> SceneBody:
        """Return the body called `name`, such as ``box_a``; `KeyError` names those there are."""
        return named("body", name, self.bodies)

    @property
    def free(self) -> list[SceneBody]:
        """The bodies that can move, in the order of `Truth.objects`."""
        return [body for body in self.bodies if body.free]

    @property
    def furniture(self) -> list[SceneBody]:
        """The bodies that cannot move."""
        return [body for body in self.bodies if not body.free]
