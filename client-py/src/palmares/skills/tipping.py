"""Tipping over, with the SoftHand, what stands at a shelf's rear wall: lying, it can be raked.

There is no room behind it for the fingers, and what is tall leaves none above it to grasp it from. `choose`
finds such an object, `tip` lays nearly straight fingers on its top, presses, and draws it forward until it
falls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from palmares.arrays import array
from palmares.rotation import quat_of, rot_z, rot_zyz
from palmares.scene import Region
from palmares.skills.attempts import Attempt, Place, candidates
from palmares.skills.grasps import SOFTHAND_PRESHAPED
from palmares.skills.motion import Mover, press
from palmares.skills.objects import ObjectBounds, Rolling

__all__ = ["choose", "tip"]

PITCH_RAD = 1.4
"""π/2 holds the fingers level, less points them up: so they fit between a tall object and the shelf's top"""
YAWS_RAD = (0.0, 0.35, -0.35)
ASIDES_M = (0.0, -0.015, 0.015, -0.03, 0.03)
"""How far beside its middle the object may be touched"""
SIGMA = 0.1
LEAST_HEIGHT_M, SLENDER = 0.12, 1.5
"""What is lower, or not so many times as high as it is deep, slides and does not tip"""
FINGERS_M, TIPS_M = 0.2, 0.255
"""From so far along the hand on there are fingers, and their ends"""
OVER_M, ROOM_M = 0.003, 0.003
"""Room above the object, and at the walls"""
MAX_CLASH_M = 0.03
"""A hand that overlaps others by more does not go in"""
TRIES, MOVED_M = 4, 0.015
PRESS_N, PRESSES = 8.0, 14
"""How hard the fingers press, and how often they sink by 3 mm for it"""
PULL_M, PULL_S = 0.16, 0.5


def choose(
    objects: Sequence[ObjectBounds], shelf: Region, attempts: Sequence[Attempt], rolls: Rolling
) -> Place | None:
    """Return the object that can be tipped over with most room; `None` if there is none.

    Args:
        objects: All of them, in the shelf or not.
        shelf: The region; open towards -y.
        attempts: What was tried so far.
        rolls: Which objects roll.

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
        if target.index in rolls or height < max(LEAST_HEIGHT_M, SLENDER * depth) or any(before):
            continue
        for yaw_rad in YAWS_RAD:
            again = 0.03 * sum(tried.yaw_rad == yaw_rad for tried in here)
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
    rotation = array(rot_z(yaw_rad) @ rot_zyz(math.pi / 2, PITCH_RAD))
    points, radii = SOFTHAND_PRESHAPED.at(rotation, array([0.0, 0.0, 0.0])).spheres(5)
    along = points[:, :2] @ (rotation[:2, 2] / np.linalg.norm(rotation[:2, 2]))
    fingers = along > FINGERS_M
    ends = points[along > TIPS_M].mean(axis=0)
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
    """Carry a plan out; the object stays in the shelf."""
    mover.to(0.5, plan.at - plan.into * plan.at[1], quat_of(plan.rotation), sigma=SIGMA)
    mover.to(0.6, plan.at)
    press(mover, PRESS_N, PRESSES)
    mover.to(PULL_S, mover.position - PULL_M * plan.into)
    mover.wait(0.3)
    mover.to(0.6, array([0.8 * mover.position[0], 0.0, mover.position[2]]))
