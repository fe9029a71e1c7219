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

from collections.abc import Sequence
from dataclasses import replace

import palmares
from palmares.arrays import array
from palmares.skills import raking
from palmares.skills.attempts import Attempt
from palmares.skills.objects import ObjectBounds
from palmares.skills.runs import play
from palmares.skills.shelf import PICKS, ShelfMover, ShelfSummary, play_shelf

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


class Reflex(ShelfMover):
    """σ moves fingers 1 and 2; finger 3 stays open, out of the way."""

    hand = "reflex"

    def command(self) -> list[float]:
        """Return σ of the four motors."""
        return [self.sigma, self.sigma, 0.0, 0.0]

    def attempt(self, objects: Sequence[ObjectBounds], attempts: Sequence[Attempt]) -> Attempt | None:
        """Make an attempt by the most careful possible way and return it; `None` if none is left."""
        for rank, shape in enumerate(RAKES, start=1):
            plan = raking.choose(objects, self.shelf, shape, attempts, rolls=self.rolls, tries=rank * TRIES)
            if plan is not None:
                self.do(plan)
                return Attempt(plan.target.index, plan.target.middle, plan.yaw_rad, plan.kind)
        return None

    def do(self, plan: raking.RakePlan) -> None:
        """Carry out a plan."""
        raking.put_down(
            self,
            plan,
            outside_y_m=OUTSIDE_Y_M,
            flat_y_m=FLAT_Y_M,
            top_m=TOP_M,
            sigmas=(0.0, SIGMA_HOOKED),
            hook_s=HOOK_S,
        )
        if plan.kind == "rake":
            raking.rake(self, plan, end_y_m=END_Y_M, sigma=SIGMA_HOOKED)
        else:
            raking.drag(self, plan, press_n=PRESS_N)


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts."""
    return play_shelf(Reflex, client, seed, picks)


if __name__ == "__main__":
    play(run, __doc__)
