"""Grasp one object with any built-in hand, lift it, hold it through a shake.

    python -m palmares.examples.grasp --hand yale_t42 --seed 1    # needs `palmares serve`, or --url local

The hand comes down on the object, closes, lifts and waits. The server then shakes it. If the object stays on
the table or falls, the hand tries again, turned or higher. `palmares.skills.recipes` has the numbers of each
hand; the SoftHand plays `grasp_softhand`.
"""

from __future__ import annotations

import contextlib
import logging
import math

import numpy as np

import palmares
from palmares.examples import grasp_softhand
from palmares.rotation import quat_of
from palmares.skills.holding import GraspSummary, grasp_summary, lift_and_hold
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import ObjectBounds, upright_box
from palmares.skills.recipes import RECIPES, Recipe
from palmares.skills.runs import play

LOG = logging.getLogger(__name__)

SOFTHANDS = ["softhand", "softhand_skin", "softhand_strong"]
"""Hands with several grasps of their own, in `grasp_softhand`"""

VARIATIONS = [
    (0.0, 0.0),
    (math.pi / 2, 0.0),
    (math.pi, 0.01),
    (math.pi / 4, 0.0),
    (0.0, 0.02),
    (math.pi / 2, -0.01),
]
"""Turn, rad, and rise, m, of each attempt against the recipe"""
SINK_M = 0.12
"""The hand approaches at this height above the grasp and then sinks"""


class RecipeMover(Mover):
    """Its σ closes the hand of a recipe, from 0 (opened) to 1 (closed)."""

    recipe: Recipe

    def command(self) -> list[float]:
        """Return σ of every motor."""
        return self.recipe.motors(self.sigma)


def attempt(mover: RecipeMover, target: ObjectBounds, yaw_rad: float, rise_m: float) -> None:
    """Grasp, lift and hold the object; the run is over after the shake."""
    recipe = mover.recipe
    rotation = recipe.rotation(yaw_rad)
    at = recipe.base_position(target, rotation) + rise_m * UP
    mover.to(0.6, np.array([*at[:2], max(at[2] + SINK_M, mover.position[2])]), quat_of(rotation), sigma=0.0)
    mover.to(0.3, at + SINK_M * UP)
    mover.to(0.5, at)
    mover.to(recipe.close_s, sigma=1.0)
    lift_and_hold(mover, at)


def run(
    client: palmares.Client, seed: int | None, hand: str = "yale_t42", recipe: Recipe | None = None
) -> GraspSummary:
    """Play one run; `hand` may be a path where the client is local, and then needs a `recipe`."""
    if recipe is None and hand in SOFTHANDS:
        return grasp_softhand.run(client, seed, hand=hand)
    mover = RecipeMover(client, client.reset("grasp", hand, sensing="truth", seed=seed))
    mover.recipe, mover.sigma = recipe or RECIPES[hand], 0.0
    first, _ = upright_box(client.scene, mover.obs, 0)
    tries = 0
    with contextlib.suppress(RunOverError):  # The shake is over.
        for turn_rad, rise_m in VARIATIONS:
            target, yaw_rad = upright_box(client.scene, mover.obs, 0)
            if target.high[2] < 0.0:  # It fell off the table.
                break
            tries += 1
            LOG.info(f"{target.name}, {np.round(target.size, 3)} m: turned by {turn_rad:.2f} rad")
            attempt(mover, target, yaw_rad + turn_rad, rise_m)
    return grasp_summary(mover, first, tries)


if __name__ == "__main__":
    play(run, __doc__, hands=[*RECIPES, *SOFTHANDS])
