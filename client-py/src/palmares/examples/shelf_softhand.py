"""Move objects out of the shelf and into the box with the SoftHand: rake them if possible, else grasp them.

    python shelf_softhand.py --seed 7 --runs 3          # needs `palmares serve`, or --url local

The controller uses the true poses (sensing "truth"). The motions are in `palmares.skills.clearing`, with
constants to tune: the hand pulls objects out so fast that they fly over the gap between shelf and box. After
a failure it tries another way. Most lost objects fall next to the box; docs/controllers.md has the scores
over a hundred scenes.
"""

from __future__ import annotations

import contextlib
import logging
from dataclasses import dataclass

import palmares
from palmares.reproducible import norms
from palmares.skills import clearing
from palmares.skills.attempts import Attempt
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import object_bounds, rolling, truth_of
from palmares.skills.runs import Summary, play

LOG = logging.getLogger(__name__)

PICKS = 100
"""Attempts per run"""
STILL_M_S, LOOK_S, REST_S = 0.02, 0.1, 2.0
"""Speed below which an object is at rest; period of the check, and longest wait"""


@dataclass(frozen=True, kw_only=True)
class ShelfSummary(Summary):
    """Outcome of a run."""

    in_box: int
    outside: int
    """Objects that are neither in the shelf nor in the box at the end"""
    picks: int
    """Attempts made"""
    caught: int
    """Attempts after which the box had more objects"""
    left: list[str]
    """Objects left in the shelf"""


def rest(mover: Mover, shelf: palmares.Region) -> None:
    """Wait until all objects in the shelf are at rest, at most `REST_S`."""
    for _ in range(round(REST_S / LOOK_S)):
        truth = truth_of(mover.obs)
        inside = [shelf.contains(position) for position in truth.positions]
        if norms(truth.linear[inside]).max(initial=0.0) < STILL_M_S:
            return
        mover.wait(LOOK_S)


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts."""
    mover = Mover(client, client.reset("shelf", "softhand", sensing="truth", seed=seed))
    scene = client.scene
    shelf, box = scene.region("shelf"), scene.region("box")
    rolls = rolling(scene.free)
    attempts: list[Attempt] = []
    caught = 0

    def inside(region: palmares.Region) -> list[str]:
        return [found.name for found in object_bounds(scene, mover.obs) if region.contains(found.com)]

    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        while len(attempts) < picks:
            before = len(inside(box))
            rest(mover, shelf)
            objects = object_bounds(scene, mover.obs)
            tried = clearing.attempt(mover, objects, (shelf, box), rolls, attempts)
            if tried is None:
                break
            attempts.append(tried)
            after = len(inside(box))
            caught += after > before
            LOG.info(
                f"pick {len(attempts):2}: {scene.free[tried.index].name:28.28} {tried.grasp:6} "
                f"{after} in the box, {mover.obs.sim_time_s:6.1f} s simulated"
            )
        mover.wait(0.5)
    left = inside(shelf)
    result, summary = mover.stop()
    return ShelfSummary(
        **vars(summary),
        in_box=result.in_goal,
        outside=result.outside,
        picks=len(attempts),
        caught=caught,
        left=left,
    )


if __name__ == "__main__":
    play(run, __doc__)
