"""Raking objects out of a shelf with hooked fingers, so fast that they fly into the box in front of it.

An object that leaves the shelf at about 1 m/s lands in the box, with the objects in its way; the hand need
not hold it. `choose` finds a place for the hooked fingers, `put_down` moves them there, `rake` pulls the
object out, and `drag` pulls an object forward that leaves no room behind it.

The hand is a set of boxes, palm down and fingers towards +y when it is not turned. Objects are the bounding
boxes of `palmares.skills.objects.object_bounds`.
"""

from __future__ import annotations

import itertools
from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import matmul
from palmares.rotation import quat_of, rot_z
from palmares.scene import Region
from palmares.skills.attempts import Attempt, Place, candidates
from palmares.skills.motion import Mover, fling, press
from palmares.skills.objects import ObjectBounds, Rolling

__all__ = [
    "RakePlan",
    "RakeShape",
    "boxes",
    "choose",
    "drag",
    "put_down",
    "rake",
]

Kind = Literal["rake", "drag"]
"""``rake``: pull out from behind; ``drag``: pull forward from above, if the fingers do not fit behind"""
KINDS: tuple[Kind, ...] = ("rake", "drag")

FLOOR_M = 0.012
"""Gap between the fingertips and the floor"""
WALL_M = 0.003
"""Gap between the hand and walls or top of the shelf"""
ABOVE_TOP_M = 0.005
"""Height above the object at which a drag begins to press down"""
FRONT_M = 0.07
"""An object with its middle this near to the opening is at the opening"""
DRAG_COST = 0.12
"""Cost of a drag, which gains less than a rake"""
BITE_COST = 0.3
"""Cost of reaching down behind an object by less than 5 cm, 1/m"""
ROLL_SHARE = 0.55
"""Fingers that reach down by this share of a rolling object's height are behind its middle"""
GLANCE_COSTS = (0.03, 0.08)
"""Costs of touching another object in passing: one that does not roll, one that rolls"""
ROLLS_FIRST = 0.04
"""Bonus of objects that roll"""


def boxes(*rows: tuple[float, ...]) -> Array:
    """Return the corners of boxes, (n, 8, 3), m, from rows of smallest and largest x, y, z."""
    ends = array(rows, -1, 2, 3)
    corners = [[box[k][axis] for axis, k in enumerate(pick)] for box in ends for pick in PICKS]
    return array(corners, -1, 8, 3)


PICKS = list(itertools.product((0, 1), repeat=3))


@dataclass(frozen=True)
class RakeShape:
    """A hand with hooked fingers, and the costs of its places."""

    rotation: Array
    """World from hand, (3, 3): palm down, fingers towards +y"""
    hook: Array
    """Boxes around the fingers that pull, (n, 8, 3), hand frame, m; see `boxes`"""
    body: Array
    """Boxes around the parts that stay above the objects, (n, 8, 3), hand frame, m"""
    beside: Array | None = None
    """Boxes around parts next to the fingers that come down and do not pull, such as a thumb"""
    behind_m: float = 0.012
    """Gap between the fingers and the object when they come down"""
    above_m: float = 0.008
    """Gap between the palm and objects under it"""
    bite_m: float = 0.02
    """Smallest depth of the fingers behind the object"""
    yaws_rad: tuple[float, ...] = (0.0, 0.3, -0.3)
    """Directions of the hand to try"""
    kinds: tuple[Kind, ...] = ("rake", "drag")
    """Motions of the hand; soft fingers only rake"""
    asides_m: tuple[float, ...] = (0.0, -0.02, 0.02, -0.04, 0.04)
    """Distances from the object's middle to try, along x"""
    yaw_cost: float = 0.02
    """Cost of an oblique pull, 1/rad: an object that tips or rolls slips off sideways"""
    depth_cost: float = 0.1
    """Cost of depth in the shelf, 1/m: objects in front should go first"""
    front_cost: float = 0.0
    """Cost of a pull through an object at the opening, which cannot gain speed and falls into the gap"""
    roll_cost: float = 0.0
    """Cost of reaching down behind a rolling object by less than `ROLL_SHARE` of its height, 1/m: soft
    fingers above its middle press it down and slide over it"""

    def bounds(self, part: Array, yaw_rad: float) -> tuple[Array, Array]:
        """Return the smallest and largest coordinates (n, 3), m, of boxes (n, 8, 3) of the turned hand.

        They are along the world's axes, relative to the hand's origin. `yaw_rad` turns the hand.
        """
        turned = matmul(part, matmul(rot_z(yaw_rad), self.rotation).T)
        return turned.min(axis=1), turned.max(axis=1)


