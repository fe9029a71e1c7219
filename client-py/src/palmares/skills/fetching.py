"""Fetching with the SoftHand: onto an object from above, close, lift it a little, and out, fast.

Whether the fingers hold an object or not, it ends in the box before the shelf. `choose` finds the object and
the grasp that has most room, `fetch` does it.
"""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import matmul
from palmares.rotation import quat_of, rot_z
from palmares.scene import Region
from palmares.skills.attempts import Attempt, candidates
from palmares.skills.grasps import SOFTHAND_PRESHAPED, TopGrasp
from palmares.skills.motion import UP, Mover, fling
from palmares.skills.objects import ObjectBounds

__all__ = ["GRASPS", "Plan", "choose", "fetch"]

GRASPS = (
    # name, pitch, roll, above, aside, along, σ open, σ closed, sink; units as in `TopGrasp`
    TopGrasp("flat", 1.6182, 0.3491, 0.0068, 0.0264, 0.1876, 0.0212, 0.7417, 0.0194),
    TopGrasp("high", 1.4135, 0.1346, 0.0232, 0.0137, 0.1689, 0.0, 0.8641, 0.0332),
    TopGrasp("steep", 1.7088, -0.3693, 0.0187, 0.0117, 0.1764, 0.0, 0.9539, 0.0327),
    TopGrasp("loose", 1.5586, -0.1036, 0.0226, 0.0357, 0.1726, 0.0492, 0.7668, 0.0097),
)
NAMES = {grasp.name for grasp in GRASPS}
YAWS_RAD = (0.0, 0.35, -0.35)
"""Directions of the hand to try"""
TRIES = 12
"""Most attempts on an object at one position"""
MOVED_M = 0.015
"""Attempts on an object count until it has moved farther than this"""
MARGIN_M = 0.006
"""Wanted distance between the hand and other objects"""

WAIT_AT = array([0.0, -0.12, 0.95])
"""Position of the base where it waits and turns, in front of the shelf and above the box, m"""
IN_S, SINK_S, CLOSE_S, SQUEEZE_S, LIFT_S, OPEN_S, FALL_S = 0.9, 0.25, 0.6, 0.2, 0.3, 0.4, 0.3
"""Durations of the steps of `fetch`"""
LIFT_M = 0.02
"""Height of the lift before the pull"""
SPEED_M_S = 1.4
"""Largest speed on the way out; a faster object flies over the box"""


@dataclass(frozen=True)
class Plan:
    """An object, a grasp, and the pose of the hand in it."""

    target: ObjectBounds
    grasp: TopGrasp
    yaw_rad: float
    rotation: Array
    """World from hand, (3, 3)"""
    at: Array
    """Position of the base when the fingers close, (3,), m"""
    room_m: float
    """0 if the hand gets in freely, else less; see `room`"""

    @property
    def before(self) -> Array:
        """Position of the base before it sinks, (3,), m."""
        return array(self.at - self.grasp.sink_m * self.rotation[:, 0])

    @property
    def into(self) -> Array:
        """Horizontal direction of the hand's way in, unit vector (3,)."""
        return matmul(rot_z(self.yaw_rad), [0.0, 1.0, 0.0])


def room(plan: Plan, others: list[ObjectBounds], shelf: Region) -> float:
    """Return 0 if the hand touches nothing on its way in, else less by the overlaps, m.

    The hand is a set of spheres, whose centres move along lines to their positions in the plan.
    """
    points, radii = SOFTHAND_PRESHAPED.at(plan.rotation, plan.before).spheres(5)
    inside = points[:, 1] + radii > shelf.min[1]
    points, radii = points[inside], radii[inside]
    score = 0.0
    for side in (0, 1, 2):
        beyond = np.maximum(points[:, side] + radii - shelf.max[side], 0.0)
        if side != 1:
            beyond = np.maximum(beyond, shelf.min[side] - (points[:, side] - radii))
        score -= 2.0 * float(beyond.max(initial=0.0))
    back = -plan.into / plan.into[1]
    for other in others:
        # The point of each line at the object's front, or its end.
        front = np.clip(points[:, 1], other.low[1], other.high[1])
        reached = points[:, 1] + radii > other.low[1]
        line = points + np.outer(points[:, 1] - front, back)
        gap_x = np.maximum(other.low[0] - line[:, 0], line[:, 0] - other.high[0])
        gap_z = line[:, 2] - other.high[2]
        gap = np.maximum(gap_x, gap_z) - radii
        score -= float(np.clip(MARGIN_M - gap[reached], 0.0, 0.05).max(initial=0.0))
    return score


def choose(
    objects: Sequence[ObjectBounds],
    shelf: Region,
    attempts: Sequence[Attempt],
    *,
    grasps: Sequence[TopGrasp] = GRASPS,
    only: Container[int] | None = None,
    tries: int = TRIES,
) -> Plan | None:
    """Return the plan with the most room; earlier attempts at the same position lower its score.

    Args:
        objects: All objects, in the shelf or not.
        shelf: The region; open towards -y.
        attempts: All earlier attempts.
        grasps: Grasps to choose from.
        only: Rows of the objects to choose from; all if left out.
        tries: Most attempts on an object at one position.

    """
    best, best_score = None, -math.inf
    for target, others, here in candidates(objects, shelf, attempts, NAMES, tries, MOVED_M, only):
        depth = target.middle[1] - shelf.min[1]
        for rank, grasp in enumerate(grasps):
            same = [attempt.grasp for attempt in here].count(grasp.name)
            for yaw in YAWS_RAD:
                rotation = grasp.rotation(yaw)
                at = grasp.base_position(target, rotation)
                free = room(Plan(target, grasp, yaw, rotation, at, 0.0), others, shelf)
                score = free - 0.02 * depth - 0.002 * rank - 0.01 * abs(yaw) - 0.02 * len(here) - 0.05 * same
                if score > best_score:
                    best, best_score = Plan(target, grasp, yaw, rotation, at, free), score
    return best


def fetch(mover: Mover, plan: Plan, box: Region) -> None:
    """Carry out a plan; the hand then opens over the box."""
    grasp = plan.grasp
    outside = plan.before - plan.into * (plan.before[1] + 0.02) / plan.into[1]
    mover.to(0.6, WAIT_AT, quat_of(plan.rotation), sigma=grasp.sigma_open)
    mover.to(0.6, outside)
    mover.to(IN_S, plan.before)
    mover.to(SINK_S, plan.at)
    mover.to(CLOSE_S, sigma=grasp.sigma_closed)
    mover.wait(SQUEEZE_S)
    mover.to(LIFT_S, plan.at + LIFT_M * UP)
    # Out, until the object is over the box's middle.
    x, y, _ = box.center + plan.at - plan.target.middle
    fling(mover, array([x, y, mover.position[2]]), speed_m_s=SPEED_M_S)
    mover.to(OPEN_S, sigma=0.0)
    mover.wait(FALL_S)
