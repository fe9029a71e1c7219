"""Lift the lid off the pan with the SoftHand, put it aside, lift the pan by its handle.

    python pan_softhand.py --seed 1                     # needs `palmares serve`, or --url local

The hand comes down on the lid's knob with its palm, closes, lifts, carries the lid to the region `aside` and
lets it go. Then it grasps the handle across its palm and lifts the pan. It uses the true poses (sensing
"truth").
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.arrays import array
from palmares.reproducible import acos, atan2, cos, matmul, norm, sin
from palmares.rotation import quat_of
from palmares.skills.cookbook import KNOB
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import ObjectBounds, truth_of
from palmares.skills.runs import Summary, play

# --------------------------------------------------------------------------------------------------------
# Constants to tune

KNOB_M = array([0.0, 0.0, 0.052])
"""The knob's centre in the lid's frame"""
KNOB_RADIUS_M = 0.025
LID_LIFT_M = 0.10
PUT_AT = array([-0.05, -0.36, 0.010])
"""Position of the lid's frame when the hand opens, m"""

HANDLE_M = array([0.250, 0.0, 0.0624])
"""Point of the grasp on the handle, in the pan's frame"""
HANDLE_SLOPE_RAD = atan2(0.030, 0.190)
IN_PALM_M = array([0.032, -0.007, 0.182])
"""The handle's axis in the hand frame when the fingers close"""
HANDLE_SIGMA = (0.05, 1.0)
"""Motor commands on the way to the handle and in the grasp"""
PAN_LIFT_M = 0.27
"""The pan hangs from its handle: a hand of 20 N does not hold it level"""

# --------------------------------------------------------------------------------------------------------


def put_lid_aside(mover: Mover) -> None:
    """Grasp the lid by its knob and let it go in the region `aside`."""
    lid = truth_of(mover.obs).object("lid")
    knob = lid.xyz + matmul(lid.rotation, KNOB_M)
    ball = ObjectBounds(lid.id, "knob", knob - KNOB_RADIUS_M, knob + KNOB_RADIUS_M, knob)
    rotation = KNOB.rotation(0.0)
    at = KNOB.base_position(ball, rotation)
    mover.to(1.0, at + KNOB.sink_m * UP, quat_of(rotation), sigma=KNOB.sigma_open)
    mover.to(0.6, at)
    mover.to(1.4, sigma=KNOB.sigma_closed)
    mover.wait(0.4)
    mover.to(1.4, at + LID_LIFT_M * UP)
    mover.wait(0.2)
    target = mover.position + PUT_AT - truth_of(mover.obs).object("lid").xyz
    mover.to(1.5, array([target[0], target[1], mover.position[2]]))
    # As low as the lid's lowest point allows; the lid may be tilted.
    held = truth_of(mover.obs).object("lid")
    tilt_rad = acos(min(1.0, abs(float(held.rotation[2, 2]))))
    down = PUT_AT[2] + 0.134 * sin(tilt_rad) - held.xyz[2]
    mover.to(1.0, mover.position + down * UP)
    mover.to(1.0, sigma=0.0)
    mover.wait(0.4)
    mover.to(0.8, mover.position + 0.25 * UP)


def lift_pan(mover: Mover) -> None:
    """Grasp the pan by its handle, across the palm, and lift it."""
    pan = truth_of(mover.obs).object("pan")
    along = matmul(pan.rotation, [cos(HANDLE_SLOPE_RAD), 0.0, sin(HANDLE_SLOPE_RAD)])
    fingers = array(np.cross(along, UP))
    fingers /= norm(fingers)
    rotation = array(np.column_stack([np.cross(along, fingers), along, fingers]))
    at = pan.xyz + matmul(pan.rotation, HANDLE_M) - matmul(rotation, IN_PALM_M)
    sigma_open, sigma_closed = HANDLE_SIGMA
    mover.to(1.2, at + 0.15 * UP, quat_of(rotation), sigma=sigma_open)
    mover.to(0.8, at)
    mover.to(1.4, sigma=sigma_closed)
    mover.wait(0.6)
    mover.to(4.0, at + PAN_LIFT_M * UP)
    mover.wait(4.0)


@dataclass(frozen=True, kw_only=True)
class PanSummary(Summary):
    """Outcome of a run."""

    goals: list[str]
    """Reached goals, with their times"""


def run(client: palmares.Client, seed: int | None) -> PanSummary:
    """Play one run."""
    mover = Mover(client, client.reset("pan", "softhand", sensing="truth", seed=seed))
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        put_lid_aside(mover)
        lift_pan(mover)
    result, summary = mover.stop()
    return PanSummary(
        **vars(summary),
        goals=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
    )


if __name__ == "__main__":
    play(run, __doc__)
