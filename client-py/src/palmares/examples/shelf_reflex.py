"""Rake objects out of the shelf with the ReFlex, into the box in front of it.

    python shelf_reflex.py --seed 7 --runs 3            # needs `palmares serve`, or --url local

The hand does not hold the objects. It goes in over them, palm down, hooks two fingers behind one of them and
pulls it out, with all objects in front of it, fast enough to fly over the gap between shelf and box:

    in front of the shelf -> in at the top -> hook the fingers -> down behind the object -> pull

If the fingers do not fit behind an object, they press it down and pull it forward first. The controller uses
the true poses (sensing "truth"); `palmares.skills.raking` finds the place for the fingers. It leaves objects
that are too tall for the hand above them; a grasp from the front would be needed. With the seeds 5051 to 5100
the mean score was 37.0 of 50; of the ten objects 1.2 fell next to the box and 1.4 stayed in the shelf.
"""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import palmares
from palmares.arrays import array
from palmares.skills import raking
from palmares.skills.attempts import Attempt
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import ObjectBounds, Rolling, object_bounds, rolling
from palmares.skills.runs import Summary, play

LOG = logging.getLogger(__name__)

# --------------------------------------------------------------------------------------------------------
# Constants to tune

RAKE = raking.RakeShape(
    rotation=array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    hook=raking.boxes(
        (0.047, -0.033, 0.100, 0.086, -0.019, 0.194),  # finger 1
        (0.047, 0.019, 0.100, 0.086, 0.033, 0.194),  # finger 2
    ),
    body=raking.boxes(
        (-0.055, -0.053, 0.000, 0.083, 0.053, 0.083),  # housing and palm
        (-0.143, -0.007, 0.037, -0.016, 0.007, 0.096),  # finger 3, open
        (0.033, -0.044, 0.063, 0.087, 0.044, 0.100),  # joints of fingers 1 and 2
    ),
)
"""The ReFlex with two fingers hooked (σ = 0.55)"""
RAKES = (
    RAKE,
    replace(
        RAKE,
        yaws_rad=(0.0, 0.15, -0.15, 0.5, -0.5),
        asides_m=(0.0, 0.03, -0.03, 0.055, -0.055),
        behind_m=0.025,
        above_m=0.002,
        bite_m=0.01,
    ),
    replace(RAKE, yaws_rad=(0.0, 0.3, -0.3, 0.7, -0.7), behind_m=0.0, above_m=-0.01, bite_m=0.03),
)
"""Ways to rake, the most careful first; the last one may touch other objects"""
TRIES = 5
"""Attempts on an object at one position, for each of these ways"""
SIGMA_HOOKED = 0.55
"""Motor command of the hooked fingers"""
HOOK_S = 0.8
"""Duration of hooking the fingers"""
TOP_M = 0.992
"""Height of the base on its way in, close under the shelf's top"""
OUTSIDE_Y_M = 0.0
"""y of the base before it goes in"""
FLAT_Y_M = 0.61
"""Largest y of the base with straight fingers; beyond, they touch the rear wall"""
END_Y_M = -0.05
"""y of the base at the end of a pull"""
PRESS_N = 25.0
"""Force on an object that is pulled forward"""
PICKS = 100
"""Attempts per run"""


class Reflex(Mover):
    """σ moves fingers 1 and 2; finger 3 stays open, out of the way."""

    def command(self) -> list[float]:
        """Return σ of the four motors."""
        return [self.sigma, self.sigma, 0.0, 0.0]


@dataclass(frozen=True, kw_only=True)
class ShelfSummary(Summary):
    """Outcome of a run."""

    in_box: int
    outside: int
    """Objects that are neither in the shelf nor in the box at the end"""
    picks: int
    """Attempts made"""
    left: list[str]
    """Objects left in the shelf"""


def choose(
    objects: Sequence[ObjectBounds],
    shelf: palmares.Region,
    attempts: Sequence[Attempt],
    rolls: Rolling,
) -> raking.RakePlan | None:
    """Return the next plan, by the most careful possible way; `None` if no object is left to try."""
    for rank, shape in enumerate(RAKES, start=1):
        plan = raking.choose(objects, shelf, shape, attempts, rolls=rolls, tries=rank * TRIES)
        if plan is not None:
            return plan
    return None


def do(mover: Reflex, plan: raking.RakePlan) -> None:
    """Carry out a plan."""
    raking.put_down(
        mover,
        plan,
        outside_y_m=OUTSIDE_Y_M,
        flat_y_m=FLAT_Y_M,
        top_m=TOP_M,
        sigmas=(0.0, SIGMA_HOOKED),
        hook_s=HOOK_S,
    )
    if plan.kind == "rake":
        raking.rake(mover, plan, end_y_m=END_Y_M, sigma=SIGMA_HOOKED)
    else:
        raking.drag(mover, plan, press_n=PRESS_N)


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts."""
    mover = Reflex(client, client.reset("shelf", "reflex", sensing="truth", seed=seed))
    scene = client.scene
    shelf, box = scene.region("shelf"), scene.region("box")
    rolls = rolling(scene.free)
    attempts: list[Attempt] = []

    def inside(region: palmares.Region) -> list[str]:
        return [found.name for found in object_bounds(scene, mover.obs) if region.contains(found.com)]

    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        while len(attempts) < picks:
            plan = choose(object_bounds(scene, mover.obs), shelf, attempts, rolls)
            if plan is None:
                break
            target = plan.target
            attempts.append(Attempt(target.index, target.middle, plan.yaw_rad, plan.kind))
            do(mover, plan)
            LOG.info(
                f"pick {len(attempts):2}: {plan.kind} {target.name:28.28} {len(inside(box))} in the box, "
                f"{mover.obs.sim_time_s:6.1f} s simulated"
            )
        mover.wait(0.5)
    left = inside(shelf)
    result, summary = mover.stop()
    return ShelfSummary(
        **vars(summary),
        in_box=result.in_goal,
        outside=result.outside,
        picks=len(attempts),
        left=left,
    )


if __name__ == "__main__":
    play(run, __doc__)
