"""Move balls from box A to box B with the ReFlex: three fingers, each with a motor, and a swivel.

    python balls_reflex.py --seed 7 --runs 3            # needs `palmares serve`, or --url local

The task of `balls_softhand.py` with a simpler plan: down over the ball with the most room for the fingers,
close, up, over box B, open. After a slip the hand tries another side.

At a wall or in a corner the fingers do not fit on the ball's outer side. There the swivel turns fingers 1 and
2 until they almost face each other, so that they close along the wall; the third presses from the inner side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import matmul
from palmares.rotation import quat_of, rot_y, rot_z
from palmares.skills.balls import BallGrasp, BallMover, BallsSummary, Plan, play_balls
from palmares.skills.grasps import Capsules
from palmares.skills.objects import truth_of
from palmares.skills.runs import play

# --- the hand ---


def open_hand(preshape_rad: float, proximal_rad: float, distal_rad: float) -> Capsules:
    """Return the hand with all fingers bent by the same angles, in the hand frame, m.

    Hand frame: palm normal +z, fingers 1 and 2 towards +x, finger 3 towards −x. The housing is two capsules.
    """
    parts = [(array([-0.037, y, 0.064]), array([0.065, y, 0.064]), 0.018) for y in (-0.035, 0.035)]
    for swivel_at, turn_rad in (
        ([0.0504, -0.026, 0.0816], -preshape_rad),
        ([0.0504, 0.026, 0.0816], preshape_rad),
        ([-0.02, 0.0, 0.0816], math.pi),
    ):
        finger = rot_z(turn_rad)
        proximal = matmul(finger, rot_y(-proximal_rad))
        distal = matmul(proximal, rot_y(-distal_rad))
        first = array(swivel_at) + matmul(finger, [0.01, 0.0, 0.0])
        second = first + matmul(proximal, [0.066, 0.0, -0.005])
        for at, turn, start, end, radius in (
            (first, proximal, [0.0, 0.0, 0.002], [0.056, 0.0, 0.002], 0.0125),
            (second, distal, [0.0, 0.0, 0.006], [0.038, 0.0, 0.009], 0.0115),
        ):
            parts.append((at + matmul(turn, start), at + matmul(turn, end), radius))
    starts, ends, radii = zip(*parts, strict=True)
    return Capsules(array(starts), array(ends), array(radii))


# --- constants to tune ---


@dataclass(frozen=True)
class Grasp(BallGrasp):
    """The ReFlex's grasp of a ball of 10 cm from above."""

    preshape: float
    """Fourth motor: turns fingers 1 and 2, by 90° at 1, until they face each other"""
    sigma_third: float
    """Motor command of finger 3: less, so that it does not push the ball out between the others"""


ALONG, FACING = open_hand(0.724 * math.pi / 2, 0.97, 0.23), open_hand(math.pi / 2, 1.17, 0.28)
"""The hand on its way down, with the angles of its joints from `obs.truth.joints`"""
GRASPS = [
    Grasp("along", math.pi + 0.187, 0.0, (0.053, 0.0, 0.136), 0.43, 0.91, ALONG, 0.724, 0.74),
    Grasp("facing", math.pi - 0.039, 0.0, (0.043, 0.0, 0.139), 0.5, 0.87, FACING, 1.0, 0.72),
]
"""The palm is down, a little tilted, and the fingers half closed, to fit between the other balls"""
HIGH_M = 0.6
"""Height of the base in transit"""
LOW_M = 0.35
"""Height of the base where the hand opens over box B"""

# --- the motions ---


class Reflex(BallMover):
    """Sends the same command to the three fingers; the third stops earlier."""

    hand = "reflex"
    grasps: ClassVar[list[Grasp]] = GRASPS
    picks, tries = 30, 6
    enough_m = 0.015
    again = (0.01, 0.02)
    rest_s = 0.0
    grasp = GRASPS[0]

    def command(self) -> list[float]:
        """Return σ of the four motors."""
        return [self.sigma, self.sigma, min(self.sigma, self.grasp.sigma_third), self.grasp.preshape]

    @classmethod
    def room(cls, plan: Plan, others: Array, radius_m: float, box: palmares.Region) -> float:
        """Return the hand's distance from walls and from the others, m; negative for an overlap."""
        hand = plan.grasp.hand.at(plan.rotation, plan.at)
        low, high = hand.bounds()
        walls = np.minimum(low[:, :2] - box.min[:2], box.max[:2] - high[:, :2])
        within = low[:, 2] < box.max[2]
        balls = hand.distances(others) - radius_m
        return min(float(walls[within].min(initial=math.inf)), float(balls.min(initial=math.inf)))

    def attempt(self, plan: Plan) -> None:
        """Grasp the ball, carry it over box B and let it go."""
        assert isinstance(plan.grasp, Grasp)
        self.grasp = plan.grasp
        above = array([*plan.at[:2], HIGH_M])
        x, y, _ = self.box_b.center - matmul(plan.rotation, self.grasp.ball_in_hand)
        self.to(1.0, above, quat_of(plan.rotation), sigma=self.grasp.sigma_open)
        self.to(0.7, plan.at)
        self.to(0.9, sigma=self.grasp.sigma_closed)
        self.wait(0.3)
        self.to(0.9, above)
        if np.any(truth_of(self.obs).positions[:, 2] > LOW_M):
            self.caught += 1
            self.to(1.2, array([x, y, HIGH_M]))
            self.to(0.6, array([x, y, LOW_M]))
        self.to(0.6, sigma=0.0)
        self.wait(0.4)
        self.to(0.5, array([*self.position[:2], HIGH_M]))


def run(client: palmares.Client, seed: int | None, picks: int | None = None) -> BallsSummary:
    """Play one run of at most `picks` attempts."""
    return play_balls(Reflex, client, seed, picks)


if __name__ == "__main__":
    play(run, __doc__)
