"""The motion of a try: above the place before the object, down, to the object, closing, lifting."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from palmares.arrays import Array, array
from palmares.grasps.hand import Reach
from palmares.grasps.sample import Candidates
from palmares.reproducible import norm
from palmares.rotation import angle_between, slerp

TICK_S = 0.01
TICKS = 2
"""Ticks under each action; every phase has a whole number of actions"""
SPEED = 1.2
"""Largest speed of the base between two places, m/s; the world's limit is 2 m/s"""
TURN_SPEED = 2.6
"""Largest angular velocity of the base, rad/s; the world's limit is 3 rad/s"""
APPROACH_SPEED = 0.5
"""Largest speed of the base as it comes to the object, m/s"""
PEAK = 1.875
"""Largest over mean speed of the profile 10 x³ − 15 x⁴ + 6 x⁵"""
BEFORE_M = 0.16
"""Distance along the approach from which the hand comes"""
CLOSE_TICKS, WAIT_TICKS, LIFT_TICKS = 100, 20, 70
LIFT_M = 0.2
MOVE, LOWER, COME, CLOSE, WAIT, LIFT, STAY = range(7)
"""Phases of a try: above the place before the object, down to it, to the object, closing, waiting, lifting"""


class Course:
    """Motion of the hands of N worlds: where each one's base and motors go at its tick."""

    def __init__(self, count: int, start: Array, reach: Reach) -> None:
        self._start, self._reach = start, reach
        self._keys = np.tile(start[:3], (count, STAY + 2, 1))
        self._quats = np.tile(start[3:], (count, 2, 1))
        self._ends = np.tile(TICKS * np.arange(1, STAY + 2), (count, 1))

    def set(self, world: int, tries: Candidates, row: int) -> None:
        """Give a world its grasp."""
        at, quat, approach = tries.position[row], tries.quat[row], tries.approach[row]
        before = at - BEFORE_M * approach
        high = array([before[0], before[1], max(float(before[2]), float(self._start[2]))])
        keys = [self._start[:3], high, before, at, at, at, at + array([0.0, 0.0, LIFT_M])]
        self._keys[world] = [*keys, keys[-1]]
        self._quats[world] = self._start[3:], quat
        turn = angle_between(self._start[3:], quat)
        durations = [
            max(_ticks(high - keys[0], SPEED) // 2, _ceil(turn / TURN_SPEED / TICK_S)),
            _ticks(before - high, SPEED),
            _ticks(at - before, APPROACH_SPEED),
            CLOSE_TICKS,
            WAIT_TICKS,
            LIFT_TICKS,
            1_000_000,
        ]
        self._ends[world] = np.cumsum([TICKS * math.ceil(ticks / TICKS) for ticks in durations])

    def phase(self, ticks: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the phase of each world, (N,)."""
        return np.asarray(np.minimum(np.count_nonzero(ticks[:, None] >= self._ends, axis=1), STAY))

    def since_lift(self, ticks: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the ticks since the end of the lift, (N,)."""
        return np.asarray(ticks - self._ends[:, LIFT])

    def stop(self, worlds: NDArray[np.int64], ticks: NDArray[np.int64], at: Array) -> None:
        """End the approach of some worlds here: they close at `at` (k, 3)."""
        early = self._ends[worlds, COME] - ticks[worlds]
        self._ends[worlds, COME:STAY] -= early[:, None]
        self._keys[worlds, CLOSE] = self._keys[worlds, WAIT] = self._keys[worlds, LIFT] = at
        self._keys[worlds, STAY] = self._keys[worlds, STAY + 1] = at + array([0.0, 0.0, LIFT_M])

    def actions(self, ticks: NDArray[np.int64]) -> Array:
        """Return the poses of the bases and σ of the motors for the next ticks, (N, 7 + motors)."""
        rows = np.arange(len(ticks))
        phase = self.phase(ticks)
        begin = np.where(phase > 0, self._ends[rows, phase - 1], 0)
        share = (ticks + TICKS - begin) / (self._ends[rows, phase] - begin)
        x = np.clip(share, 0.0, 1.0)
        smooth = np.where(phase == MOVE, x, x * x * x * (10.0 + x * (6.0 * x - 15.0)))
        first, second = self._keys[rows, phase], self._keys[rows, phase + 1]
        position = first + smooth[:, None] * (second - first)
        quat = self._quats[:, 1].copy()
        for row in np.flatnonzero(phase == MOVE):
            start, end = self._quats[row]
            quat[row] = slerp(start, end, float(smooth[row]))
        wound = np.where(phase == CLOSE, smooth, np.where(phase > CLOSE, 1.0, 0.0))[:, None]
        sigma = self._reach.opened + wound * (self._reach.closed - self._reach.opened)
        return np.hstack([position, quat, sigma])


def _ceil(value: float) -> int:
    return max(1, math.ceil(value))


def _ticks(way: Array, speed: float) -> int:
    return _ceil(PEAK * norm(way) / speed / TICK_S)
