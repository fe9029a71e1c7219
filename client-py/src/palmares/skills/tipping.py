"""Tipping over tall objects at a shelf's rear wall with the SoftHand; after that they can be raked.

The fingers do not fit behind such an object, nor above it for a grasp. `choose` finds one; `tip` puts nearly
straight fingers on its top, presses, and pulls it forward until it falls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from palmares.arrays import array
from palmares.reproducible import matmul, mean, norm
from palmares.rotation import quat_of, rot_z, rot_zyz
from palmares.scene import Region
from palmares.skills.attempts import Attempt, Place, candidates
from palmares.skills.grasps import SOFTHAND_PRESHAPED
from palmares.skills.motion import Mover, press
from palmares.skills.objects import ObjectBounds, Rolling

__all__ = ["choose", "tip"]

PITCH_RAD = 1.4
"""π/2 holds the fingers horizontal, less points them up, to fit between a tall object and the shelf's top"""
YAWS_RAD = (0.0, 0.35, -0.35)
"""Directions of the hand to try"""
ASIDES_M = (0.0, -0.015, 0.015, -0.03, 0.03)
"""Distances from the object's middle to try, along x"""
SIGMA = 0.1
"""Motor command of the nearly straight fingers"""
MIN_HEIGHT_M, SLENDER = 0.12, 1.5
"""Smallest height, and smallest ratio of height to depth, of an object that tips instead of sliding"""
FINGERS_M, TIPS_M = 0.2, 0.255
"""Distances along the hand at which fingers and fingertips begin"""
OVER_M, ROOM_M = 0.003, 0.003
"""Gaps above the object and at the walls"""
MAX_CLASH_M = 0.03
"""Largest overlap of the hand with other objects"""
TRIES, MOVED_M = 4, 0.015
"""Most attempts on an object at one position, which count until it has moved farther"""
PRESS_N, PRESSES = 8.0, 14
"""Force of the fingers, and most steps of 3 mm to reach it"""
PULL_M, PULL_S = 0.16, 0.5
"""Distance and duration of the pull"""


def choose(
    objects: Sequence[ObjectBounds], shelf: Region, attempts: Sequence[Attempt], rolls: Rolling
) -> Place | None:
    """Return the best object to tip over and the place of the hand; `None` if there is none.

    Args:
        objects: All objects, in the shelf or not.
        shelf: The region; open towards -y.
        attempts: All earlier attempts.
        rolls: Rows of the objects that roll.

    """
    best: Place | None = None
    for target, others, here in candidates(objects, shelf, attempts, ("tip",), TRIES, MOVED_M):
        height, depth = float(target.size[2]), float(target.size[1])
        before = (
            other.high[0] > target.low[0]
            and other.low[0] < target.high[0]
            and other.middle[1] < target.middle[1]
            for other in others
        )
        if target.index in rolls or height < max(MIN_HEIGHT_M, SLENDER * depth) or any(before):
            continue
        for yaw_rad in YAWS_RAD:
            again = 0.03 * [tried.yaw_rad for tried in here].count(yaw_rad)
            for aside in ASIDES_M:
                plan = _place(target, others, shelf, yaw_rad, aside, again)
                if plan is not None and (best is None or plan.score > best.score):
                    best = plan
    return best if best is not None and best.score > -MAX_CLASH_M else None


def _place(
    target: ObjectBounds,
    others: list[ObjectBounds],
    shelf: Region,
    yaw_rad: float,
    aside: float,
    again: float,
) -> Place | None:
    rotation = matmul(rot_z(yaw_rad), rot_zyz(math.pi / 2, PITCH_RAD))
    points, radii = SOFTHAND_PRESHAPED.at(rotation, array([0.0, 0.0, 0.0])).spheres(5)
    along = matmul(points[:, :2], rotation[:2, 2] / norm(rotation[:2, 2]))
    fingers = along > FINGERS_M
    ends = mean(points[along > TIPS_M])
    farthest = shelf.max[1] - ROOM_M - float((points[:, 1] + radii).max())
    at = array(
        [
            target.middle[0] + aside - ends[0],
            min(float(target.middle[1] + 0.25 * target.size[1] - ends[1]), farthest),
            target.high[2] + OVER_M - float((points[fingers, 2] - radii[fingers]).min()),
        ]
    )
    points = points + at
    over = (points[:, 0] + radii / 2 > target.low[0]) & (points[:, 0] - radii / 2 < target.high[0])
    if not (fingers & over & (points[:, 1] > target.low[1])).any():
        return None
    inside = points[:, 1] + radii > shelf.min[1]
    high, low = points[inside] + radii[inside, None], points[inside] - radii[inside, None]
    clash = max(0.0, float(high[:, 2].max()) - shelf.max[2] + ROOM_M)
    clash += max(0.0, float(high[:, 0].max()) - shelf.max[0] + ROOM_M)
    clash += max(0.0, shelf.min[0] + ROOM_M - float(low[:, 0].min()))
    for other in others:
        on = (
            (points[:, 0] + radii > other.low[0])
            & (points[:, 0] - radii < other.high[0])
            & (points[:, 1] + radii > other.low[1])
        )
        if on.any():
            clash += max(0.0, float(other.high[2] - (points[on, 2] - radii[on]).min()))
    clash += 0.1 * abs(aside) + 0.005 * abs(yaw_rad) + again
    return Place(target, yaw_rad, rotation, at, -clash)


def tip(mover: Mover, plan: Place) -> None:
    """Carry out a plan; the object stays in the shelf."""
    mover.to(0.5, plan.at - plan.into * plan.at[1], quat_of(plan.rotation), sigma=SIGMA)
    mover.to(0.6, plan.at)
    press(mover, PRESS_N, PRESSES)
    mover.to(PULL_S, mover.position - PULL_M * plan.into)
    mover.wait(0.3)
    mover.to(0.6, array([0.8 * mover.position[0], 0.0, mover.position[2]]))
