"""Grasp one object with the SoftHand, lift it, hold it through a shake. The first thing to try.

    python grasp_softhand.py --seed 1

The hand comes down on the object with its palm, fingers across the longer side, closes, lifts and waits. The
server then shakes it. If the object does not come along, or falls, the hand tries again with another grasp.
How the score is made up is in `tasks/grasp/task.toml`. Change the numbers in `GRASPS` and see what it does.
"""

from __future__ import annotations

import contextlib
import logging
from dataclasses import dataclass

import palmares
from palmares.motion import (
    UP,
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

GRASPS = [
    # name, pitch, roll, above, aside, along, σ open, σ closed, sink; units as in `TopGrasp`
    TopGrasp("narrow", 1.6657, 0.3491, 0.0068, 0.0243, 0.1964, 0.0212, 0.9, 0.12),
    TopGrasp("wide", 1.7469, 0.1715, 0.0109, 0.0189, 0.2234, 0.0, 1.0, 0.12),
]
WIDE_M = 0.085
"""From this width on an object is taken with the wide grasp first"""
LIFT_M = 0.16
"""How far the object is lifted"""
LIFTED_M = 0.08
"""An object that rose by this much is in the hand"""
TRIES = 6
"""Attempts per run"""


def order(target: ObjectBounds) -> list[TopGrasp]:
    """Return the grasps, the most promising first."""
    narrow, wide = GRASPS
    return [wide, narrow] if target.high[1] - target.low[1] > WIDE_M else [narrow, wide]


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
    kept: int
    """1 if the object is still in the hand after the shake"""
    tries: int
    """Attempts made"""
    events: list[str]
    """What the referee recorded, and when"""


def run(client: palmares.Client, seed: int | None) -> GraspSummary:
    """Play one run."""
    mover = Mover(client, client.reset("grasp", "softhand", sensing="truth", seed=seed))
    tries = 0
    with contextlib.suppress(RunOverError):  # The shake is over.
        while tries < TRIES:
            target, yaw_rad = upright_box(client.scene, mover.obs, 0)
            grasp = order(target)[tries % len(GRASPS)]
            tries += 1
            LOG.info(f"{target.name}: {grasp.name}")
            attempt(mover, target, yaw_rad, grasp)
    result, summary = mover.stop()
    return GraspSummary(
        **vars(summary),
        object=client.scene.free[0].name,
        kept=result.in_goal,
        tries=tries,
        events=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
    )


if __name__ == "__main__":
    play(run, __doc__)
