"""Motions of a hand's base that start and end at rest and stay within the base's limits.

>>> mover = Mover(client, client.reset("balls", "softhand"))      # doctest: +SKIP
... mover.to(1.0, position, quat_xyzw, sigma=0.1)
... mover.wait(0.5)
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from palmares.client import Client
from palmares.messages import Observation
from palmares.rotation import Array, angle_between, slerp
from palmares.targets import pose

# What the base can do: 2 m/s and 4 m/s², 3 rad/s and 4 rad/s². A target within is followed without lag.
BASE_SPEED = 0.95 * 2.0
BASE_ACCELERATION = 0.95 * 4.0
BASE_TURN_SPEED = 0.95 * 3.0
BASE_TURN_ACCELERATION = 0.95 * 4.0

TICK_S = 0.01
"""Length of a tick, s"""


class RunOverError(Exception):
    """The server ended the run: nothing more to gain, or a limit reached."""


def smoothstep(x: float) -> float:
    """Quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def duration(distance: float, angle: float, at_least: float) -> float:
    """Return a time (s) in which a smoothstep over `distance` (m) and `angle` (rad) stays within the limits.

    The quintic's greatest velocity is 15/8 of distance per time, its greatest acceleration 10/√3 of distance
    per time squared.
    """
    speed, acceleration = 15 / 8, 10 / math.sqrt(3)
    return max(
        at_least,
        speed * distance / BASE_SPEED,
        speed * angle / BASE_TURN_SPEED,
        math.sqrt(acceleration * distance / BASE_ACCELERATION),
        math.sqrt(acceleration * angle / BASE_TURN_ACCELERATION),
    )


class Mover:
    """Streams targets of a lockstep run tick by tick and remembers the last one.

    Args:
        client: With a run open.
        first: The observation that `reset` returned.
        watch: Called with every observation.

    """

    def __init__(
        self,
        client: Client,
        first: Observation,
        watch: Callable[[Observation], None] = lambda _: None,
    ) -> None:
        self.client = client
        self.obs = first
        self.watch = watch
        self.position: Array = first.hand.base.xyz
        self.quat: Array = np.array(first.hand.base.quat_xyzw)
        self.sigma = first.hand.actuators[0].position

    def to(
        self,
        seconds: float,
        position: Array | None = None,
        quat: Array | None = None,
        sigma: float | None = None,
    ) -> None:
        """Move base and fingers there together, in `seconds` or as fast as the base may."""
        p0, q0, s0 = self.position, self.quat, self.sigma
        p1 = p0 if position is None else position
        q1 = q0 if quat is None else quat
        s1 = s0 if sigma is None else sigma
        total = duration(float(np.linalg.norm(p1 - p0)), angle_between(q0, q1), seconds)
        ticks = max(1, math.ceil(total / TICK_S))
        for tick in range(ticks):
            x = smoothstep((tick + 1) / ticks)
            self.position, self.quat = p0 + x * (p1 - p0), slerp(q0, q1, x)
            self.sigma = s0 + x * (s1 - s0)
            self._step()

    def wait(self, seconds: float) -> None:
        """Hold still."""
        for _ in range(round(seconds / TICK_S)):
            self._step()

    def command(self) -> list[float]:
        """Return σ of every motor; a hand of several motors overrides this."""
        return [self.sigma]

    def _step(self) -> None:
        self.obs = self.client.step(base=pose(self.position, self.quat), hand=self.command())
        self.watch(self.obs)
        if self.obs.done:
            raise RunOverError(self.obs.reason)
