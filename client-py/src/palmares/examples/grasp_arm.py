"""Grasp one object with the SoftHand on an arm of seven joints, by commands of the joints.

    python -m palmares.examples.grasp_arm --url local --seed 1

The folder `arm` of the package's examples is the task `grasp` with an arm: its `fr3.urdf` has the joints, and
the hand is where they bring it. This controller plans straight lines of the hand, solves for the joints at
every tick, slows down where a joint is too fast, and takes another grasp where the arm does not reach. It
needs `palmares serve --task FOLDER` with that folder, or --url local.

Every other controller of the task `grasp` plays it, too: the arm then follows poses and velocities of the
base, as far as its joints let it.
"""

from __future__ import annotations

import contextlib
import logging
import math
from pathlib import Path

import numpy as np

import palmares
from palmares import examples
from palmares.analysis import RobotArm
from palmares.arrays import Array, array
from palmares.examples.grasp_softhand import attempt, grasps_for
from palmares.messages import Observation
from palmares.rotation import angle_between, slerp
from palmares.skills.holding import GraspSummary, grasp_summary
from palmares.skills.motion import Mover, RunOverError, duration, smoothstep
from palmares.skills.objects import upright_box
from palmares.skills.runs import play

LOG = logging.getLogger(__name__)

TASK = str(Path(examples.__file__).parent / "arm")
"""The folder of the task"""
SHARE_OF_SPEED = 0.9
"""Share of the largest speed of a joint that a motion uses"""
TRIES = 8
"""Grasps to try"""


class OutOfReachError(palmares.PalmaresError):
    """The arm does not come where a motion leads."""

    code = "out_of_reach"


class ArmMover(Mover):
    """Moves the hand along straight lines by the joints of its arm.

    Attributes:
        q: The last target of the joints, (n,), rad.

    """

    def __init__(self, client: palmares.Client, first: Observation, arm: RobotArm) -> None:
        super().__init__(client, first)
        if first.arm is None:
            raise ValueError(f"task {client.run.task!r} has no arm")
        self.arm, self.q = arm, array(first.arm.position)

    def to(
        self,
        at_least_s: float,
        position: Array | None = None,
        quat_xyzw: Array | None = None,
        sigma: float | None = None,
    ) -> None:
        """Move hand and fingers as `Mover.to` does, slower where a joint needs more time.

        Raises:
            RunOverError: The run ended during the motion.
            OutOfReachError: The arm does not reach a point of the line; nothing has moved.

        """
        p0, q0, s0 = self.position, self.quat_xyzw, self.sigma
        p1 = p0 if position is None else position
        q1 = q0 if quat_xyzw is None else quat_xyzw
        s1 = s0 if sigma is None else sigma
        distance_m = float(np.linalg.norm(p1 - p0))
        total_s = duration(distance_m, angle_between(q0, q1), self._limits, at_least_s)
        while True:
            shares = [smoothstep((k + 1) * self._tick_s / total_s) for k in range(self._ticks(total_s))]
            joints = self._line(p0, p1, q0, q1, shares)
            steps = np.abs(np.diff([self.q, *joints], axis=0)) / self._tick_s
            slower = float((steps / self.arm.speed).max()) / SHARE_OF_SPEED
            if slower <= 1.0:
                break
            total_s *= 1.05 * slower
        for x, self.q in zip(shares, joints, strict=True):
            self.position, self.quat_xyzw = p0 + x * (p1 - p0), slerp(q0, q1, x)
            self.sigma = s0 + x * (s1 - s0)
            self._step()

    def _ticks(self, total_s: float) -> int:
        return max(1, math.ceil(total_s / self._tick_s))

    def _line(self, p0: Array, p1: Array, q0: Array, q1: Array, shares: list[float]) -> list[Array]:
        """Return the joints at each share of a line."""
        line, last = [], self.q
        for x in shares:
            found = self.arm.inverse([*(p0 + x * (p1 - p0)), *slerp(q0, q1, x)], start=last)
            if not found.is_there or np.abs(found.q - last).max() > 0.5:  # Another branch.
                raise OutOfReachError(f"{np.round(p1, 3)} m: out of reach, or only with another elbow")
            line.append(last := found.q)
        return line

    def _step(self) -> None:
        self.obs = self.client.step(base=palmares.joints(self.q), hand=self.command())
        if self.obs.done:
            raise RunOverError(self.obs.reason)


def run(client: palmares.Client, seed: int | None) -> GraspSummary:
    """Play one run."""
    mover = ArmMover(client, client.reset(TASK, "softhand", sensing="truth", seed=seed), RobotArm(TASK))
    first, _ = upright_box(client.scene, mover.obs, 0)
    tries = 0
    with contextlib.suppress(RunOverError):  # The shake is over.
        while tries < TRIES:
            target, yaw_rad = upright_box(client.scene, mover.obs, 0)
            grasps = grasps_for(target.size, client.scene.free[0].mass)
            grasp, turn_rad = grasps[tries % len(grasps)]
            tries += 1
            # A hand that looks the other way grasps as well.
            for yaw in (yaw_rad + turn_rad, yaw_rad + turn_rad + math.pi):
                try:
                    LOG.info(f"{target.name}: {grasp.name}, turned by {yaw:.2f} rad")
                    attempt(mover, target, yaw, grasp)
                    break
                except OutOfReachError as error:
                    LOG.info(str(error))
    return grasp_summary(mover, first, tries)


if __name__ == "__main__":
    play(run, __doc__)
