"""Move balls from box A to box B with any hand: look, choose a ball, a grasp and a direction, pick, carry.

A hand is a subclass of `BallMover`; the examples ``balls_…`` have those of SoftHand and ReFlex.
"""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from palmares.arguments import Noise, Sensing
from palmares.arrays import Array, array
from palmares.client import Client
from palmares.messages import Observation
from palmares.reproducible import cos, matmul, total
from palmares.rotation import rot_zyz
from palmares.scene import Region
from palmares.skills.attempts import Attempt, attempts_here
from palmares.skills.grasps import Capsules
from palmares.skills.motion import Mover, RunOverError
from palmares.skills.objects import largest_radius, truth_of
from palmares.skills.runs import Summary

__all__ = ["YAWS_RAD", "BallGrasp", "BallMover", "BallsSummary", "Plan", "play_balls"]

LOG = logging.getLogger(__name__)

YAWS_RAD = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions to try for every ball"""
MOVED_M = 0.01
"""Attempts on a ball count until it has moved farther than this"""


@dataclass(frozen=True)
class BallGrasp:
    """A hand's grasp of a ball of 10 cm."""

    name: str
    pitch_rad: float
    """Tilts the hand's z from straight up to pointing down"""
    roll_rad: float
    """Turns the hand about its z"""
    ball_in_hand: tuple[float, float, float]
    """Centre of the ball when the fingers close, hand frame, m"""
    sigma_open: float
    """Motor command on the way to the ball"""
    sigma_closed: float
    """Motor command of the grasp"""
    hand: Capsules
    """The hand on its way to the ball, hand frame"""

    def rotation(self, yaw_rad: float) -> Array:
        """Return world-from-hand (3, 3) for a grasp from the direction `yaw_rad`."""
        return rot_zyz(yaw_rad, self.pitch_rad, self.roll_rad)

    def base_position(self, ball: Array, rotation: Array) -> Array:
        """Return the position of the base, (3,), when the fingers close on `ball` (3,), m."""
        return array(ball - matmul(rotation, self.ball_in_hand))


@dataclass(frozen=True)
class Plan:
    """A ball, a grasp and a direction."""

    ball: int
    position: Array
    """Centre of the ball at the choice, (3,), m"""
    grasp: BallGrasp
    yaw_rad: float
    rotation: Array
    """World from hand, (3, 3)"""
    at: Array
    """Position of the base when the fingers close, (3,), m"""
    room_m: float
    """Room for the hand; negative for overlaps"""
    tried: int
    """Number of attempts at this position"""


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


class BallMover(Mover):
    """Moves a hand in the task ``balls`` by the true positions; a subclass has numbers and motions.

    Attributes:
        hand: Name of the hand.
        sensing: What its observations have.
        grasps: Its grasps.
        picks: Attempts in a run.
        tries: Most attempts on a ball at one position.
        enough_m: More room than this does not count.
        again: Costs of an earlier attempt at the same position, m: of any, and of one with the same grasp
            from the same direction.
        rest_s: Wait at the end of a run.

    """

    hand: ClassVar[str]
    sensing: ClassVar[Sensing] = "truth"
    grasps: ClassVar[Sequence[BallGrasp]]
    picks: ClassVar[int]
    tries: ClassVar[float]
    enough_m: ClassVar[float] = math.inf
    again: ClassVar[tuple[float, float]]
    rest_s: ClassVar[float] = 0.5

    def __init__(self, client: Client, first: Observation) -> None:
        super().__init__(client, first)
        self.box_a, self.box_b = client.scene.region("box_a"), client.scene.region("box_b")
        self.radius_m = largest_radius(client.scene)
        self.raked = self.caught = 0

    def ready(self) -> None:
        """Move to the start of the first attempt."""

    def balls(self) -> tuple[Array, list[int]]:
        """Return the centres (n, 3) of all balls, m, and the rows of those in box A."""
        balls = truth_of(self.obs).positions
        return balls, [ball for ball in range(len(balls)) if self.box_a.contains(balls[ball])]

    def attempt(self, plan: Plan) -> None:
        """Carry out a plan, and count it."""
        raise NotImplementedError

    @classmethod
    def room(cls, plan: Plan, others: Array, radius_m: float, box: Region) -> float:
        """Return the room of the hand between `others` (n, 3) and the walls of a box, m."""
        raise NotImplementedError

    @classmethod
    def choose(
        cls, balls: Array, in_a: list[int], radius_m: float, box: Region, attempts: Sequence[Attempt]
    ) -> Plan | None:
        """Return the ball, grasp and yaw with the most room for the hand; `None` if no ball is left to try.

        Earlier attempts on a ball at its position cost room, and more for the same grasp from about the same
        direction.

        Args:
            balls: Centres (n, 3) of all balls, m.
            in_a: The rows of those to choose from.
            radius_m: Their radius.
            box: The box around them.
            attempts: All earlier attempts.

        """
        best, best_score = None, -math.inf
        for ball in in_a:
            others = np.delete(balls, ball, axis=0)
            here = attempts_here(attempts, cls.known_as(ball), balls[ball], MOVED_M)
            if len(here) >= cls.tries:
                continue
            for grasp in cls.grasps:
                for yaw in map(float, YAWS_RAD):
                    rotation = grasp.rotation(yaw)
                    at = grasp.base_position(balls[ball], rotation)
                    plan = Plan(ball, balls[ball].copy(), grasp, yaw, rotation, at, 0.0, len(here))
                    room_m = cls.room(plan, others, radius_m, box)
                    same = [max(0.0, cos(yaw - past.yaw_rad)) for past in here if past.grasp == grasp.name]
                    score = min(room_m, cls.enough_m) - cls.again[0] * len(here) - cls.again[1] * total(same)
                    if score > best_score:
                        best, best_score = replace(plan, room_m=room_m), score
        return best

    @classmethod
    def known_as(cls, ball: int) -> int:
        """Return the row under which attempts on a ball are kept: images do not identify balls."""
        return ball if cls.sensing == "truth" else 0


def play_balls(
    kind: type[BallMover], client: Client, seed: int | None, picks: int | None = None
) -> BallsSummary:
    """Play one run with a hand.

    Args:
        kind: The hand.
        client: The session.
        seed: The scene.
        picks: Most attempts; those of the hand when left out.

    """
    noise: Noise | None = None if kind.sensing == "truth" else "real"
    mover = kind(client, client.reset("balls", kind.hand, sensing=kind.sensing, noise=noise, seed=seed))
    attempts: list[Attempt] = []
    with contextlib.suppress(RunOverError):  # Complete, or at the time limit: see the result.
        mover.ready()
        while len(attempts) < (kind.picks if picks is None else picks):
            balls, in_a = mover.balls()
            plan = mover.choose(balls, in_a, mover.radius_m, mover.box_a, attempts)
            if plan is None:
                break
            row = mover.known_as(plan.ball)
            attempts.append(Attempt(row, plan.position, plan.yaw_rad, plan.grasp.name))
            mover.attempt(plan)
            LOG.info(
                f"attempt {len(attempts):2}: box A had {len(in_a)}; grasp '{plan.grasp.name}'; "
                f"{mover.obs.sim_time_s:.1f} s simulated"
            )
        mover.wait(kind.rest_s)
    result, summary = mover.stop()
    return BallsSummary(
        **vars(summary),
        balls_in_b=result.in_goal,
        picks=len(attempts),
        raked=mover.raked,
        caught=mover.caught,
    )
