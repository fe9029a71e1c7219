"""Move balls from box A to box B with the ReFlex: three fingers, each with a motor, and a swivel.

    python balls_reflex.py --seed 7 --runs 3            # needs `palmares serve`, or --url local

The task of `balls_softhand.py` with a simpler plan: down over the ball with the most room for the fingers,
close, up, over box B, open. After a slip the hand tries another side.

At a wall or in a corner the fingers do not fit on the ball's outer side. There the swivel turns fingers 1 and
2 until they almost face each other, so that they close along the wall; the third presses from the inner side.
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import cos, matmul, total
from palmares.rotation import quat_of, rot_y, rot_z, rot_zyz
from palmares.skills.attempts import Attempt, attempts_here
from palmares.skills.grasps import Capsules
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import largest_radius, truth_of
from palmares.skills.runs import Summary, play

LOG = logging.getLogger(__name__)

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
class Grasp:
    """The ReFlex's grasp of a ball of 10 cm from above."""

    name: str
    preshape: float
    """Fourth motor: turns fingers 1 and 2, by 90° at 1, until they face each other"""
    sigma_open: float
    """Motor command on the way down: half closed, to fit between the other balls"""
    bent_rad: tuple[float, float]
    """Angles of the proximal and distal joints at `sigma_open`, from `obs.truth.joints`"""
    sigma_closed: float
    """Motor command of fingers 1 and 2 in the grasp"""
    sigma_third: float
    """Motor command of finger 3: less, so that it does not push the ball out between the others"""
    ball_in_hand: tuple[float, float, float]
    """Centre of the ball when the fingers close, hand frame, m"""
    tilt_rad: float
    """Tilt of the palm; 0 is horizontal"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3): palm down, turned by `yaw_rad` about the vertical."""
        return rot_zyz(yaw_rad, math.pi - self.tilt_rad)

    def base_position(self, ball: Array, rotation: Array) -> Array:
        """Return the position of the base, (3,), when the fingers close on `ball` (3,), m."""
        return array(ball - matmul(rotation, self.ball_in_hand))

    @cached_property
    def hand(self) -> Capsules:
        """The hand on its way down, hand frame."""
        return open_hand(self.preshape * math.pi / 2, *self.bent_rad)


GRASPS = [
    Grasp("along", 0.724, 0.43, (0.97, 0.23), 0.91, 0.74, (0.053, 0.0, 0.136), -0.187),
    Grasp("facing", 1.0, 0.5, (1.17, 0.28), 0.87, 0.72, (0.043, 0.0, 0.139), 0.039),
]
YAWS_RAD = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions to try for every ball"""
ENOUGH_M = 0.015
"""More room than this does not count"""
HIGH_M = 0.6
"""Height of the base in transit"""
LOW_M = 0.35
"""Height of the base where the hand opens over box B"""
PICKS = 30
"""Attempts per run"""
TRIES = 6
"""Most attempts on a ball at one position"""
MOVED_M = 0.01
"""Attempts on a ball count until it has moved farther than this"""

# --- choice of a ball, a grasp and a direction ---


@dataclass(frozen=True)
class Plan:
    """A ball, a grasp and a direction."""

    ball: int
    grasp: Grasp
    yaw_rad: float
    rotation: Array
    """World from hand, (3, 3)"""
    at: Array
    """Position of the base when the fingers close, (3,), m"""
    room_m: float


def room(hand: Capsules, others: Array, radius_m: float, box: palmares.Region) -> float:
    """Return the hand's distance from walls and from the `others` (n, 3), m; negative for an overlap."""
    low, high = hand.bounds()
    walls = np.minimum(low[:, :2] - box.min[:2], box.max[:2] - high[:, :2])
    within = low[:, 2] < box.max[2]
    balls = hand.distances(others) - radius_m
    return min(float(walls[within].min(initial=math.inf)), float(balls.min(initial=math.inf)))


