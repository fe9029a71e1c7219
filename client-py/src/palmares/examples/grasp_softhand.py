"""Grasp one object with the SoftHand, lift it, hold it through a shake: a good first example.

    python grasp_softhand.py --seed 1                   # needs `palmares serve`, or --url local

The hand comes down on the object with its palm, fingers across the longer side, closes, lifts and waits. It
grasps a tall and slim object from the side. The server then shakes it. If the object stays on the table or
falls, the hand tries another grasp. `tasks/grasp/task.toml` defines the score. Change the numbers of a grasp
and see their effect.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Callable, Sequence

import numpy as np

import palmares
from palmares.arrays import Array
from palmares.rotation import quat_of
from palmares.skills.cookbook import BALL, NARROW, SIDE, STANDING
from palmares.skills.grasps import SideGrasp, TopGrasp
from palmares.skills.holding import GraspSummary, grasp_summary, lift_and_hold
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import ObjectBounds, upright_box
from palmares.skills.runs import play

LOG = logging.getLogger(__name__)

Grasp = TopGrasp | SideGrasp

# name, pitch, roll, above, aside, along, σ open, σ closed, sink; units as in `TopGrasp`
FLAT = TopGrasp("flat", 1.6182, 0.3491, 0.0068, 0.0264, 0.1876, 0.0212, 0.9, 0.12)
WIDE = TopGrasp("wide", 1.7469, 0.1715, 0.0109, 0.0189, 0.2234, 0.0, 1.0, 0.12)
HIGH = TopGrasp("high", 1.4135, 0.1346, 0.0232, 0.0137, 0.1689, 0.0, 0.8641, 0.12)
STEEP = TopGrasp("steep", 1.7088, -0.3693, 0.0187, 0.0117, 0.1764, 0.0, 0.9539, 0.12)
LOOSE = TopGrasp("loose", 1.5586, -0.1036, 0.0226, 0.0357, 0.1726, 0.0492, 0.7668, 0.12)
FIRM = TopGrasp("firm", 1.7931, 0.1371, 0.0065, 0.0085, 0.223, 0.0, 1.0, 0.12)
DEEP = TopGrasp("deep", 1.732, 0.0591, -0.0227, 0.0451, 0.2217, 0.01, 0.9493, 0.12)
LOW = TopGrasp("low", 1.5416, 0.1583, -0.0193, 0.0335, 0.1697, 0.2159, 0.9286, 0.12)
TILTED = TopGrasp("tilted", 1.9271, -0.0653, 0.0071, 0.0167, 0.1946, 0.0432, 0.9653, 0.12)
ROLLED = TopGrasp("rolled", 1.8662, 0.7226, -0.0123, 0.031, 0.2102, 0.1107, 0.8157, 0.12)
RIM = TopGrasp("rim", 1.3616, 0.0934, 0.004, -0.0925, 0.1349, 0.0464, 0.8276, 0.12)
CAN = TopGrasp("can", 1.8114, -0.008, 0.0048, 0.0144, 0.2204, 0.024, 1.0, 0.12)
ACROSS, ALONG, OBLIQUE, BACK = 0.0, math.pi / 2, 1.195, -2.33
"""Turns of the hand, rad: fingers across the object's longer side, along it, or in between from two sides"""
AGAINST = -0.12
"""Turn of a grasp from the side: fingers along the object's longer side"""
COMPACT = [(NARROW, ACROSS), (WIDE, ACROSS), (NARROW, ALONG), (STEEP, ACROSS), (WIDE, ALONG)]
"""Grasps of a compact object, the best first, each with its turn"""
UPRIGHT = [(STANDING, -0.1), (WIDE, ACROSS), (NARROW, ALONG)]
"""Grasps of a compact object that stands upright"""
LONG = [(WIDE, ACROSS), (NARROW, ALONG), (LOOSE, ALONG), (STEEP, ALONG)]
"""Grasps of a long object"""
THIN = [(FLAT, ACROSS), (LOW, BACK), (FLAT, ALONG), (LOW, ALONG), (STEEP, ALONG)]
"""Grasps of a thin object"""
THIN_AND_LONG = [(FLAT, ALONG), (LOW, ALONG), (WIDE, ACROSS), (LOW, BACK), (FLAT, ACROSS)]
"""Grasps of a thin and long object"""
BROAD = [(WIDE, ACROSS), (HIGH, ACROSS), (LOOSE, ALONG), (WIDE, ALONG), (STEEP, ALONG)]
"""Grasps of an object that is broad even across its shorter side"""
BROAD_UPRIGHT = [(CAN, -0.056), (WIDE, ACROSS), (WIDE, ALONG)]
"""Grasps of a broad object that stands upright"""
BROAD_ROUND = [(BALL, -0.04), (WIDE, ACROSS), (HIGH, ACROSS)]
"""Grasps of a broad object as high as it is long"""
SLIM: list[tuple[Grasp, float]] = [(SIDE, AGAINST), (NARROW, ACROSS), (WIDE, ACROSS)]
"""Grasps of a tall and slim object"""
TALL = [(WIDE, ACROSS), (HIGH, ACROSS), (STEEP, ALONG)]
"""Grasps of a tall object"""
TALL_AND_LONG = [(TILTED, OBLIQUE), (NARROW, ACROSS), (STEEP, ALONG), (WIDE, ACROSS)]
"""Grasps of a tall and long object"""
HEAVY = [(FIRM, ACROSS), (STEEP, ALONG), (WIDE, ACROSS)]
"""Grasps of a tall and heavy object"""
HEAVIER = [(DEEP, -0.143), (FIRM, ACROSS), (WIDE, ACROSS)]
"""Grasps of a tall and very heavy object"""
LARGE = [(ROLLED, ACROSS), (WIDE, ACROSS)]
"""Grasps of a large ball"""
DRILL = [(STEEP, ALONG), (WIDE, ACROSS)]
"""Grasps of a tall and very long object"""
PLATE = [(RIM, -ALONG), (LOOSE, ACROSS)]
"""Grasps of an object at its rim"""
ROUND_FROM, UPRIGHT_FROM = 0.9, 1.25
"""Ratios of the height to the longer side from which an object is as high as long, or stands upright"""
LONG_FROM, DRILL_FROM = 1.9, 3.5
"""Ratios of the longer to the shorter side from which an object is long or very long"""
SLIM_M, BROAD_M, LARGE_M, PLATE_M = 0.065, 0.085, 0.12, 0.24
"""Lengths of the shorter side: above them a tall object is not slim, others are broad, large, a plate"""
TALL_M, THIN_M = 0.16, 0.033
"""Heights from which an object is tall, and below which it is thin"""
TINY_M = 0.04
"""Length of the longer side up to which an object is never thin"""
HEAVY_KG, HEAVIER_KG = 1.0, 1.1
"""Masses from which a tall object is heavy or very heavy"""
CLOSE_S, LIFT_S = 1.2, 1.2
"""Durations of the closing, for which the motor needs 1.1 s, and of the lift, in which it still tightens"""
TRIES = 8
"""Attempts per run"""


