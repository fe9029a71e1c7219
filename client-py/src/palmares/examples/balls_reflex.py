"""Move balls from box A to box B with the ReFlex: three fingers, each with a motor, and a swivel.

The same task as `balls_softhand.py`, a simpler plan: straight down over the ball that leaves the fingertips
most room, close, up, over, open. A ball that slipped is tried from another side. It does nothing about balls
by a wall, where the fingers do not fit: what `balls_softhand.py` does about them, raking, is left to you. It
brought 6 to 8 of the ten balls of the seeds 1 to 10, 7.2 on average.

    python balls_reflex.py --seed 7 --runs 3
"""

from __future__ import annotations

import contextlib
import logging
import math
from dataclasses import dataclass

import numpy as np

import palmares
from palmares.motion import (
    Array,
    Attempt,
    Mover,
    RunOverError,
    Summary,
    array,
    attempts_here,
    largest_radius,
    play,
    quat_of,
    rot_zyz,
    truth_of,
)

LOG = logging.getLogger(__name__)

PRESHAPE = 0.4
"""Fourth motor: turns fingers 1 and 2 towards each other"""
SIGMA_OPEN = 0.43
"""Fingers half closed on the way down, so that they fit between the other balls"""
SIGMA_CLOSED = 0.9
BALL_IN_HAND = array([0.015, 0.0, 0.155])
"""Where a ball's centre is when the fingers close: midway between them, off the palm; hand frame, m"""
FINGERS = array(
    [
        (0.0868, -0.0524, 0.1357),
        (0.0942, -0.0578, 0.1590),
        (0.1016, -0.0632, 0.1823),
        (0.0868, 0.0524, 0.1357),
        (0.0942, 0.0578, 0.1590),
        (0.1016, 0.0632, 0.1823),
        (-0.0650, 0.0000, 0.1357),
        (-0.0741, 0.0000, 0.1590),
        (-0.0832, 0.0000, 0.1823),
    ]
)
"""Points of the fingers on the way down, (9, 3), hand frame, m"""
YAWS_RAD = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
"""Directions tried for every ball"""
HIGH_M = 0.6
"""Height of the hand's base on its way"""
LOW_M = 0.35
"""... and where it opens over box B"""
PICKS = 25
"""Attempts per run"""
TRIES = 4
"""A ball that stayed where it is through so many attempts is left there"""
MOVED_M = 0.01
"""For a ball that has moved farther than this, earlier attempts do not count"""


class Reflex(Mover):
    """Sends the same command to the three fingers and keeps the preshape."""

    def command(self) -> list[float]:
        """Return σ of the four motors."""
        return [self.sigma, self.sigma, self.sigma, PRESHAPE]


def rotation_of(yaw_rad: float) -> Array:
    """Return world-from-hand (3, 3): palm down, turned by `yaw_rad` about the vertical."""
    return rot_zyz(yaw_rad, math.pi)


def choose(
    balls: Array, in_a: list[int], radius_m: float, box: palmares.Region, attempts: list[Attempt]
) -> Attempt | None:
    """Return the ball and the yaw that leave the fingers most room, or `None` if nothing is worth a try.

    `balls` (n, 3) are all centres, m; `in_a` are the rows of those to choose from.
    """
    best, best_room = None, -math.inf
    for ball in in_a:
        others = np.delete(balls, ball, axis=0)
        here = attempts_here(attempts, ball, balls[ball], MOVED_M)
        if len(here) >= TRIES:
            continue
        for yaw in YAWS_RAD:
            at = balls[ball] + (FINGERS - BALL_IN_HAND) @ rotation_of(yaw).T
            walls = np.minimum(at[:, :2] - box.min[:2], box.max[:2] - at[:, :2]).min()
            gaps = np.linalg.norm(at[:, None, :] - others[None, :, :], axis=2) - radius_m
            room = min(float(walls), float(gaps.min(initial=math.inf)))
            room -= sum(0.01 + 0.02 * max(0.0, math.cos(yaw - tried.yaw_rad)) for tried in here)
            if room > best_room:
                best, best_room = Attempt(ball, balls[ball].copy(), float(yaw)), room
    return best


def pick_and_carry(mover: Reflex, target: Attempt, box_b: palmares.Region) -> None:
    """Take the ball, carry it over box B and let it go."""
    rotation = rotation_of(target.yaw_rad)
    at = target.position - rotation @ BALL_IN_HAND
    above = array([at[0], at[1], HIGH_M])
    x, y, _ = box_b.center - rotation @ BALL_IN_HAND
    mover.to(1.0, above, quat_of(rotation), sigma=SIGMA_OPEN)
    mover.to(0.7, at)
    mover.to(0.9, sigma=SIGMA_CLOSED)
    mover.wait(0.3)
    mover.to(0.9, above)
    if np.any(truth_of(mover.obs).positions[:, 2] > LOW_M):
        mover.to(1.2, array([x, y, HIGH_M]))
        mover.to(0.6, array([x, y, LOW_M]))
    mover.to(0.6, sigma=0.0)
    mover.wait(0.4)
    mover.to(0.5, array([mover.position[0], mover.position[1], HIGH_M]))


@dataclass(frozen=True, kw_only=True)
class ReflexSummary(Summary):
    """The outcome of a run."""

    balls_in_b: int
    picks: int
    """Attempts made"""


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ReflexSummary:
    """Play one run of at most `picks` attempts."""
    mover = Reflex(client, client.reset("balls", "reflex", sensing="truth", seed=seed))
    box_a, box_b = client.scene.region("box_a"), client.scene.region("box_b")
    radius_m = largest_radius(client.scene)
    attempts: list[Attempt] = []
    with contextlib.suppress(RunOverError):  # Complete, or out of time: the result says which.
        while len(attempts) < picks:
            balls = truth_of(mover.obs).positions
            in_a = [ball for ball in range(len(balls)) if box_a.contains(balls[ball])]
            target = choose(balls, in_a, radius_m, box_a, attempts)
            if target is None:
                break
            attempts.append(target)
            pick_and_carry(mover, target, box_b)
            in_b = sum(box_b.contains(ball) for ball in truth_of(mover.obs).positions)
            LOG.info(f"pick {len(attempts):2}: {in_b:2} balls in B, {mover.obs.sim_time_s:6.1f} s simulated")
    result, summary = mover.stop()
    return ReflexSummary(
        **vars(summary),
        balls_in_b=result.in_goal,
        picks=len(attempts),
    )


if __name__ == "__main__":
    play(run, __doc__)
