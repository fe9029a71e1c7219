"""The scene at tick 0: bodies, their shapes, and the regions that the rules refer to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

from palmares import wire
from palmares.arrays import Array, Quat, Vec3, array
from palmares.reproducible import matmul
from palmares.rotation import matrix_of
from palmares.views import Rows, Viewed, first, vector


class HasName(Protocol):
    """Anything with a name."""

    name: str


Named = TypeVar("Named", bound=HasName)
Value = TypeVar("Value")


def named(kind: str, name: str, entries: Sequence[Named]) -> Named:
    """Return the entry with this name; the `KeyError` for an unknown name lists the known ones."""
    for entry in entries:
        if entry.name == name:
            return entry
    known = ", ".join(entry.name for entry in entries) or "none"
    raise KeyError(f"no {kind} {name!r}; there are: {known}")


class Placed:
    """Something with a pose in another frame."""

    __slots__ = ()
    position: Vec3
    quat_xyzw: Quat

    @property
    def xyz(self) -> Array:
        """Position as an array, shape (3,), m."""
        return array(self.position)

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its own frame to the other, shape (3, 3)."""
        return matrix_of(self.quat_xyzw)


class ScenePart(Placed, wire.ScenePart, kw_only=True):
    """A convex part of a body, placed in the body frame."""


class SceneBody(Viewed, wire.SceneBody, kw_only=True):
    """A body and its shapes, in the world frame at tick 0."""

    parts: list[ScenePart]

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed body."""
        return f"SceneBody {self.name}, id {self.id}: {_in_words(self)}", []

    @property
    def xyz(self) -> Array:
        """Position as an array, shape (3,), m; `ValueError` when it is hidden."""
        return array(self._known(self.position))

    @property
    def rotation(self) -> Array:
        """Rotation matrix from its own frame to the world, shape (3, 3); `ValueError` when it is hidden."""
        return matrix_of(self._known(self.quat_xyzw))

    @property
    def half_extents(self) -> Array:
        """Half the edges of the box around its parts along its own axes, shape (3,), m."""
        ends = [_ends(part) for part in self.parts]
        low, high = np.min([low for low, _ in ends], axis=0), np.max([high for _, high in ends], axis=0)
        return array(0.5 * (high - low))

    def _known(self, value: Value | None) -> Value:
        if value is None:
            raise ValueError(f"the pose of {self.name!r} is hidden in a run with sensing='sensors'")
        return value


def _ends(part: ScenePart) -> tuple[Array, Array]:
    """Return the lowest and highest coordinates of a part in the body frame."""
    turn, shape = part.rotation, part.shape
    if shape.points is not None:
        points = matmul(array(shape.points, -1, 3), turn.T)
        return part.xyz + points.min(axis=0) - shape.rounding, part.xyz + points.max(axis=0) + shape.rounding
    radius, length = shape.radius or 0.0, shape.half_length or 0.0
    reach: Array
    if shape.half_extents is not None:
        inner = array(shape.half_extents) - shape.rounding
        reach = matmul(np.abs(turn), inner) + shape.rounding
    elif shape.type == "cylinder":
        axis = turn[:, 2]
        reach = np.abs(axis) * length + radius * np.sqrt(np.maximum(0.0, 1.0 - axis * axis))
    else:
        reach = np.abs(turn[:, 2]) * length + radius
    return part.xyz - reach, part.xyz + reach


class Region(wire.Region, kw_only=True):
    """An axis-aligned region that the rules refer to, such as the inside of ``box_b``."""

    @property
    def center(self) -> Array:
        """Its middle, shape (3,), m."""
        return 0.5 * (array(self.min) + array(self.max))

    @property
    def size(self) -> Array:
        """Its edges, shape (3,), m."""
        return array(self.max) - array(self.min)

    def contains(self, point: Array) -> bool:
        """Return whether `point` (3,), m, is inside or on the border."""
        return bool(np.all(point >= self.min) and np.all(point <= self.max))


class Scene(Viewed, wire.Scene, kw_only=True):
    """The world at tick 0."""

    bodies: list[SceneBody]
    regions: list[Region]

    def region(self, name: str) -> Region:
        """Return the region with this name; `KeyError` lists the names there are."""
        return named("region", name, self.regions)

    def goal_named(self, name: str) -> wire.GoalInfo:
        """Return the goal with this name, with its tolerances; `KeyError` lists the names there are."""
        return named("goal", name, self.goals)

    @property
    def start(self) -> Region | None:
        """The region where the objects are at tick 0; ``None`` in a task without."""
        return next((region for region in self.regions if region.role == "start"), None)

    @property
    def goal(self) -> Region | None:
        """The region where the objects belong; ``None`` in a task without."""
        return next((region for region in self.regions if region.role == "goal"), None)

    def body(self, name: str) -> SceneBody:
        """Return the body with this name, such as ``box_a``; `KeyError` lists the names there are."""
        return named("body", name, self.bodies)

    @property
    def free(self) -> list[SceneBody]:
        """The bodies that can move, in the order of `Truth.objects`."""
        return [body for body in self.bodies if body.free]

    @property
    def furniture(self) -> list[SceneBody]:
        """The bodies that cannot move."""
        return [body for body in self.bodies if not body.free]

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed scene."""
        free, fixed = self.free, self.furniture
        title = f"Scene of {len(free)} objects, {len(fixed)} fixed bodies, {len(self.regions)} regions"
        rows = first([(body.name, _in_words(body)) for body in free], "objects")
        rows += [(body.name, "fixed" + (", endless" if body.endless else "")) for body in fixed]
        for region in self.regions:
            role = f"{region.role}: " if region.role else ""
            rows.append((f"region {region.name}", f"{role}{vector(region.min)} to {vector(region.max)} m"))
        for goal in self.goals:
            rows.append((f"goal {goal.name}", f"{goal.points:g} points: {conditions(goal)}"))
        return title, rows


def conditions(goal: wire.GoalInfo) -> str:
    """Return the conditions of a goal in words, with their tolerances."""
    words = [] if goal.object is None else [goal.object]
    if goal.point is not None:
        words[-1:] = [f"{' '.join(words[-1:])} at {vector(goal.point)} m".strip()]
    if goal.less_by is not None:
        least = f"{goal.slip_m} m" if goal.less_by == "slip" else f"{goal.slow_s:g} s"
        return ", ".join([*words, f"of shaken, less by {goal.less_by}: 0 at {least}"])
    if goal.inside is not None:
        words.append(f"inside {goal.inside}")
    if goal.outside:
        words.append(f"outside {' and '.join(goal.outside)}")
    if goal.within is not None:
        box = f"{vector(goal.within.min)} to {vector(goal.within.max)} m"
        words.append(f"within {box} of {goal.within.object}")
    for value, text in (
        (goal.above_m, "raised by {} m"),
        (goal.upright_deg, "upright within {:g}°"),
        (goal.rest_m_s, "slower than {} m/s"),
        (goal.hand_off_m, "{} m or more from the base"),
        (goal.slip_m, "slips by less than {} m"),
    ):
        if value is not None:
            words.append(text.format(value))
    if goal.for_s > 0.0:
        words.append(f"for {goal.for_s:g} s")
    return ", ".join(words)


def _in_words(body: SceneBody) -> str:
    kind = body.parts[0].shape.type if len(body.parts) == 1 else f"{len(body.parts)} parts"
    size = " × ".join(f"{2000.0 * half:.0f}" for half in body.half_extents)
    at = "hidden" if body.position is None else f"at {vector(body.position)} m"
    return f"{kind}, {size} mm, {1000.0 * body.mass:.0f} g, friction {body.friction:.2g}, {at}"