def grasps_for(size_m: Array, mass_kg: float) -> Sequence[tuple[Grasp, float]]:
    """Return grasps and their turns for an object: longer side, shorter side and height, m; mass, kg."""
    longer, shorter, height = size_m
    ratio = longer / shorter
    if height > TALL_M and mass_kg > HEAVY_KG:
        return HEAVIER if mass_kg > HEAVIER_KG else HEAVY
    if height > TALL_M:
        if ratio > LONG_FROM:
            return DRILL if ratio > DRILL_FROM else TALL_AND_LONG
        return TALL if shorter > SLIM_M else SLIM
    if height < THIN_M and longer > TINY_M:
        return PLATE if shorter > PLATE_M else THIN_AND_LONG if ratio > LONG_FROM else THIN
    if shorter > BROAD_M:
        if shorter > LARGE_M and height > LARGE_M:
            return LARGE
        if height > ROUND_FROM * longer:
            return BROAD_UPRIGHT if height > UPRIGHT_FROM * longer else BROAD_ROUND
        return BROAD
    if ratio > LONG_FROM:
        return LONG
    return UPRIGHT if height > UPRIGHT_FROM * longer else COMPACT


def attempt(mover: Mover, target: ObjectBounds, yaw_rad: float, grasp: Grasp) -> None:
    """Grasp, lift and hold the object; the run is over after the shake."""
    rotation = grasp.rotation(yaw_rad)
    at = grasp.base_position(target, rotation)
    for position in grasp.way_in(at, rotation):
        mover.to(0.8, position, quat_of(rotation), sigma=grasp.sigma_open)
    mover.to(0.5, at)
    mover.to(CLOSE_S, sigma=grasp.sigma_closed)
    lift_and_hold(mover, at, LIFT_S)


def run(
    client: palmares.Client,
    seed: int | None,
    task: str = "grasp",
    only: tuple[Grasp, float] | None = None,
    hand: str = "softhand",
) -> GraspSummary:
    """Play one run.

    `task` may be another with one object, `only` a single grasp to try, and its turn; `hand` may be
    `softhand_skin`.
    """
    return keep_trying(Mover(client, client.reset(task, hand, sensing="truth", seed=seed)), attempt, only)


def keep_trying(
    mover: Mover,
    attempt: Callable[[Mover, ObjectBounds, float, Grasp], None],
    only: tuple[Grasp, float] | None = None,
) -> GraspSummary:
    """Make attempts until the run is over, with one grasp after another, or with a single one."""
    client = mover.client
    first, _ = upright_box(client.scene, mover.obs, 0)
    tries = 0
    with contextlib.suppress(RunOverError):  # The shake is over.
        while tries < TRIES:
            target, yaw_rad = upright_box(client.scene, mover.obs, 0)
            grasps = [only] if only else grasps_for(target.size, client.scene.free[0].mass)
            grasp, turn_rad = grasps[tries % len(grasps)]
            tries += 1
            LOG.info(
                f"{target.name}, {np.round(target.size, 3)} m: {grasp.name}, turned by {turn_rad:.2f} rad"
            )
            attempt(mover, target, yaw_rad + turn_rad, grasp)
    return grasp_summary(mover, first, tries)


if __name__ == "__main__":
    play(run, __doc__)
