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

import logging
import math
from pathlib import Path

import numpy as np

import palmares
from palmares import examples
from palmares.analysis import RobotArm
from palmares.arrays import Array, array
from palmares.examples.grasp_softhand import Grasp, attempt, keep_trying
from palmares.messages import Observation
from palmares.skills.holding import GraspSummary
from palmares.skills.motion import Line, Mover
from palmares.skills.objects import ObjectBounds
from palmares.skills.runs import play

LOG = logging.getLogger(__name__)

TASK = str(Path(examples.__file__).parent / "arm")
"""The folder of the task"""
SHARE_OF_SPEED = 0.9
"""Share of the largest speed of a joint that a motion uses"""
ANOTHER_BRANCH_RAD = 0.5
"""Change of a joint in a tick that no motion has: the solution is one with another elbow"""


class OutOfReachError(palmares.PalmaresError):
    """The arm does not come where a motion leads."""

    code = "out_of_reach"


class ArmMover(Mover):
    """As `Mover`, by the joints of the arm, and slower where one of them needs it.

    Attributes:
        q: The last target of the joints, (n,), rad.

    """

    def __init__(self, client: palmares.Client, first: Observation, arm: RobotArm) -> None:
        super().__init__(client, first)
        if first.arm is None:
            raise ValueError(f"task {client.run.task!r} has no arm")
        self.arm, self.q = arm, array(first.arm.position)
        self._ahead: list[Array] = []

    def _shares(self, at: Line, total_s: float) -> list[float]:
        """Solve for the joints at every tick, and take longer where a joint is too fast.

        Raises:
            OutOfReachError: The arm does not reach a point of the line; nothing has moved.

        """
        while True:
            shares = super()._shares(at, total_s)
            joints = self._joints([at(x) for x in shares])
            before = array([self.q, *joints[:-1]])
            steps = np.abs(array(joints) - before) / self._tick_s
            slower = float((steps / self.arm.speed).max()) / SHARE_OF_SPEED
            if slower <= 1.0:
                self._ahead = joints
                return shares
            total_s *= 1.05 * slower

    def _joints(self, poses: list[tuple[Array, Array]]) -> list[Array]:
        """Return the joints for poses along a line."""
        line, last = [], self.q
        for position, quat_xyzw in poses:
            found = self.arm.inverse([*position, *quat_xyzw], start=last)
            if not found.is_there or np.abs(found.q - last).max() > ANOTHER_BRANCH_RAD:
                raise OutOfReachError(f"{np.round(position, 3)} m: out of reach, or only with another elbow")
            line.append(last := found.q)
        return line

    def _step(self) -> None:
        if self._ahead:
            self.q = self._ahead.pop(0)
        self.keep(self.client.step(base=palmares.joints(self.q), hand=self.command()))


def attempt_either_way(mover: Mover, target: ObjectBounds, yaw_rad: float, grasp: Grasp) -> None:
    """Grasp, lift and hold the object; a hand that looks the other way grasps as well."""
    for yaw in (yaw_rad, yaw_rad + math.pi):
        try:
            attempt(mover, target, yaw, grasp)
            break
        except OutOfReachError as error:
            LOG.info(str(error))


def run(client: palmares.Client, seed: int | None) -> GraspSummary:
    """Play one run."""
    first = client.reset(TASK, "softhand", sensing="truth", seed=seed)
    return keep_trying(ArmMover(client, first, RobotArm(TASK)), attempt_either_way)


if __name__ == "__main__":
    play(run, __doc__)
