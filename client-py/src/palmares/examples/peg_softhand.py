"""Put the peg into the hole of the block with the SoftHand, and let go of it.

    python peg_softhand.py --seed 1

The hand takes the standing peg from the side, fingers level and thumb up, lifts it, stands it upright and
lowers it where it believes the hole to be. It sees the true poses (sensing "truth"), but its belief of the
hole is off by up to `EYE_M`, as what a camera tells would be. That is more than the hole's play: the hole's
mouth leads the tip in, and the fingers must give way, for the base does not.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.rotation import matrix_of, quat_of
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import truth_of
from palmares.skills.runs import Summary, play

# --------------------------------------------------------------------------------------------------------
# What to tune

HAND = array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""World from hand, (3, 3): palm towards +x, thumb up, fingers towards -y"""
IN_HAND_M = array([0.035, -0.020, 0.172])
"""The peg's axis in the hand frame before the fingers close"""
GRIP_M = 0.055
"""Height of the hand over the peg's middle"""
ASIDE_M = 0.12
"""The hand comes from so far before the peg"""
SIGMA = (0.18, 0.88)
"""Motor command on the way to the peg, and when it is held"""
EYE_M = 0.003
"""How far off the hand's belief of the hole may be, to any side"""
TIP_M = array([0.0, 0.0, -0.1])
"""In the peg's frame"""
MOUTH_M = array([0.0, 0.0, 0.082])
"""Just over the hole, in the block's frame"""
SEAT_M = array([0.0, 0.0, 0.020])
"""Where the tip ends, in the block's frame"""
STEP_S = 0.1
SINK_M_S = 0.03
"""How fast the peg is lowered"""
FURTHEST_TURN_RAD = 0.03
"""How far the hand turns in each step"""

# --------------------------------------------------------------------------------------------------------


def turn_to(axis: Array, wanted: Array, most_rad: float) -> Array:
    """Return the rotation (3, 3) that takes a unit vector towards another by at most `most_rad`."""
    normal = array(np.cross(axis, wanted))
    sine = float(np.linalg.norm(normal))
    if sine < 1e-6:
        return array(np.eye(3))
    x, y, z = normal / sine
    cross = array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle_rad = min(most_rad, math.asin(min(1.0, sine)))
    return array(np.eye(3) + math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * cross @ cross)


def grasp(mover: Mover) -> None:
    """Take the peg where it stands and lift it."""
    peg = truth_of(mover.obs).object("peg")
    at = peg.xyz + GRIP_M * UP - HAND @ IN_HAND_M
    before = at - ASIDE_M * HAND[:, 0]
    sigma_open, sigma_closed = SIGMA
    mover.to(1.0, before + 0.2 * UP, quat_of(HAND), sigma=sigma_open)
    mover.to(0.8, before)
    mover.to(0.8, at)
    mover.to(0.8, sigma=sigma_closed)
    mover.wait(0.3)
    mover.to(0.8, at + 0.12 * UP)


def correct(mover: Mover, tip_at: Array, seconds: float) -> None:
    """Bring the peg's tip towards a point (3,), m, and the peg upright, by what is seen of it now."""
    peg = truth_of(mover.obs).object("peg")
    turn = turn_to(peg.rotation[:, 2], UP, FURTHEST_TURN_RAD)
    tip = peg.xyz + peg.rotation @ TIP_M
    # The base turns about the tip and moves by what the tip is off.
    position = tip_at + turn @ (mover.position - tip)
    mover.to(seconds, position, quat_of(turn @ matrix_of(mover.quat_xyzw)))


def insert(mover: Mover, off: Array) -> None:
    """Stand the peg over where the hole is believed to be, `off` (3,), m, beside it; lower it, let go."""
    block = truth_of(mover.obs).object("block")
    mouth, seat = block.xyz + block.rotation @ MOUTH_M + off, block.xyz + block.rotation @ SEAT_M
    correct(mover, mouth + 0.05 * UP, 1.2)
    for _ in range(10):
        correct(mover, mouth + 0.01 * UP, STEP_S)
    # A little farther than the peg can go.
    depth_m = 0.01 + float(mouth[2] - seat[2]) + 0.008
    mover.to(depth_m / SINK_M_S, mover.position - depth_m * UP)
    mover.wait(0.3)
    mover.to(0.6, sigma=0.0)
    mover.to(0.8, mover.position - 0.25 * HAND[:, 0])
    mover.wait(1.0)


@dataclass(frozen=True, kw_only=True)
class PegSummary(Summary):
    """The outcome of a run."""

    goals: list[str]
    """What was reached, and when"""
    off_mm: float
    """How far off the hand's belief of the hole was"""


def run(client: palmares.Client, seed: int | None) -> PegSummary:
    """Play one run."""
    mover = Mover(client, client.reset("peg", "softhand", sensing="truth", seed=seed))
    rng = np.random.default_rng(client.run.seed)
    off_m, side_rad = EYE_M * math.sqrt(rng.uniform()), rng.uniform(0.0, 2.0 * math.pi)
    off = array([off_m * math.cos(side_rad), off_m * math.sin(side_rad), 0.0])
    with contextlib.suppress(RunOverError):  # Complete, or out of time: the result says which.
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
