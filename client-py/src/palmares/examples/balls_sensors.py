"""Move balls from box A to box B with the SoftHand by its sensors: a depth camera above box A and the wrist.

    python balls_sensors.py --seed 7 --runs 3           # needs `palmares serve`, or --url local

Grasp and rake are those of `balls_softhand.py`, which uses the true positions. This controller uses images:

    hand aside -> depth image -> spheres in it -> the ball with most room -> down -> close -> up
    -> does the wrist carry a ball's weight? -> over box B -> open -> next image
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import cos, dot, least_squares, matmul, mean, norm, norms, sin, total
from palmares.rotation import quat_of, rot_zyz
from palmares.skills.attempts import Attempt, attempts_here
from palmares.skills.grasps import SOFTHAND_PRESHAPED
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.objects import largest_radius
from palmares.skills.runs import Summary, play

LOG = logging.getLogger(__name__)

# --- the grasp; hand frame: fingers +z, palm normal +x, thumb +y ---
PITCH_RAD, ROLL_RAD = 2.2405, -0.3159
"""Tilt of the fingers from straight up, turn of the palm about them"""
BALL_IN_HAND = array([0.0527, 0.05, 0.2103])
"""Centre of the ball when the fingers close, hand frame, m"""
SIGMA_PRESHAPE = 0.0977
"""Motor command while approaching: slightly curled"""
ADVANCE_M = 0.0165
"""The approach stops this far behind the grasp; the palm then moves forward along its normal"""
LEAN, CLEARANCE_M = 0.156, 0.32
"""Slope of the approach, horizontal per vertical distance, and its height"""
CREEP_M, CREEP_S = 0.06, 1.8
"""First part of the lift, slow: the fingers close under the ball, and the motor follows them"""
LIFT_M = 0.36
"""The ball and the fingers under it then pass over the wall"""
FEEL_S = 0.1
"""Duration of the mean over the wrist's noise"""
ASIDE = array([0.65, 0.0, 0.75])
"""Position of the base where the hand does not hide box A from the camera, m"""

# --- the rake pulls a ball away from a wall; the hand is turned as for a grasp, fingers to the wall ---
RAKE_HEIGHT_M, RAKE_INWARD_M = 0.02, 0.07
"""Offsets of the hand from a grasp, up and to the middle, so that no finger lands on the wall"""
RAKE_SIGMA, RAKE_WAY_M = 0.6, 0.12
"""Motor command that curls the fingers over the ball; distance of the pull, after which the ball rolls on"""

# --- the choice ---
YAWS_RAD = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions to try for every ball"""
TIGHT_M, CENTRAL_M = -0.1, 0.12
"""With less room than this, and farther from the middle than this, a ball is raked, not grasped"""
PICKS, MOVED_M = 40, 0.01
"""Attempts per run; attempts on a ball count until it has moved farther than this"""

# --- the depth image; its error is 1 to 6 mm ---
WALL_M, FLOOR_M = 0.008, 0.03
"""Points this near to a wall or the floor may belong to it"""
SHELL_M = (0.02, 0.012)
"""Points this near to a ball's surface belong to it, in the first and in the later steps of the fit"""
MIN_POINTS = 80
"""Fewest pixels of a ball, which has about 600, half hidden 300"""


