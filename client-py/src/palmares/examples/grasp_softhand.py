"""Grasp one object with the SoftHand, lift it, hold it through a shake. The first thing to try.

    python grasp_softhand.py --seed 1

The hand comes down on the object with its palm, closes, lifts and waits. The server then shakes it. How the
score is made up is in `tasks/grasp/task.toml`. Change the numbers in `GRASP` and see how the score changes.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import palmares
from palmares.motion import UP, Mover, RunOverError, Summary, TopGrasp, object_bounds, play, quat_of

GRASP = TopGrasp(
    name="flat",
    pitch_rad=1.6182,
    roll_rad=0.3491,
    above_m=0.0068,
    aside_m=0.0264,
    along_m=0.1876,
    sigma_open=0.0212,
    sigma_closed=0.9,
    sink_m=0.12,
)
LIFT_M = 0.16
"""How far the object is lifted"""


@dataclass(frozen=True, kw_only=True)
class GraspSummary(Summary):
    """The outcome of a run."""

    object: str
    kept: int
    """1 if the object is still in the hand after the shake"""
    events: list[str]
    """What the referee recorded, and when"""


def run(client: palmares.Client, seed: int | None, grasp: TopGrasp = GRASP) -> GraspSummary:
    """Play one run."""
    obs = client.reset("grasp", "softhand", sensing="truth", seed=seed)
    (target,) = object_bounds(client.scene, obs)
    # The fingers lie across the object's longer side.
    width, depth, _ = target.high - target.low
    rotation = grasp.rotation(0.0 if width >= depth else math.pi / 2)
    at = grasp.base_position(target, rotation)

    mover = Mover(client, obs)
    with contextlib.suppress(RunOverError):  # The shake is over.
        mover.to(1.0, at + grasp.sink_m * UP, quat_of(rotation), sigma=grasp.sigma_open)
        mover.to(0.5, at)
        mover.to(0.6, sigma=grasp.sigma_closed)
        mover.wait(0.3)
        mover.to(0.6, at + LIFT_M * UP)
        mover.wait(10.0)
    result, summary = mover.stop()
    return GraspSummary(
        **vars(summary),
        object=target.name,
        kept=result.in_goal,
        events=[f"{event.kind} at {event.tick * client.run.tick_s:.2f} s" for event in result.events],
    )


if __name__ == "__main__":
    play(run, __doc__)
