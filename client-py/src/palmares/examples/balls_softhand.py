"""Move balls from box A to box B with the SoftHand: look, pick, carry, drop, look again.

    python balls_softhand.py --seed 7 --runs 3          # needs `palmares serve`, or --url local

A simple controller to start from. It uses the true positions of the balls (sensing "truth"). For the ball and
the direction with the most room for the hand (`palmares.skills.balls`) it makes a fixed sequence of motions:

    above the ball -> down (slightly tilted) -> forward along the palm -> close -> up -> over box B -> open

The fingers do not fit around a ball at a wall or in a corner. It is raked away from there first: the fingers
come down on its inner side, curl over it and pull it to the middle of the box.

The controller does not react to touch. It only looks again after each attempt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import palmares
from palmares.arrays import Array, array
from palmares.reproducible import cos, dot, matmul, norm, sin, total
from palmares.rotation import quat_of, rot_z
from palmares.skills.balls import YAWS_RAD, BallGrasp, BallMover, BallsSummary, Plan, play_balls
from palmares.skills.grasps import SOFTHAND_PRESHAPED
from palmares.skills.motion import UP
from palmares.skills.objects import truth_of
from palmares.skills.runs import play

# --------------------------------------------------------------------------------------------------------
# Constants to tune

# Hand frame: fingers +z, palm normal +x, thumb +y.
GRASP = BallGrasp("pick", 2.2405, -0.3159, (0.0527, 0.05, 0.2103), 0.0977, 1.0, SOFTHAND_PRESHAPED)
LEAN_RAD = 0.155
"""Tilt of the approach from the vertical"""
ADVANCE_M = 0.0165
"""The approach stops this far behind the grasp; the palm then moves forward along its normal"""


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

    travel_s: float = 1.4
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
    retreat_s: float = 0.8
    fall_s: float = 0.3


SCRIPT = Script()
RAKE = Rake()
APPROACH_SAMPLES_M = (0.0, 0.05, 0.12)
"""Distances before the end of the approach at which room is checked"""
MARGIN_M = 0.005
"""Wanted distance between the hand and other balls"""
TIGHT_M = -0.1
"""With less room than this, a ball is raked, not grasped"""
CENTRAL_M = 0.12
"""A ball this near to the middle of the box is not raked"""

# --------------------------------------------------------------------------------------------------------


class SoftHand(BallMover):
    """The SoftHand's choices and motions."""

    hand = "softhand"
    grasps: ClassVar[list[BallGrasp]] = [GRASP]
    picks = 25
    tries: ClassVar[float] = 4
    again = (0.05, 0.2)
    how = RAKE

    def ready(self) -> None:
        """Move over box A."""
        self.to(1.0, array([*self.box_a.center[:2], SCRIPT.ready_height_m]), quat_of(GRASP.rotation(0.0)))

    @classmethod
    def way(cls, yaw_rad: float) -> Array:
        """Return the direction of the approach, (3,), world frame."""
        return matmul(rot_z(yaw_rad), [sin(LEAN_RAD), 0.0, -cos(LEAN_RAD)])

    @classmethod
    def room(cls, plan: Plan, others: Array, radius_m: float, box: palmares.Region) -> float:
        """Return 0 if the preshaped hand touches nothing on its way, else less by the overlaps, m."""
        end, way = plan.at - ADVANCE_M * plan.rotation[:, 0], cls.way(plan.yaw_rad)
        return min(
            room(plan.rotation, end - back_m * way, others, radius_m, box) for back_m in APPROACH_SAMPLES_M
        )

    def attempt(self, plan: Plan) -> None:
        """Rake a ball at a wall where the hand has no room or did not grasp it; else pick it."""
        outward = (plan.position - self.box_a.center) * [1.0, 1.0, 0.0]
        distance_m = norm(outward)
        if (plan.room_m < TIGHT_M or plan.tried > 0) and distance_m > CENTRAL_M:
            self.rake(plan, outward / distance_m)
            self.raked += 1
        else:
            self.caught += self.pick(plan)

    def pick(self, plan: Plan) -> bool:
        """Grasp the ball, carry it over box B and let it go. Return whether a ball was in the hand."""
        before_advance = plan.at - ADVANCE_M * plan.rotation[:, 0]
        way = self.way(plan.yaw_rad)
        above = before_advance - SCRIPT.clearance_height_m / abs(way[2]) * way

        self.to(SCRIPT.travel_s, above, quat_of(plan.rotation), sigma=GRASP.sigma_open)
        self.feel_empty()
        self.to(SCRIPT.approach_s, before_advance)
        self.to(SCRIPT.advance_s, plan.at)
        self.to(SCRIPT.close_s, sigma=GRASP.sigma_closed)
        self.wait(SCRIPT.squeeze_s)
        self.look_before_lift()
        self.to(SCRIPT.creep_s, plan.at + SCRIPT.creep_m * UP)
        self.to(SCRIPT.lift_s, plan.at + SCRIPT.lift_height_m * UP)
        caught = self.has_ball()
        if caught:
            # The ball, not the hand, should arrive near the middle of box B.
            x, y, _ = self.box_b.center - plan.position
            self.to(SCRIPT.carry_s, self.position + array([x, 0.7 * y, 0.0]))
            self.wait(SCRIPT.hold_s)
        self.to(SCRIPT.open_s, sigma=0.0)
        self.wait(SCRIPT.fall_s)
        return caught

    def feel_empty(self) -> None:
        """Prepare `has_ball` above the ball."""

    def look_before_lift(self) -> None:
        """Prepare `has_ball` with the fingers closed."""
        self._heights = truth_of(self.obs).positions[:, 2]

    def has_ball(self) -> bool:
        """Return whether a ball is in the lifted hand."""
        return bool(np.any(truth_of(self.obs).positions[:, 2] > self._heights + SCRIPT.lifted_m))

    def rake(self, plan: Plan, outward: Array) -> None:
        """Pull the ball towards the middle of its box; `outward` is the unit vector (3,) away from there."""
        how = self.how
        # The ball is in front of the hand: turn the hand so that it reaches outward.
        yaw = max(YAWS_RAD, key=lambda yaw: dot(matmul(GRASP.rotation(yaw), GRASP.ball_in_hand), outward))
        rotation = GRASP.rotation(yaw)
        behind = GRASP.base_position(plan.position, rotation) - how.inward_m * outward
        down_at = behind + how.height_m * UP
        drawn_to = down_at - how.way_m * outward
        way = self.way(yaw)
        above = down_at - SCRIPT.clearance_height_m / abs(way[2]) * way

        self.to(how.travel_s, above, quat_of(rotation), sigma=GRASP.sigma_open)
        self.to(SCRIPT.approach_s, down_at)
        self.to(how.curl_s, sigma=how.sigma)
        self.to(how.draw_s, drawn_to)
        self.to(how.retreat_s, drawn_to + how.retreat_height_m * UP)
        self.to(SCRIPT.open_s, sigma=0.0)
        self.wait(how.fall_s)


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


def run(client: palmares.Client, seed: int | None, picks: int | None = None) -> BallsSummary:
    """Play one run of at most `picks` attempts."""
    return play_balls(SoftHand, client, seed, picks)


if __name__ == "__main__":
    play(run, __doc__)