def choose(
    balls: Array, in_a: list[int], radius_m: float, box: palmares.Region, attempts: list[Attempt]
) -> Plan | None:
    """Return the ball, grasp and yaw with the most room for the hand; `None` if no ball is left to try.

    `balls` (n, 3) are all centres, m; `in_a` are the rows of those to choose from. Attempts on a ball at its
    position lower its score, and more for the same grasp from about the same direction.
    """
    best, best_score = None, -math.inf
    for ball in in_a:
        others = np.delete(balls, ball, axis=0)
        here = attempts_here(attempts, ball, balls[ball], MOVED_M)
        if len(here) >= TRIES:
            continue
        for grasp in GRASPS:
            for yaw in YAWS_RAD:
                rotation = grasp.rotation(yaw)
                at = grasp.base_position(balls[ball], rotation)
                room_m = room(grasp.hand.at(rotation, at), others, radius_m, box)
                again = [max(0.0, cos(yaw - tried.yaw_rad)) for tried in here if tried.grasp == grasp.name]
                score = min(room_m, ENOUGH_M) - 0.01 * len(here) - 0.02 * total(again)
                if score > best_score:
                    best, best_score = Plan(ball, grasp, float(yaw), rotation, at, room_m), score
    return best


# --- motions ---


class Reflex(Mover):
    """Sends the same command to the three fingers; the third stops earlier."""

    grasp = GRASPS[0]

    def command(self) -> list[float]:
        """Return σ of the four motors."""
        return [self.sigma, self.sigma, min(self.sigma, self.grasp.sigma_third), self.grasp.preshape]


def pick_and_carry(mover: Reflex, plan: Plan, box_b: palmares.Region) -> None:
    """Grasp the ball, carry it over box B and let it go."""
    mover.grasp = plan.grasp
    above = array([*plan.at[:2], HIGH_M])
    x, y, _ = box_b.center - matmul(plan.rotation, plan.grasp.ball_in_hand)
    mover.to(1.0, above, quat_of(plan.rotation), sigma=plan.grasp.sigma_open)
    mover.to(0.7, plan.at)
    mover.to(0.9, sigma=plan.grasp.sigma_closed)
    mover.wait(0.3)
    mover.to(0.9, above)
    if np.any(truth_of(mover.obs).positions[:, 2] > LOW_M):
        mover.to(1.2, array([x, y, HIGH_M]))
        mover.to(0.6, array([x, y, LOW_M]))
    mover.to(0.6, sigma=0.0)
    mover.wait(0.4)
    mover.to(0.5, array([*mover.position[:2], HIGH_M]))


# --- a run ---


@dataclass(frozen=True, kw_only=True)
class ReflexSummary(Summary):
    """Outcome of a run."""

    balls_in_b: int
    picks: int
    """Attempts made"""


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ReflexSummary:
    """Play one run of at most `picks` attempts."""
    mover = Reflex(client, client.reset("balls", "reflex", sensing="truth", seed=seed))
    box_a, box_b = client.scene.region("box_a"), client.scene.region("box_b")
    radius_m = largest_radius(client.scene)
    attempts: list[Attempt] = []
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        while len(attempts) < picks:
            balls = truth_of(mover.obs).positions
            in_a = [ball for ball in range(len(balls)) if box_a.contains(balls[ball])]
            plan = choose(balls, in_a, radius_m, box_a, attempts)
            if plan is None:
                break
            attempts.append(Attempt(plan.ball, balls[plan.ball].copy(), plan.yaw_rad, plan.grasp.name))
            pick_and_carry(mover, plan, box_b)
            in_b = [box_b.contains(ball) for ball in truth_of(mover.obs).positions].count(True)
            LOG.info(
                f"pick {len(attempts):2}: {plan.grasp.name:6} room {plan.room_m:.3f} m, {in_b:2} in box B, "
                f"{mover.obs.sim_time_s:5.1f} s simulated"
            )
    result, summary = mover.stop()
    return ReflexSummary(
        **vars(summary),
        balls_in_b=result.in_goal,
        picks=len(attempts),
    )


if __name__ == "__main__":
    play(run, __doc__)
