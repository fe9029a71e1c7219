"""Lift a grasped object and hold it through the shake of the task `grasp`; what came of the run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from palmares.arrays import Array
from palmares.skills.motion import UP, Mover
from palmares.skills.objects import ObjectBounds, truth_of
from palmares.skills.runs import Summary

__all__ = [
    "GraspSummary",
    "grasp_summary",
    "lift_and_hold",
]

LIFT_M = 0.18
"""Height of the lift"""
LIFTED_M = 0.08
"""An object that rose by more than this is in the hand"""
PATIENCE_S = 8.0
"""Longest hold; holding and shaking take 5 s, unless the object slips"""


def lift_and_hold(mover: Mover, at: Array, lift_s: float = 0.6) -> None:
    """Lift the closed hand from `at` (3,), m, and wait while object 0 is in it; then open.

    A motor that its load slows tightens the grasp during a lift of more than the default `lift_s`.

    The run is over after the shake (`RunOverError`). This returns if the object was not lifted, or fell.
    """
    mover.wait(0.3)
    lowest_m = truth_of(mover.obs).positions[0, 2] + LIFTED_M
    mover.to(lift_s, at + LIFT_M * UP)
    for _ in range(math.ceil(PATIENCE_S / 0.1)):
        if truth_of(mover.obs).positions[0, 2] < lowest_m:
            break
        mover.wait(0.1)
    mover.to(0.4, sigma=0.0)
    mover.to(0.6, mover.position + 0.1 * UP)
    mover.wait(0.5)  # Until the object is at rest.


@dataclass(frozen=True, kw_only=True)
class GraspSummary(Summary):
    """Outcome of a run of the task `grasp`."""

    hand: str
    object: str
    size_mm: list[int]
    """Sides of the object's bounding box at the start: longer side, shorter side, height"""
    kept: int
    """1 if the object is still in the hand after the shake"""
    tries: int
    """Attempts made"""
    events: list[str]
    """Events of the referee, with their times"""


def grasp_summary(mover: Mover, first: ObjectBounds, tries: int) -> GraspSummary:
    """Stop the run; `first` is the object at its start."""
    result, summary = mover.stop()
    client = mover.client
    return GraspSummary(
        **vars(summary),
        hand=client.run.hand,
        object=first.name,
        size_mm=[round(1e3 * side) for side in first.size],
        kept=result.in_goal,
        tries=tries,
        events=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
    )
