"""Move balls from box A to box B with the SoftHand: look, pick, carry, drop, look again.

    python balls_softhand.py --seed 7 --runs 3          # needs `palmares serve`, or --url local

A simple controller to start from. It uses the true positions of the balls (sensing "truth"), chooses the ball
and the direction with the most room for the hand, and then makes a fixed sequence of motions:

    above the ball -> down (slightly tilted) -> forward along the palm -> close -> up -> over box B -> open

The fingers do not fit around a ball at a wall or in a corner. It is raked away from there first: the fingers
come down on its inner side, curl over it and pull it to the middle of the box.

The controller does not react to touch. It only looks again after each attempt.
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import cos, dot, matmul, norm, sin, total
from palmares.rotation import quat_of, rot_z, rot_zyz
from palmares.skills.attempts import Attempt, attempts_here
from palmares.skills.grasps import SOFTHAND_PRESHAPED
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import largest_radius, truth_of
from palmares.skills.runs import Summary, play

LOG = logging.getLogger(__name__)

# --------------------------------------------------------------------------------------------------------
# Constants to tune


@dataclass(frozen=True)
class Grasp:
    """The SoftHand's grasp of a ball of 10 cm. Hand frame: fingers +z, palm normal +x, thumb +y."""

    pitch_rad: float = 2.2405
    """Tilts the fingers from straight up to pointing down"""
    roll_rad: float = -0.3159
    """Turns the palm about the fingers' axis"""
    ball_in_hand: tuple[float, float, float] = (0.0527, 0.05, 0.2103)
    """Centre of the ball when the fingers close, hand frame, m"""
    sigma_preshape: float = 0.0977
    """Motor command while approaching: slightly curled"""
    sigma_closed: float = 1.0
    """Motor command of the grasp"""
    advance_m: float = 0.0165
    """The approach stops this far behind the grasp; the palm then moves forward along its normal"""
    lean_rad: float = 0.155
    """Tilt of the approach from the vertical"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3) for a grasp from the direction `yaw_rad`."""
        return rot_zyz(yaw_rad, self.pitch_rad, self.roll_rad)

    def base_position(self, ball: Array, rotation: Array) -> Array:
        """Return the position of the base, (3,), when the fingers close on `ball` (3,), m."""
        return array(ball - matmul(rotation, self.ball_in_hand))

    def approach_direction(self, yaw_rad: float) -> Array:
        """Return the direction of the approach, unit vector (3,), world frame."""
        return matmul(rot_z(yaw_rad), [sin(self.lean_rad), 0.0, -cos(self.lean_rad)])


@dataclass(frozen=True)
class Script:
    """Durations and distances. A motion takes longer than its duration if the base's limits demand it."""

    travel_s: float = 1.4
    approach_s: float = 0.8
    advance_s: float = 0.3
    close_s: float = 1.0
    """The motor needs 1.1 s from open to the fist; a ball stops it earlier"""
    squeeze_s: float = 0.2
    """Wait between closing and lifting"""
    creep_m: float = 0.06
    """First part of the lift, slow: the fingers close under the ball, and the motor follows them"""
    creep_s: float = 1.8
    lift_s: float = 0.8
    carry_s: float = 1.2
    hold_s: float = 0.2
    """Wait over box B until the ball hangs still"""
    open_s: float = 0.9
    fall_s: float = 0.3
    """Wait after opening until the ball has left the hand"""
    ready_height_m: float = 0.9
    """First height of the base, over the middle of box A"""
    clearance_height_m: float = 0.32
    """The approach starts this far above the grasp"""
    lift_height_m: float = 0.36
    """The ball and the fingers under it then pass over the wall"""
    lifted_m: float = 0.15
    """A ball that rose by more than this is in the hand"""


@dataclass(frozen=True)
class Rake:
    """The rake that pulls a ball away from a wall. The hand is turned as for a grasp, fingers to the wall."""

    height_m: float = 0.02
    """Height of the hand above a grasp"""
    inward_m: float = 0.07
    """Distance of the hand from a grasp, towards the middle, so that the fingers do not land on the wall"""
    sigma: float = 0.6
    """Motor command that curls the fingers over the ball"""
    curl_s: float = 0.9
    way_m: float = 0.12
    """Distance of the pull; the ball then rolls on"""
    draw_s: float = 0.8
    retreat_height_m: float = 0.3
    """Height of the retreat"""