@dataclass(frozen=True)
class RakePlan(Place):
    """Place of the hand, and its motion there."""

    kind: Kind


def choose(
    objects: Sequence[ObjectBounds],
    shelf: Region,
    shape: RakeShape,
    attempts: Sequence[Attempt],
    *,
    rolls: Rolling = frozenset(),
    tries: int = 8,
    moved_m: float = 0.015,
    only: Container[int] | None = None,
) -> RakePlan | None:
    """Return the best plan for the objects in the shelf; `None` if there is none.

    Args:
        objects: All objects, in the shelf or not.
        shelf: The region; open towards -y.
        shape: The hand.
        attempts: All earlier attempts.
        rolls: Rows of the objects that roll: they come first, and touching them in passing costs more.
        tries: Most attempts on an object at one position.
        moved_m: Attempts on an object count until it has moved farther than this.
        only: Rows of the objects to choose from; all if left out.

    """
    best: RakePlan | None = None
    for target, others, here in candidates(objects, shelf, attempts, KINDS, tries, moved_m, only):
        for yaw_rad in shape.yaws_rad:
            for kind in shape.kinds:
                plan = _best_place(kind, target, others, shelf, shape, yaw_rad, rolls, here)
                if plan is not None and (best is None or plan.score > best.score):
                    best = plan
    return best


def _best_place(
    kind: Kind,
    target: ObjectBounds,
    others: list[ObjectBounds],
    shelf: Region,
    shape: RakeShape,
    yaw_rad: float,
    rolls: Rolling,
    here: Sequence[Attempt],
) -> RakePlan | None:
    hook_low, hook_high = shape.bounds(shape.hook, yaw_rad)
    body_low, body_high = shape.bounds(shape.body, yaw_rad)
    low, high = hook_low.min(axis=0), hook_high.max(axis=0)
    down = shape.hook if shape.beside is None else np.concatenate([shape.hook, shape.beside])
    down_low, down_high = shape.bounds(down, yaw_rad)
    best: RakePlan | None = None
    for aside in shape.asides_m:
        x = float(target.middle[0] - (low[0] + high[0]) / 2 + aside)
        farthest = shelf.max[1] - WALL_M - max(float(high[1]), float(body_high[:, 1].max()))
        if kind == "rake":
            y = min(float(target.high[1] + shape.behind_m - low[1]), farthest)
            blocked = y + low[1] < target.high[1] + 0.002
        else:
            depth = target.high[1] - target.low[1]
            y = min(float(target.middle[1] + 0.25 * depth - (low[1] + high[1]) / 2), farthest)
            blocked = y + low[1] < target.low[1]
        if blocked or x + low[0] < shelf.min[0] + WALL_M or x + high[0] > shelf.max[0] - WALL_M:
            continue
        place = array([x, y, 0.0])
        # As low as the floor and the objects under the palm allow.
        z = shelf.min[2] + FLOOR_M - low[2]
        for other in (*others, target):
            under = _overlap(body_low + place, body_high + place, other) > 0.004
            if under.any():
                z = max(z, float((other.high[2] + shape.above_m - body_low[under, 2]).max()))
        if kind == "drag":
            on_top = float(target.high[2] + ABOVE_TOP_M - low[2])
            if z > on_top:
                continue
            z = on_top
        top = z + max(high[2], body_high[:, 2].max())
        bite = float(target.high[2] - z - low[2])
        if top > shelf.max[2] - WALL_M or (kind == "rake" and bite < shape.bite_m):
            continue
        place[2] = z
        score = (
            -BITE_COST * max(0.0, 0.05 - bite)
            - abs(aside)
            - shape.yaw_cost * abs(yaw_rad)
            - shape.depth_cost * (target.middle[1] - shelf.min[1])
        )
        clash = 0.0
        lane_low, lane_high = min(x + low[0], target.low[0]), max(x + high[0], target.high[0])
        for other in others:
            deep = np.minimum(
                _overlap(down_low + place, down_high + place, other), other.high[2] - (down_low[:, 2] + z)
            )
            clash = max(clash, float(deep.max()))
            if kind == "rake" and other.middle[1] < y + low[1]:
                score -= GLANCE_COSTS[other.index in rolls] * _glances(lane_low, lane_high, other)
                score -= shape.front_cost * _at_the_front(lane_low, lane_high, other, shelf)
        score -= 2.0 * clash
        score -= max(0.0, shelf.min[0] - (x + down_low[:, 0].min()), x + down_high[:, 0].max() - shelf.max[0])
        if target.index in rolls:
            score += ROLLS_FIRST
            if kind == "rake":
                score -= shape.roll_cost * max(0.0, ROLL_SHARE * float(target.size[2]) - bite)
        if kind == "drag":
            score -= DRAG_COST
        again = [tried.yaw_rad == yaw_rad and tried.grasp == kind for tried in here]
        score -= 0.03 * len(again) + 0.04 * again.count(True)
        if best is None or score > best.score:
            best = RakePlan(target, yaw_rad, matmul(rot_z(yaw_rad), shape.rotation), place, score, kind)
    return best


