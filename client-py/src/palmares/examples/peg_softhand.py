"""Put the peg into the hole of the block with the SoftHand, and let go of it.

    python peg_softhand.py --seed 1                     # needs `palmares serve`, or --url local

The hand grasps the upright peg from the side, fingers horizontal and thumb up, lifts it, aligns it and lowers
it at its estimate of the hole. It uses the true poses (sensing "truth"), but the estimate has an error of up
to `EYE_M`, as that of a camera would. This is more than the clearance of the hole: the hole's mouth leads the
tip in, and the compliant fingers give way, because the base does not.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import asin, cos, matmul, norm, sin
from palmares.rotation import matrix_of, quat_of
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import truth_of
from palmares.skills.runs import Summary, play

# --------------------------------------------------------------------------------------------------------
# Constants to tune

HAND = array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""World from hand, (3, 3): palm towards +x, thumb up, fingers towards -y"""
IN_HAND_M = array([0.035, -0.020, 0.172])
"""The peg's axis in the hand frame before the fingers close"""
GRIP_M = 0.055
"""Height of the hand over the peg's middle"""
ASIDE_M = 0.12
"""Distance from the peg at the begin of the approach"""
SIGMA = (0.18, 0.88)
"""Motor commands on the way to the peg and in the grasp"""
EYE_M = 0.003
"""Largest error of the estimate of the hole, in any horizontal direction"""
TIP_M = array([0.0, 0.0, -0.1])
"""The peg's tip, in the peg's frame"""
MOUTH_M = array([0.0, 0.0, 0.082])
"""Just over the hole, in the block's frame"""
SEAT_M = array([0.0, 0.0, 0.020])
"""Final position of the tip, in the block's frame"""
STEP_S = 0.1
"""Duration of a correction"""
SINK_M_S = 0.03
"""Speed at which the peg sinks"""
MAX_TURN_RAD = 0.03
"""Largest turn of the hand in a correction"""

# --------------------------------------------------------------------------------------------------------


def turn_to(axis: Array, wanted: Array, most_rad: float) -> Array:
    """Return the rotation (3, 3) that turns a unit vector towards another by at most `most_rad`."""
    normal = array(np.cross(axis, wanted))
    sine = norm(normal)
    if sine < 1e-6:
        return array(np.eye(3))
    x, y, z = normal / sine
    cross = array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle_rad = min(most_rad, asin(min(1.0, sine)))
    return array(np.eye(3) + sin(angle_rad) * cross + (1.0 - cos(angle_rad)) * matmul(cross, cross))


def grasp(mover: Mover) -> None:
    """Grasp the peg and lift it."""
    peg = truth_of(mover.obs).object("peg")
    at = peg.xyz + GRIP_M * UP - matmul(HAND, IN_HAND_M)
    before = at - ASIDE_M * HAND[:, 0]
    sigma_open, sigma_closed = SIGMA
    mover.to(1.0, before + 0.2 * UP, quat_of(HAND), sigma=sigma_open)
    mover.to(0.8, before)
    mover.to(0.8, at)
    mover.to(1.3, sigma=sigma_closed)
    mover.wait(0.3)
    mover.to(1.0, at + 0.12 * UP)


def correct(mover: Mover, tip_at: Array, seconds: float) -> None:
    """Move the peg's tip towards a point (3,), m, and turn the peg upright, from its present pose."""
    peg = truth_of(mover.obs).object("peg")
    turn = turn_to(peg.rotation[:, 2], UP, MAX_TURN_RAD)
    tip = peg.xyz + matmul(peg.rotation, TIP_M)
    # The base turns about the tip and moves by the tip's error.
    position = tip_at + matmul(turn, mover.position - tip)
    mover.to(seconds, position, quat_of(matmul(turn, matrix_of(mover.quat_xyzw))))


def insert(mover: Mover, off: Array) -> None:
    """Align the peg over the estimate of the hole, lower it, let go; `off` (3,), m, is the error."""
    block = truth_of(mover.obs).object("block")
    mouth, seat = (block.xyz + matmul(block.rotation, point) for point in (MOUTH_M, SEAT_M))
    mouth = mouth + off
    correct(mover, mouth + 0.05 * UP, 1.2)
    for _ in range(10):
        correct(mover, mouth + 0.01 * UP, STEP_S)
    # 8 mm farther than the peg can go.
    depth_m = 0.01 + float(mouth[2] - seat[2]) + 0.008
    mover.to(depth_m / SINK_M_S, mover.position - depth_m * UP)
    mover.wait(0.3)
    mover.to(0.6, sigma=0.0)
    mover.to(0.8, mover.position - 0.25 * HAND[:, 0])
    mover.wait(1.0)


@dataclass(frozen=True, kw_only=True)
class PegSummary(Summary):
    """Outcome of a run."""

    goals: list[str]
    """Reached goals, with their times"""
    off_mm: float
    """Error of the estimate of the hole"""


def run(client: palmares.Client, seed: int | None) -> PegSummary:
    """Play one run."""
    mover = Mover(client, client.reset("peg", "softhand", sensing="truth", seed=seed))
    rng = np.random.default_rng(client.run.seed)
    off_m, side_rad = EYE_M * math.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * math.pi)
    off = array([off_m * cos(side_rad), off_m * sin(side_rad), 0.0])
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        grasp(mover)
        insert(mover, off)
    result, summary = mover.stop()
    return PegSummary(
        **vars(summary),
        goals=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
        off_mm=round(1e3 * off_m, 2),
    )


if __name__ == "__main__":
    play(run, __doc__)
