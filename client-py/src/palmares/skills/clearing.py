"""Clearing a shelf with the SoftHand, at known object positions: push, rake, roll forward, tip over or fetch.

Between shelf and box is a gap of 15 cm. An object that leaves the shelf at less than 0.5 m/s falls into it;
at about 1 m/s it lands in the box. So the hand pulls objects out instead of carrying them. `attempt` makes
the first possible of these motions:

    push    Push an object at the opening, which cannot gain speed there, some centimetres into the shelf
    flat    Fetch a rolling object at the opening with the flat grasp
    rake    Put hooked fingers down behind an object and pull it out, with all objects in front of it
    drag    Roll a rolling object near the rear wall forward, to rake it later
    tip     Tip over a tall object at the rear wall, to rake it later
    fetch   Put the palm onto an object from above, close, lift a little and pull
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from palmares.rotation import rot_zyz
from palmares.scene import Region
from palmares.skills import fetching, pushing, raking, tipping
from palmares.skills.attempts import Attempt
from palmares.skills.motion import Mover
from palmares.skills.objects import ObjectBounds, Rolling

__all__ = ["DRAG", "RAKE", "attempt"]

RAKE = raking.RakeShape(
    rotation=rot_zyz(math.pi / 2, 1.6),
    hook=raking.boxes(
        (0.014, -0.049, 0.194, 0.069, -0.027, 0.217),  # little finger
        (0.014, -0.025, 0.195, 0.069, 0.041, 0.234),  # the others
    ),
    body=raking.boxes(
        (-0.033, -0.033, 0.000, 0.033, 0.033, 0.099),  # wrist
        (-0.022, -0.044, 0.071, 0.013, 0.048, 0.200),  # palm
        (-0.007, -0.048, 0.181, 0.025, 0.040, 0.230),  # roots of the fingers
    ),
    beside=raking.boxes(
        (-0.002, 0.029, 0.133, 0.042, 0.070, 0.183), (0.024, 0.060, 0.167, 0.054, 0.083, 0.201)
    ),
    kinds=("rake",),
    yaw_cost=0.25,
    depth_cost=0.2,
    front_cost=0.04,
    roll_cost=6.0,
)
"""The SoftHand with its fingers hooked (σ = 0.4)"""
DRAG = replace(RAKE, kinds=("drag",))
"""The same hand, to roll an object forward"""
FRONT_M = 0.07
"""Rolling objects with their middle this near to the opening are fetched first"""
FRONT_TRIES = 2
"""Attempts to fetch such an object"""
TIGHT_M = 0.01
"""Largest overlap of the hand with other objects in such an attempt"""
REAR_M = 0.2
"""Rolling objects with their middle farther in than this are rolled forward"""
DRAGS = 4
"""Attempts to roll an object forward from one position"""
PRESS_N = 6.0
"""Force of the fingers on an object that they roll forward"""
SIGMA_HOOKED, SIGMA_PULL = 0.4, 0.6
"""Motor commands of the hooked fingers, on their way down and in the pull"""
HOOK_S = 0.25
"""Duration of hooking the fingers"""
TOP_M = 0.957
"""Height of the base on its way in, close under the shelf's top"""
FLAT_Y_M = 0.51
"""Largest y of the base with straight fingers; beyond, they touch the rear wall"""
PULL_M_S = 2.0
"""Largest speed of a pull; the distance is hardly enough to reach it"""
END_Y_M = -0.05
"""y of the base at the end of a pull"""
MIN_SCORE = -0.1
"""Below this score of a rake other motions come first"""


def attempt(
    mover: Mover,
    objects: Sequence[ObjectBounds],
    regions: tuple[Region, Region],
    rolls: Rolling,
    attempts: Sequence[Attempt],
) -> Attempt | None:
    """Make the best possible attempt and return it; `None` if none is left.

    Args:
        mover: The mover of a SoftHand.
        objects: All objects, in the shelf or not.
        regions: The shelf, open towards -y, and the box in front of it.
        rolls: Rows of the objects that roll.
        attempts: All earlier attempts.

    """
    shelf, box = regions
    pushed = pushing.choose(objects, shelf, attempts, rolls)
    if pushed is not None:
        pushing.push(mover, pushed)
        return Attempt(pushed.target.index, pushed.target.middle, 0.0, "push")
    at_front = _rolling_between(objects, rolls, -math.inf, shelf.min[1] + FRONT_M)
    flat = fetching.choose(
        objects, shelf, attempts, grasps=fetching.GRASPS[:1], only=at_front, tries=FRONT_TRIES
    )
    if flat is not None and flat.room_m > -TIGHT_M:
        return _fetch(mover, flat, box)
    pull = raking.choose(objects, shelf, RAKE, attempts, rolls=rolls)
    if pull is not None and pull.score >= MIN_SCORE:
        return _rake(mover, pull)
    rear = _rolling_between(objects, rolls, shelf.min[1] + REAR_M, math.inf)
    drag = raking.choose(objects, shelf, DRAG, attempts, rolls=rolls, tries=DRAGS, only=rear)
    if drag is not None:
        return _rake(mover, drag)
    tall = tipping.choose(objects, shelf, attempts, rolls)
    if tall is not None:
        tipping.tip(mover, tall)
        return Attempt(tall.target.index, tall.target.middle, tall.yaw_rad, "tip")
    plan = fetching.choose(objects, shelf, attempts)
    if plan is not None:
        return _fetch(mover, plan, box)
    return None if pull is None else _rake(mover, pull)


def _rolling_between(
    objects: Sequence[ObjectBounds], rolls: Rolling, low_m: float, high_m: float
) -> set[int]:
    """Return the rows of rolling objects with their middle between two values of y."""
    return {found.index for found in objects if found.index in rolls and low_m < found.middle[1] < high_m}


def _fetch(mover: Mover, plan: fetching.Plan, box: Region) -> Attempt:
    """Grasp an object from above."""
    fetching.fetch(mover, plan, box)
    return Attempt(plan.target.index, plan.target.middle, plan.yaw_rad, plan.grasp.name)


def _rake(mover: Mover, plan: raking.RakePlan) -> Attempt:
    """Put the fingers down and pull an object out or forward."""
    raking.put_down(
        mover,
        plan,
        outside_y_m=0.0,
        flat_y_m=FLAT_Y_M,
        top_m=TOP_M,
        sigmas=(0.0, SIGMA_HOOKED),
        hook_s=HOOK_S,
    )
    if plan.kind == "rake":
        raking.rake(mover, plan, end_y_m=END_Y_M, sigma=SIGMA_PULL, speed_m_s=PULL_M_S)
    else:
        raking.drag(mover, plan, press_n=PRESS_N)
    return Attempt(plan.target.index, plan.target.middle, plan.yaw_rad, plan.kind)
