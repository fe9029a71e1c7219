"""Clear the shelf with any hand: look, make the best attempt, look again.

A hand is a subclass of `ShelfMover`; the examples ``shelf_…`` have those of SoftHand and ReFlex.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from palmares.arguments import Noise, Sensing
from palmares.client import Client
from palmares.messages import Observation
from palmares.scene import Region
from palmares.skills.attempts import Attempt
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import ObjectBounds, object_bounds, rolling
from palmares.skills.runs import Summary

__all__ = ["ShelfMover", "ShelfSummary", "play_shelf"]

LOG = logging.getLogger(__name__)

PICKS = 100
"""Attempts per run"""


@dataclass(frozen=True, kw_only=True)
class ShelfSummary(Summary):
    """Outcome of a run."""

    in_box: int
    outside: int
    """Objects that are neither in the shelf nor in the box at the end"""
    picks: int
    """Attempts made"""
    caught: int | None
    """Attempts after which the box had more objects; None with sensors alone, as the next"""
    left: list[str] | None
    """Objects left in the shelf"""


class ShelfMover(Mover):
    """Moves a hand in the task ``shelf`` by the true poses; a subclass has numbers and motions.

    Attributes:
        hand: Name of the hand.
        sensing: What its observations have.
        looks: Looks in a row without a possible attempt that end the run.

    """

    hand: ClassVar[str]
    sensing: ClassVar[Sensing] = "truth"
    looks: ClassVar[int] = 1

    def __init__(self, client: Client, first: Observation) -> None:
        super().__init__(client, first)
        self.scene = client.scene
        self.shelf, self.box = self.scene.region("shelf"), self.scene.region("box")
        self.rolls = rolling(self.scene.free)

    def objects(self) -> list[ObjectBounds]:
        """Return the objects that are seen."""
        return object_bounds(self.scene, self.obs)

    def attempt(self, objects: Sequence[ObjectBounds], attempts: Sequence[Attempt]) -> Attempt | None:
        """Make the best possible attempt and return it; `None` if none is left."""
        raise NotImplementedError

    def inside(self, region: Region) -> list[str] | None:
        """Return the names of the objects in a region; `None` with sensors alone."""
        if self.sensing == "sensors":
            return None
        return [found.name for found in object_bounds(self.scene, self.obs) if region.contains(found.com)]


def play_shelf(kind: type[ShelfMover], client: Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts with a hand."""
    noise: Noise | None = None if kind.sensing == "truth" else "real"
    mover = kind(client, client.reset("shelf", kind.hand, sensing=kind.sensing, noise=noise, seed=seed))
    attempts: list[Attempt] = []
    caught = idle = 0
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        while len(attempts) < picks and idle < kind.looks:
            before = mover.inside(mover.box) or []
            objects = mover.objects()
            tried = mover.attempt(objects, attempts)
            if tried is None:
                idle += 1
                continue
            idle = 0
            attempts.append(tried)
            caught += len(mover.inside(mover.box) or []) > len(before)
            LOG.info(
                f"attempt {len(attempts):2}: the shelf had {len(objects)}; "
                f"{mover.scene.free[tried.index].name}, grasp '{tried.grasp}'; "
                f"{mover.obs.sim_time_s:.1f} s simulated"
            )
        mover.wait(0.5)
    left = mover.inside(mover.shelf)
    result, summary = mover.stop()
    return ShelfSummary(
        **vars(summary),
        in_box=result.in_goal,
        outside=result.outside,
        picks=len(attempts),
        caught=None if left is None else caught,
        left=left,
    )
