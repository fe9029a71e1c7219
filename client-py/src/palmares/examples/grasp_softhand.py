"""Grasp one object with the SoftHand, lift it, hold it through a shake. The first thing to try.

    python grasp_softhand.py --seed 1

The hand comes down on the object with its palm, fingers across the longer side, closes, lifts and waits. The
server then shakes it. If the object does not come along, or falls, the hand tries again with another grasp.
How the score is made up is in `tasks/grasp/task.toml`. Change the numbers of a grasp and see what it does.
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.motion import (
    UP,
    Array,
    Mover,
    ObjectBounds,
    RunOverError,
    Summary,
    TopGrasp,
    play,
    quat_of,
    truth_of,
    upright_box,
)

LOG = logging.getLogger(__name__)

# name, pitch, roll, above, aside, along, σ open, σ closed, sink; units as in `TopGrasp`
NARROW = TopGrasp("narrow", 1.6657, 0.3491, 0.0068, 0.0243, 0.1964, 0.0212, 0.9, 0.12)
WIDE = TopGrasp("wide", 1.7469, 0.1715, 0.0109, 0.0189, 0.2234, 0.0, 1.0, 0.12)
HIGH = TopGrasp("high", 1.4135, 0.1346, 0.0232, 0.0137, 0.1689, 0.0, 0.8641, 0.12)
STEEP = TopGrasp("steep", 1.7088, -0.3693, 0.0187, 0.0117, 0.1764, 0.0, 0.9539, 0.12)
LOOSE = TopGrasp("loose", 1.5586, -0.1036, 0.0226, 0.0357, 0.1726, 0.0492, 0.7668, 0.12)
ACROSS, ALONG = 0.0, math.pi / 2
"""Fingers across the object's longer side, or along it"""
COMPACT = [(NARROW, ACROSS), (WIDE, ACROSS), (NARROW, ALONG), (STEEP, ACROSS), (WIDE, ALONG)]
"""Grasps of a compact object, the most promising first"""
LONG = [(WIDE, ACROSS), (NARROW, ALONG), (LOOSE, ALONG), (STEEP, ALONG), (HIGH, ALONG)]
"""... of a long one"""
BROAD = [(WIDE, ACROSS), (HIGH, ACROSS), (LOOSE, ALONG), (WIDE, ALONG), (STEEP, ALONG)]
"""... of one that is broad even across its shorter side"""
TALL = [(WIDE, ACROSS), (HIGH, ALONG), (STEEP, ALONG), (HIGH, ACROSS), (WIDE, ALONG)]
"""... of a tall one"""
LONG_FROM = 1.5
"""Longer side by shorter side"""
BROAD_M, TALL_M = 0.085, 0.16
"""Shorter side, and height"""
LIFT_M = 0.16
"""How far the object is lifted"""
LIFTED_M = 0.08
"""An object that rose by this much is in the hand"""
TRIES = 8
"""Attempts per run"""


def grasps_for(size_m: Array) -> list[tuple[TopGrasp, float]]:
    """Return grasps and how they are turned for an object of this size: longer side, shorter side, height."""
    longer, shorter, height = size_m
    if height > TALL_M:
        return TALL
    if shorter > BROAD_M:
        return BROAD
    return LONG if longer > LONG_FROM * shorter else COMPACT


def attempt(mover: Mover, target: ObjectBounds, yaw_rad: float, grasp: TopGrasp) -> None:
    """Grasp, lift and hold the object until it falls; the run is over when it is held through the shake."""
    rotation = grasp.rotation(yaw_rad)
    at = grasp.base_position(target, rotation)
    mover.to(1.0, at + grasp.sink_m * UP, quat_of(rotation), sigma=grasp.sigma_open)
    mover.to(0.5, at)
    mover.to(0.6, sigma=grasp.sigma_closed)
    mover.wait(0.3)
    lowest_m = truth_of(mover.obs).positions[0, 2] + LIFTED_M
    mover.to(0.6, at + LIFT_M * UP)
    while truth_of(mover.obs).positions[0, 2] > lowest_m:
        mover.wait(0.1)
    mover.to(0.4, sigma=0.0)
    mover.to(0.6, mover.position + 0.1 * UP)
    mover.wait(0.5)  # Until it lies still.


@dataclass(frozen=True, kw_only=True)
class GraspSummary(Summary):
    """The outcome of a run."""

    object: str
    size_mm: list[int]
    """Sides of the box around it at the start: longer side, shorter side, height"""
    kept: int
    """1 if the object is still in the hand after the shake"""
    tries: int
    """Attempts made"""
    events: list[str]
    """What the referee recorded, and when"""


def run(
    client: palmares.Client,
    seed: int | None,
    task: str = "grasp",
    only: tuple[TopGrasp, float] | None = None,
) -> GraspSummary:
    """Play one run; `task` may be another of this kind, `only` the one grasp that is tried, and its turn."""
    mover = Mover(client, client.reset(task, "softhand", sensing="truth", seed=seed))
    first, _ = upright_box(client.scene, mover.obs, 0)
    tries = 0
    with contextlib.suppress(RunOverError):  # The shake is over.
        while tries < TRIES:
            target, yaw_rad = upright_box(client.scene, mover.obs, 0)
            grasps = grasps_for(target.size) if only is None else [only]
            grasp, turn_rad = grasps[tries % len(grasps)]
            tries += 1
            turned = "along" if turn_rad else "across"
            LOG.info(f"{target.name}, {np.round(1e3 * target.size)} mm: {grasp.name}, {turned}")
            attempt(mover, target, yaw_rad + turn_rad, grasp)
    result, summary = mover.stop()
    return GraspSummary(
        **vars(summary),
        object=first.name,
        size_mm=[round(1e3 * side) for side in first.size],
        kept=result.in_goal,
        tries=tries,
        events=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
    )


if __name__ == "__main__":
    play(run, __doc__)