def find_balls(points: Array, radius_m: float, box: palmares.Region) -> Array:
    """Return the centres (n, 3), m, of the balls in `box` among `points` (h, w, 3), m; NaN has no reading.

    The highest point outside all known balls is near the top of another one. From there a sphere of the known
    radius is fitted by Gauss–Newton, and its points are removed.
    """
    low, high = box.min + array([WALL_M, WALL_M, FLOOR_M]), box.max - array([WALL_M, WALL_M, 0.0])
    inside = np.all((points > low) & (points < high), axis=2)
    # Mean height over 5 x 5 pixels; the highest of many noisy points is too high.
    heights, counts = (
        around(image)[inside] for image in (np.where(inside, points[..., 2], 0.0), inside.astype(float))
    )
    cloud, height = points[inside], heights / counts
    left = np.ones(len(cloud), bool)
    balls = []
    while np.count_nonzero(left) >= MIN_POINTS:
        top = int(np.argmax(np.where(left, height, -np.inf)))
        left[top] = False
        centre = array([*cloud[top, :2], height[top] - radius_m])
        for step in range(12):
            offset = cloud - centre
            distance_m = norms(offset)
            # Only upper halves are visible: without this a sphere fits from above, too.
            near = (np.abs(distance_m - radius_m) < SHELL_M[step >= 6]) & (offset[:, 2] > 0.0)
            if np.count_nonzero(near & left) < MIN_POINTS:
                break
            towards = offset[near] / distance_m[near, None]
            centre = centre + least_squares(towards, distance_m[near] - radius_m)
        else:
            balls.append(centre)
        left &= norms(cloud - centre) > radius_m + SHELL_M[0]
    return array(balls, -1, 3)


def around(image: Array) -> Array:
    """Return the mean of the 5 x 5 pixels around every pixel of an image (h, w)."""
    padded = np.pad(image, 2)
    rows = mean([padded[k : k + len(image)] for k in range(5)])
    return mean([rows[:, k : k + image.shape[1]] for k in range(5)])


def rotation_of(yaw_rad: float) -> Array:
    """Return world-from-hand (3, 3) for a grasp from the direction `yaw_rad`."""
    return rot_zyz(yaw_rad, PITCH_RAD, ROLL_RAD)


def down(yaw_rad: float, drop_m: float) -> Array:
    """Return the last part of the approach, over a height of `drop_m`, (3,), m."""
    return drop_m * array([LEAN * cos(yaw_rad), LEAN * sin(yaw_rad), -1.0])


def room(rotation: Array, position: Array, others: Array, radius_m: float, box: palmares.Region) -> float:
    """Return 0 if the preshaped hand touches nothing at a pose, else less by the overlaps, m."""
    hand = SOFTHAND_PRESHAPED.at(rotation, position)
    score = -total(np.clip(0.005 + radius_m - hand.distances(others), 0.0, 0.05))
    # Walls are hard: an overlap counts three times, plus a fixed cost.
    low, high = (bound[:, :2] for bound in hand.bounds())
    into = np.hstack([high - box.max[:2], box.min[:2] - low])[hand.bounds()[0][:, 2] < box.max[2]]
    return score - 3.0 * total(np.clip(into, 0.0, None)) - 0.1 * np.count_nonzero(into > 0.004)


def choose(balls: Array, radius_m: float, box: palmares.Region, attempts: list[Attempt]) -> Attempt:
    """Return the grasp or rake with the most room for the hand, for one of the `balls` (n, 3).

    Attempts on a ball at its position lower its score, and much more from about the same direction.
    """
    rated = []
    for k, ball in enumerate(balls):
        others = np.delete(balls, k, axis=0)
        here = attempts_here(attempts, 0, ball, MOVED_M)
        central = norm((ball - box.center)[:2]) <= CENTRAL_M
        for yaw in YAWS_RAD:
            rotation = rotation_of(yaw)
            end = ball - matmul(rotation, BALL_IN_HAND) - ADVANCE_M * rotation[:, 0]
            poses = [end - down(yaw, drop_m) for drop_m in (0.0, 0.05, 0.12)]
            least = min(room(rotation, pose, others, radius_m, box) for pose in poses)
            score = least - total([0.05 + 0.2 * max(0.0, cos(yaw - tried.yaw_rad)) for tried in here])
            how = "rake" if not central and (least < TIGHT_M or here) else "grasp"
            rated.append((score, Attempt(0, ball, float(yaw), how)))
    return max(rated, key=lambda entry: entry[0])[1]


class Senses(Mover):
    """Moves the hand and takes images."""

    def look(self) -> Array:
        """Move the hand out of the way; return the points (h, w, 3), m, of the camera above box A."""
        self.to(0.0, array([max(self.position[0], ASIDE[0]), *self.position[1:]]))
        self.wait(0.2)  # An image may be 0.13 s old.
        self.obs = self.client.step(cameras=["box_a"])
        if self.obs.done:
            raise RunOverError(self.obs.reason)
        return self.obs.cameras["box_a"].points()


