"""Attempts to move objects, and the objects that are left to try."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

from palmares.arrays import Array, array
from palmares.reproducible import norm, tan
from palmares.scene import Region
from palmares.skills.objects import ObjectBounds

__all__ = [
    "Attempt",
    "Place",
    "attempts_here",
    "candidates",
]


@dataclass(frozen=True)
class Attempt:
    """An attempt to grasp or move an object."""

    index: int
    """Row of the object in `Truth.positions`"""
    position: Array
    """Position of the object at the attempt, (3,), m"""
    yaw_rad: float
    grasp: str = ""
    """Name of the grasp or motion, for a controller with several"""


def attempts_here(attempts: Sequence[Attempt], index: int, position: Array, moved_m: float) -> list[Attempt]:
    """Return the attempts on object `index` when it was within `moved_m` of its present `position` (3,)."""
    same = [attempt for attempt in attempts if attempt.index == index]
    return [attempt for attempt in same if norm(attempt.position - position) < moved_m]


def candidates(
    objects: Sequence[ObjectBounds],
    shelf: Region,
    attempts: Sequence[Attempt],
    ways: Container[str],
    tries: int,
    moved_m: float,
    only: Container[int] | None = None,
) -> Iterator[tuple[ObjectBounds, list[ObjectBounds], list[Attempt]]]:
    """Yield each candidate in the shelf, the other objects there, and the attempts on it at its position.

    Args:
        objects: All objects, in the shelf or not.
        shelf: The region.
        attempts: All earlier attempts.
        ways: Values of `Attempt.grasp` that count.
        tries: An object with this number of attempts at its position is no candidate.
        moved_m: Attempts on an object count until it has moved farther than this.
        only: Rows of the objects that may be candidates; all if left out.

    """
    inside = [found for found in objects if shelf.contains(found.com)]
    for target in inside:
        tried = attempts_here(attempts, target.index, target.middle, moved_m)
        here = [attempt for attempt in tried if attempt.grasp in ways]
        if len(here) < tries and (only is None or target.index in only):
            yield target, [other for other in inside if other is not target], here


@dataclass(frozen=True)
class Place:
    """Place of the hand on an object, or behind it."""

    target: ObjectBounds
    yaw_rad: float
    rotation: Array
    """World from hand, (3, 3)"""
    at: Array
    """Position of the base with the fingers down, (3,), m"""
    score: float
    """0 if nothing is in the way, else less"""

    @property
    def into(self) -> Array:
        """Horizontal direction of the fingers, (3,); its y is 1."""
        return array([-tan(self.yaw_rad), 1.0, 0.0])
