"""Pushing objects into a shelf with the SoftHand's fist, to rake them out later.

An object at the opening cannot gain speed when it is pulled: it tips over the edge and falls down in front of
the shelf. From a few centimetres farther in it flies. `choose` finds an object that can be pushed in together
with the objects behind it; `push` pushes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.rotation import quat_of, rot_zyz
from palmares.scene import Region
from palmares.skills.attempts import Attempt, candidates
from palmares.skills.motion import Mover
from palmares.skills.objects import ObjectBounds, Rolling

__all__ = ["PushPlan", "choose", "push"]

ROTATION = rot_zyz(np.pi / 2, 1.6)
"""World from hand: palm down, fingers towards +y"""
FIST_M, REACH_M, HEIGHT_M = 0.05, 0.215, 0.078
"""Half the width of the fist, its distance from the base, height of the base above the shelf's floor"""
IN_M, MIN_PUSH_M = 0.1, 0.02
"""Wanted distance of the object's middle from the opening; shortest push"""
SHARES = (1.0, 0.75, 0.5)
"""Parts of the wanted push to try"""
GAP_M = 0.006
"""Smallest gap at the rear wall"""
BEFORE_M, BACK_M = 0.03, 0.08
"""Distance from the object at which the fist comes down, and the further distance of its approach"""
SPEED_M_S = 0.1
"""Speed of the push"""


@dataclass(frozen=True)
class PushPlan:
    """An object, and the distance to push it."""

    target: ObjectBounds
    way_m: float
    before: Array
    """Position of the base before the fist touches the object, (3,), m"""


def choose(
    objects: Sequence[ObjectBounds],
    shelf: Region,
    attempts: Sequence[Attempt],
    rolls: Rolling,
    moved_m: float = 0.015,
) -> PushPlan | None:
    """Return an object near the opening that can be pushed in; `None` if there is none.

    Args:
        objects: All objects, in the shelf or not.
        shelf: The region; open towards -y.
        attempts: All earlier attempts; an object is pushed once at each position.
        rolls: Rows of the objects that roll; the push must not touch them.
        moved_m: Attempts on an object count until it has moved farther than this.

    """
    for target, others, _ in candidates(objects, shelf, attempts, ("push",), 1, moved_m):
        wanted_m = float(shelf.min[1] + IN_M - target.middle[1])
        x = float(np.clip(target.middle[0], shelf.min[0] + FIST_M, shelf.max[0] - FIST_M))
        for way_m in (share * wanted_m for share in SHARES):
            if (
                way_m >= MIN_PUSH_M
                and target.index not in rolls
                and _fits(target, others, x, way_m, shelf, rolls)
            ):
                y = float(target.low[1]) - REACH_M - BEFORE_M
                return PushPlan(target, way_m, array([x, y, shelf.min[2] + HEIGHT_M]))
    return None


def _fits(
    target: ObjectBounds, others: list[ObjectBounds], x: float, way_m: float, shelf: Region, rolls: Rolling
) -> bool:
    """Whether all pushed objects stop in front of the rear wall, and none of them rolls."""
    low, high = array([x - FIST_M, shelf.min[1], 0.0]), array([x + FIST_M, target.low[1], 0.0])
    pushed = [(ObjectBounds(-1, "fist", low, high, high), way_m)]
    for other in sorted([*others, target], key=lambda other: float(other.low[1])):
        ways = [
            float(one.high[1] + far - other.low[1])
            for one, far in pushed
            if one.high[0] > other.low[0] and one.low[0] < other.high[0]
        ]
        far = max(ways, default=0.0)
        if far > 0.0:
            if other.index in rolls or other.high[1] + far > shelf.max[1] - GAP_M:
                return False
            pushed.append((other, far))
    return True


def push(mover: Mover, plan: PushPlan) -> None:
    """Push an object into the shelf, slowly."""
    back = plan.before - array([0.0, BACK_M, 0.0])
    mover.to(0.6, back, quat_of(ROTATION), sigma=1.0)
    mover.to(0.3, plan.before)
    way_m = BEFORE_M + plan.way_m
    mover.to(way_m / SPEED_M_S, plan.before + array([0.0, way_m, 0.0]))
    mover.to(0.5, back)