GRASP = Grasp()
SCRIPT = Script()
RAKE = Rake()
PICKS = 25
"""Attempts per run"""
YAWS_RAD = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions to try for every ball"""
APPROACH_SAMPLES_M = (0.0, 0.05, 0.12)
"""Distances before the end of the approach at which room is checked"""
MARGIN_M = 0.005
"""Wanted distance between the hand and other balls"""
TIGHT_M = -0.1
"""With less room than this, a ball is raked, not grasped"""
CENTRAL_M = 0.12
"""A ball this near to the middle of the box is not raked"""
TRIES = 4
"""Most attempts on a ball at one position"""
MOVED_M = 0.01
"""Attempts on a ball count until it has moved farther than this"""

# --------------------------------------------------------------------------------------------------------
# Choice of a ball and a direction


def room(rotation: Array, position: Array, others: Array, radius_m: float, box: palmares.Region) -> float:
    """Return 0 if the preshaped hand touches nothing at a pose, else less by the overlaps, m.

    `rotation` (3, 3) and `position` (3,) are the pose of the base, `others` (n, 3) the centres of the balls
    that the hand should not touch, `radius_m` is their radius.
    """
    hand = SOFTHAND_PRESHAPED.at(rotation, position)
    gap = hand.distances(others) - radius_m
    score = -total(np.clip(MARGIN_M - gap, 0.0, 0.05))

    # Walls are hard: an overlap counts three times, plus a fixed cost.
    low, high = hand.bounds()
    below_rim = low[:, 2] < box.max[2]
    for side in range(2):
        for into in (high[:, side] - box.max[side], box.min[side] - low[:, side]):
            into = into[below_rim]
            score -= 3.0 * total(np.clip(into, 0.0, None)) + 0.1 * np.count_nonzero(into > 0.004)
    return score


@dataclass(frozen=True)
class Candidate:
    """A ball and the direction of the grasp."""

    ball: int
    yaw_rad: float
    room_m: float
    position: Array
    """Centre of the ball at the choice, (3,), m"""
    tried: int
    """Number of attempts at this position"""


def choose(
    balls: Array, in_a: list[int], radius_m: float, box: palmares.Region, attempts: list[Attempt]
) -> Candidate | None:
    """Return the ball and the yaw with the most room; `None` if no ball is left to try.

    `balls` (n, 3) are all centres, `in_a` the rows of those to choose from. Attempts on a ball at its
    position lower its score, and much more from about the same direction.
    """
    best, best_score = None, -math.inf
    for ball in in_a:
        others = np.delete(balls, ball, axis=0)
        here = attempts_here(attempts, ball, balls[ball], MOVED_M)
        if len(here) >= TRIES:
            continue
        for yaw in YAWS_RAD:
            rotation = GRASP.rotation(yaw)
            before_advance = GRASP.base_position(balls[ball], rotation) - GRASP.advance_m * rotation[:, 0]
            down = GRASP.approach_direction(yaw)
            poses = [before_advance - back_m * down for back_m in APPROACH_SAMPLES_M]
            least = min(room(rotation, position, others, radius_m, box) for position in poses)
            repeated = total([max(0.0, cos(yaw - tried.yaw_rad)) for tried in here])
            score = least - 0.05 * len(here) - 0.2 * repeated
            if score > best_score:
                best, best_score = Candidate(ball, float(yaw), least, balls[ball].copy(), len(here)), score
    return best


# --------------------------------------------------------------------------------------------------------
# Motions


def pick_and_carry(mover: Mover, target: Candidate, box_b: palmares.Region) -> bool:
    """Grasp the ball, carry it over box B and let it go. Return whether a ball was in the hand."""
    rotation = GRASP.rotation(target.yaw_rad)
    grasp_at = GRASP.base_position(target.position, rotation)
    before_advance = grasp_at - GRASP.advance_m * rotation[:, 0]
    down = GRASP.approach_direction(target.yaw_rad)
    above = before_advance - SCRIPT.clearance_height_m / abs(down[2]) * down

    mover.to(SCRIPT.travel_s, above, quat_of(rotation), sigma=GRASP.sigma_preshape)
    mover.to(SCRIPT.approach_s, before_advance)
    mover.to(SCRIPT.advance_s, grasp_at)
    mover.to(SCRIPT.close_s, sigma=GRASP.sigma_closed)
    mover.wait(SCRIPT.squeeze_s)

    heights = truth_of(mover.obs).positions[:, 2]
    mover.to(SCRIPT.creep_s, grasp_at + SCRIPT.creep_m * UP)
    mover.to(SCRIPT.lift_s, grasp_at + SCRIPT.lift_height_m * UP)
    caught = bool(np.any(truth_of(mover.obs).positions[:, 2] > heights + SCRIPT.lifted_m))
    if caught:
        # The ball, not the hand, should arrive near the middle of box B.
        x, y, _ = box_b.center - target.position
        mover.to(SCRIPT.carry_s, mover.position + array([x, 0.7 * y, 0.0]))
        mover.wait(SCRIPT.hold_s)
    mover.to(SCRIPT.open_s, sigma=0.0)
    mover.wait(SCRIPT.fall_s)
    return caught


def rake(mover: Mover, target: Candidate, outward: Array) -> None:
    """Pull the ball towards the middle of its box; `outward` is the unit vector (3,) away from there."""
    # The ball is in front of the hand: turn the hand so that it reaches outward.
    yaw = max(YAWS_RAD, key=lambda yaw: dot(matmul(GRASP.rotation(yaw), GRASP.ball_in_hand), outward))
    rotation = GRASP.rotation(yaw)
    behind = GRASP.base_position(target.position, rotation) - RAKE.inward_m * outward
    down_at = behind + RAKE.height_m * UP
    drawn_to = down_at - RAKE.way_m * outward
    down = GRASP.approach_direction(yaw)
    above = down_at - SCRIPT.clearance_height_m / abs(down[2]) * down

    mover.to(SCRIPT.travel_s, above, quat_of(rotation), sigma=GRASP.sigma_preshape)
    mover.to(SCRIPT.approach_s, down_at)
    mover.to(RAKE.curl_s, sigma=RAKE.sigma)
    mover.to(RAKE.draw_s, drawn_to)
    mover.to(SCRIPT.lift_s, drawn_to + RAKE.retreat_height_m * UP)
    mover.to(SCRIPT.open_s, sigma=0.0)
    mover.wait(SCRIPT.fall_s)


# --------------------------------------------------------------------------------------------------------
# A run


@dataclass(frozen=True, kw_only=True)
class BallsSummary(Summary):
    """Outcome of a run."""

    balls_in_b: int
    picks: int
    """Attempts made"""
    raked: int
    """Attempts that pulled a ball away from a wall"""
    caught: int
    """Attempts with a ball in the hand after the lift"""


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> BallsSummary:
    """Play one run of at most `picks` attempts."""
    mover = Mover(client, client.reset("balls", "softhand", sensing="truth", seed=seed))
    box_a, box_b = client.scene.region("box_a"), client.scene.region("box_b")
    radius_m = largest_radius(client.scene)
    caught = raked = 0
    attempts: list[Attempt] = []
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        ready = array([*box_a.center[:2], SCRIPT.ready_height_m])
        mover.to(1.0, ready, quat_of(GRASP.rotation(0.0)))
        while len(attempts) < picks:
            balls = truth_of(mover.obs).positions
            in_a = [ball for ball in range(len(balls)) if box_a.contains(balls[ball])]
            target = choose(balls, in_a, radius_m, box_a, attempts)
            if target is None:
                break
            attempts.append(Attempt(target.ball, target.position, target.yaw_rad))
            outward = (target.position - box_a.center) * [1.0, 1.0, 0.0]
            distance_m = norm(outward)
            if (target.room_m < TIGHT_M or target.tried > 0) and distance_m > CENTRAL_M:
                rake(mover, target, outward / distance_m)
                raked += 1
            else:
                caught += pick_and_carry(mover, target, box_b)
            in_b = [box_b.contains(ball) for ball in truth_of(mover.obs).positions].count(True)
            LOG.info(f"pick {len(attempts):2}: {in_b:2} in box B, {mover.obs.sim_time_s:6.1f} s simulated")
        mover.wait(0.5)
    result, summary = mover.stop()
    return BallsSummary(
        **vars(summary),
        balls_in_b=result.in_goal,
        picks=len(attempts),
        raked=raked,
        caught=caught,
    )


if __name__ == "__main__":
    play(run, __doc__)