def pick_and_carry(hand: Senses, target: Attempt, weight_n: float, box_b: palmares.Region) -> bool:
    """Grasp the ball, carry it over box B and let it go. Return whether a ball was in the hand."""
    rotation = rotation_of(target.yaw_rad)
    grasp_at = target.position - matmul(rotation, BALL_IN_HAND)
    before = grasp_at - ADVANCE_M * rotation[:, 0]
    hand.to(1.4, before - down(target.yaw_rad, CLEARANCE_M), quat_of(rotation), SIGMA_PRESHAPE)
    empty = hand.wrist_force(FEEL_S)
    hand.to(0.8, before)
    hand.to(0.3, grasp_at)
    hand.to(1.0, sigma=1.0)
    hand.wait(0.2)
    hand.to(CREEP_S, grasp_at + CREEP_M * UP)
    hand.to(0.8, grasp_at + LIFT_M * UP)
    caught = norm(hand.wrist_force(FEEL_S) - empty) > 0.5 * weight_n
    if caught:
        # The ball, not the hand, should arrive near the middle of box B.
        x, y, _ = box_b.center - target.position
        hand.to(1.2, hand.position + array([x, 0.7 * y, 0.0]))
        hand.wait(0.2)
    hand.to(0.9, sigma=0.0)
    hand.wait(0.3)
    return caught


def rake(hand: Senses, target: Attempt, box_a: palmares.Region) -> None:
    """Pull the ball towards the middle of its box."""
    outward = (target.position - box_a.center) * [1.0, 1.0, 0.0]
    outward /= norm(outward)
    # The ball is in front of the hand: turn the hand so that it reaches outward.
    yaw = max(YAWS_RAD, key=lambda yaw: dot(matmul(rotation_of(yaw), BALL_IN_HAND), outward))
    rotation = rotation_of(yaw)
    grasp_at = target.position - matmul(rotation, BALL_IN_HAND)
    down_at = grasp_at - RAKE_INWARD_M * outward + RAKE_HEIGHT_M * UP
    drawn_to = down_at - RAKE_WAY_M * outward
    hand.to(1.2, down_at - down(yaw, CLEARANCE_M), quat_of(rotation), SIGMA_PRESHAPE)
    hand.to(0.8, down_at)
    hand.to(0.9, sigma=RAKE_SIGMA)
    hand.to(0.8, drawn_to)
    hand.to(1.2, drawn_to + LIFT_M * UP)
    hand.to(0.9, sigma=0.0)


@dataclass(frozen=True, kw_only=True)
class BallsSummary(Summary):
    """Outcome of a run."""

    balls_in_b: int
    picks: int
    """Attempts made"""
    caught: int
    """Attempts after which the wrist carried a ball"""


def run(client: palmares.Client, seed: int | None) -> BallsSummary:
    """Play one run."""
    hand = Senses(client, client.reset("balls", "softhand", sensing="sensors", noise="real", seed=seed))
    box_a, box_b = client.scene.region("box_a"), client.scene.region("box_b")
    radius_m = largest_radius(client.scene)
    weight_n = client.scene.free[0].mass * norm(client.scene.gravity)
    caught, attempts = 0, list[Attempt]()
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        hand.to(1.0, ASIDE, quat_of(rotation_of(0.0)))
        while len(attempts) < PICKS and len(balls := find_balls(hand.look(), radius_m, box_a)) > 0:
            target = choose(balls, radius_m, box_a, attempts)
            attempts.append(target)
            if target.grasp == "rake":
                rake(hand, target, box_a)
            else:
                caught += pick_and_carry(hand, target, weight_n, box_b)
            LOG.info(f"{len(attempts):2}: {target.grasp} one of {len(balls)}, {hand.obs.sim_time_s:5.1f} s")
        hand.wait(0.5)
    result, summary = hand.stop()
    return BallsSummary(**vars(summary), balls_in_b=result.in_goal, picks=len(attempts), caught=caught)


if __name__ == "__main__":
    play(run, __doc__)
