"""Move objects out of the shelf and into the box with the SoftHand: rake them if possible, else grasp them.

    python shelf_softhand.py --seed 7 --runs 3          # needs `palmares serve`, or --url local

The controller uses the true poses (sensing "truth"). The motions are in `palmares.skills.clearing`, with
constants to tune: the hand pulls objects out so fast that they fly over the gap between shelf and box. After
a failure it tries another way. Most lost objects fall next to the box; docs/controllers.md has the scores
over a hundred scenes.
"""

from __future__ import annotations

from collections.abc import Sequence

import palmares
from palmares.reproducible import norms
from palmares.skills import clearing
from palmares.skills.attempts import Attempt
from palmares.skills.objects import ObjectBounds, truth_of
from palmares.skills.runs import play
from palmares.skills.shelf import PICKS, ShelfMover, ShelfSummary, play_shelf

STILL_M_S, LOOK_S, REST_S = 0.02, 0.1, 2.0
"""Speed below which an object is at rest; period of the check, and longest wait"""


class SoftHand(ShelfMover):
    """The SoftHand's looks and attempts."""

    hand = "softhand"

    def objects(self) -> list[ObjectBounds]:
        """Wait until all objects in the shelf are at rest, at most `REST_S`; return all objects."""
        for _ in range(round(REST_S / LOOK_S)):
            truth = truth_of(self.obs)
            inside = [self.shelf.contains(position) for position in truth.positions]
            if norms(truth.linear[inside]).max(initial=0.0) < STILL_M_S:
                break
            self.wait(LOOK_S)
        return super().objects()

    def attempt(self, objects: Sequence[ObjectBounds], attempts: Sequence[Attempt]) -> Attempt | None:
        """Make the best possible attempt and return it; `None` if none is left."""
        return clearing.attempt(self, objects, (self.shelf, self.box), self.rolls, attempts)


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts."""
    return play_shelf(SoftHand, client, seed, picks)


if __name__ == "__main__":
    play(run, __doc__)
