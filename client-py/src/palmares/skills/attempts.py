"""Attempts to move objects: which were made, and which objects are left to try."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
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


def candidates(
    objects: Sequence[ObjectBounds],
    shelf: Region,
    attempts: Sequence[Attempt],
    ways: Container[str],
    tries: int,
    moved_m: float,
    only: Container[int] | None = None,
) -> Iterator[tuple[ObjectBounds, list[ObjectBounds], list[Attempt]]]:
    """Give each object in the shelf that may be tried, the others there, and what was tried where it stands.

    Args:
        objects: All of them, in the shelf or not.
        shelf: The region.
        attempts: What was tried so far.
        ways: Which attempts count, by their `grasp`.
        tries: An object that was tried so often where it stands is left there.
        moved_m: For an object that has moved farther than this, earlier attempts do not count.
        only: Rows of the objects that may be taken; all if it is left out.

    """
    inside = [found for found in objects if shelf.contains(found.com)]
    for target in inside:
        tried = attempts_here(attempts, target.index, target.middle, moved_m)
        here = [attempt for attempt in tried if attempt.grasp in ways]
        if len(here) < tries and (only is None or target.index in only):
            yield target, [other for other in inside if other is not target], here


@dataclass(frozen=True)
class Place:
    """Where to put the hand down on an object, or behind it."""

    target: ObjectBounds
    yaw_rad: float
    rotation: Array
    """World from hand, (3, 3)"""
    at: Array
    """Position of the base when the fingers are down, (3,), m"""
    score: float
    """0 where nothing is in the way, else less"""

    @property
    def into(self) -> Array:
        """Level direction in which the fingers point, (3,); its y is 1."""
        return array([-math.tan(self.yaw_rad), 1.0, 0.0])
