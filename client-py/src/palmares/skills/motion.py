"""Motions of the hand's base, tick by tick, within the limits of its servo.

>>> mover = Mover(client, client.reset("balls", "softhand"))      # doctest: +SKIP
... mover.to(1.0, position, quat_xyzw, sigma=0.1)
... mover.wait(0.5)
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self, TypeAlias

from palmares.arrays import Array, array
from palmares.client import Client
from palmares.errors import PalmaresError
from palmares.messages import Observation, Result, Specs
from palmares.reproducible import mean, norm
from palmares.rotation import angle_between, slerp
from palmares.skills.runs import Summary
from palmares.targets import pose

__all__ = [
    "UP",
    "BaseLimits",
    "Mover",
    "RunOverError",
    "duration",
    "fling",
    "press",
    "smoothstep",
]

UP = array([0.0, 0.0, 1.0])
"""Unit vector upwards, (3,), world frame"""

Line: TypeAlias = Callable[[float], tuple[Array, Array]]
"""Position (3,) and orientation (4,) of the base at a share of a motion, 0 to 1"""
SHARE_OF_LIMITS = 0.95
"""`duration` uses this share of the limits; the servo needs the rest to correct errors"""


@dataclass(frozen=True)
class BaseLimits:
    """Limits of the servo of the hand's base. It follows a target within them without lag.

    The speeds are in `Welcome.specs`. No message has the accelerations; docs/protocol.md states them for
    `step`.
    """

    speed_m_s: float
    angular_speed_rad_s: float
    acceleration_m_s2: float = 4.0
    angular_acceleration_rad_s2: float = 4.0

    @classmethod
    def of(cls, specs: Specs) -> Self:
        """Return the limits with the speeds of the server's specs."""
        _, speed_m_s = specs.action_field("base.linear").range
        _, angular_speed_rad_s = specs.action_field("base.angular").range
        return cls(speed_m_s, angular_speed_rad_s)