def _glances(lane_low: float, lane_high: float, other: ObjectBounds) -> bool:
    """Whether an object pulled along a lane touches another off its middle, which then drops off slowly."""
    touches = other.high[0] > lane_low and other.low[0] < lane_high
    return bool(touches and not lane_low + 0.01 < other.middle[0] < lane_high - 0.01)


def _at_the_front(lane_low: float, lane_high: float, other: ObjectBounds, shelf: Region) -> bool:
    """Whether an object pulled along a lane pushes out one at the opening."""
    touches = other.high[0] > lane_low and other.low[0] < lane_high
    return bool(touches and other.middle[1] < shelf.min[1] + FRONT_M)


def _overlap(low: Array, high: Array, other: ObjectBounds) -> Array:
    """Return the overlap of each box (n, 3) with an object, from above, (n,), m; negative without one."""
    deep = np.minimum(high[:, :2], other.high[:2]) - np.maximum(low[:, :2], other.low[:2])
    return array(deep.min(axis=1))


def put_down(
    mover: Mover,
    plan: RakePlan,
    *,
    outside_y_m: float,
    flat_y_m: float,
    top_m: float,
    sigmas: tuple[float, float],
    hook_s: float,
) -> None:
    """Go in at the top with open fingers as far as they fit, hook them, go to the place, come down."""
    over = array([plan.at[0], plan.at[1], max(top_m, plan.at[2])])
    flat = over - plan.into * max(0.0, over[1] - flat_y_m)
    mover.to(0.5, over - plan.into * (over[1] - outside_y_m), quat_of(plan.rotation), sigma=sigmas[0])
    mover.to(0.5, flat)
    mover.to(hook_s, sigma=sigmas[1])
    mover.to(0.2, over)
    mover.to(0.3, plan.at)


def rake(
    mover: Mover,
    plan: RakePlan,
    *,
    end_y_m: float,
    sigma: float,
    speed_m_s: float = 1.2,
    inwards: float = 0.8,
) -> None:
    """Pull the objects in front of the fingers out of the shelf; the base ends at y = `end_y_m`."""
    mover.sigma = sigma
    end = plan.at - plan.into * (plan.at[1] - end_y_m)
    fling(mover, array([inwards * end[0], end[1], end[2]]), speed_m_s)
    mover.wait(0.4)


def drag(mover: Mover, plan: RakePlan, *, press_n: float = 12.0, far_m: float = 0.08) -> None:
    """Press the fingertips onto the object and pull it forward, slowly; it stays in the shelf."""
    press(mover, press_n)
    mover.to(0.8, mover.position - far_m * plan.into)
    mover.to(0.2, mover.position + array([0.0, 0.0, 0.04]))