def smoothstep(x: float) -> float:
    """Return the quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x * x * x * (10.0 - 15.0 * x + 6.0 * (x * x))


def duration(distance_m: float, angle_rad: float, limits: BaseLimits, at_least_s: float = 0.0) -> float:
    """Return the shortest duration, s, of a smoothstep over a distance and an angle within `limits`.

    The quintic's largest velocity is 15/8 of distance per time, its largest acceleration 10/√3 of distance
    per time squared.
    """
    velocity, acceleration = 15 / 8 / SHARE_OF_LIMITS, 10 / math.sqrt(3) / SHARE_OF_LIMITS
    return max(
        at_least_s,
        velocity * distance_m / limits.speed_m_s,
        velocity * angle_rad / limits.angular_speed_rad_s,
        math.sqrt(acceleration * distance_m / limits.acceleration_m_s2),
        math.sqrt(acceleration * angle_rad / limits.angular_acceleration_rad_s2),
    )


class RunOverError(PalmaresError):
    """The run ended: the task is complete, or a limit was reached."""

    code = "run_over"

    def __init__(self, reason: str | None) -> None:
        super().__init__(f"the run is over: {reason}")


class Mover:
    """Moves base and fingers of a lockstep run along smoothsteps, with a new target at every tick.

    Attributes:
        obs: The last observation.
        position: The base's last target, (3,), m, world frame.
        quat_xyzw: Its orientation, (4,).
        sigma: The last command of the motors, 0 (open) to 1 (closed).

    Args:
        client: A client with an open lockstep run.
        first: The observation that `Client.reset` returned.

    """

    def __init__(self, client: Client, first: Observation) -> None:
        self.client = client
        self.obs = first
        self.position = first.hand.base.xyz
        self.quat_xyzw = array(first.hand.base.quat_xyzw)
        self.sigma = first.hand.actuators[0].position
        self._limits = BaseLimits.of(client.welcome.specs)
        self._tick_s = client.run.tick_s
        self._started_s = time.monotonic()

    def to(
        self,
        at_least_s: float,
        position: Array | None = None,
        quat_xyzw: Array | None = None,
        sigma: float | None = None,
    ) -> None:
        """Move base and fingers together, in `at_least_s` or longer if the limits demand it.

        Omitted targets stay.

        Raises:
            RunOverError: The run ended during the motion.

        """
        p0, q0, s0 = self.position, self.quat_xyzw, self.sigma
        p1 = p0 if position is None else position
        q1 = q0 if quat_xyzw is None else quat_xyzw
        s1 = s0 if sigma is None else sigma
        distance_m = norm(p1 - p0)

        def at(x: float) -> tuple[Array, Array]:
            return p0 + x * (p1 - p0), slerp(q0, q1, x)

        total_s = duration(distance_m, angle_between(q0, q1), self._limits, at_least_s)
        for x in self._shares(at, total_s):
            self.position, self.quat_xyzw = at(x)
            self.sigma = s0 + x * (s1 - s0)
            self._step()

    def wait(self, duration_s: float) -> None:
        """Hold still."""
        for _ in range(round(duration_s / self._tick_s)):
            self._step()

    def wrist_force(self, duration_s: float) -> Array:
        """Hold still; return the mean force at the wrist, (3,), N."""
        forces = []
        for _ in range(round(duration_s / self._tick_s)):
            self._step()
            forces.append(self.obs.hand.wrist.force)
        return mean(forces)

    def keep(self, obs: Observation) -> None:
        """Keep the observation of a step of the run.

        Raises:
            RunOverError: The run is over.

        """
        self.obs = obs
        if obs.done:
            raise RunOverError(obs.reason)

    def command(self) -> list[float]:
        """Return σ of every motor; a subclass for a hand with several motors overrides this."""
        return [self.sigma]

    def stop(self) -> tuple[Result, Summary]:
        """Stop the run; return its result and a summary."""
        wall_s = time.monotonic() - self._started_s
        result = self.client.stop()
        summary = Summary(
            run_id=result.run_id,
            seed=self.client.run.seed,
            score=result.score,
            sim_time_s=result.sim_time_s,
            rtf=result.sim_time_s / wall_s,
        )
        return result, summary

    def _shares(self, at: Line, total_s: float) -> list[float]:  # noqa: ARG002 - for movers that plan
        """Return the share of a motion that is done after each tick; a subclass may take longer."""
        ticks = max(1, math.ceil(total_s / self._tick_s))
        return [smoothstep((tick + 1) / ticks) for tick in range(ticks)]

    def _step(self) -> None:
        self.keep(self.client.step(base=pose(self.position, self.quat_xyzw), hand=self.command()))


ACCELERATION = 3.9
"""Acceleration of the base in a fling, m/s²; its limit is 4"""


def fling(mover: Mover, position: Array, speed_m_s: float) -> None:
    """Move the base to `position` (3,), m, with full acceleration, at most at `speed_m_s`."""
    start = mover.position
    way = position - start
    far = norm(way)
    top = min(speed_m_s, math.sqrt(far * ACCELERATION))
    speeding_s = top / ACCELERATION
    total_s = far / top + speeding_s
    tick_s = mover.client.run.tick_s
    for tick in range(math.ceil(total_s / tick_s)):
        t = min((tick + 1) * tick_s, total_s)
        up, down = min(t, speeding_s), max(0.0, t - (total_s - speeding_s))
        gone = ACCELERATION * (up * up - down * down) / 2 + top * max(0.0, t - speeding_s)
        base = pose(start + way * (gone / far), mover.quat_xyzw)
        mover.keep(mover.client.step(base=base, hand=mover.command()))
    mover.position = position


def press(mover: Mover, press_n: float, most: int = 12) -> None:
    """Sink in steps of 3 mm, at most `most`, until the wrist force has changed by `press_n`."""
    idle = mover.wrist_force(0.05)
    for _ in range(most):
        if norm(mover.wrist_force(0.02) - idle) > press_n:
            break
        mover.to(0.04, mover.position - array([0.0, 0.0, 0.003]))
