"""The arm that carries the hand in a task: forward and inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palmares._native import ArmModel
from palmares.analysis.contacts import Numbers, pose_of
from palmares.arrays import Array, array
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Reached(Brief):
    """Joints of an arm for a pose of the base."""

    q: Array
    """(n,), rad or m"""
    gap_m: float
    """Distance of the base from the pose"""
    gap_rad: float
    """Angle between the base and the pose"""

    @property
    def is_there(self) -> bool:
        """Whether the base is at the pose, to 1e-6 m and rad."""
        return self.gap_m < 1e-6 and self.gap_rad < 1e-6


class RobotArm:
    """The arm of a task.

    Attributes:
        joints: Names of its joints, in the order of ``base.joints`` of actions.
        lower: (n,), least positions, rad or m; −∞ of a joint without end.
        upper: (n,), largest positions.
        speed: (n,), largest speeds, 1/s.
        start: (n,), where the task looks first for the joints at the start.

    Args:
        task: The path of a task with an arm.

    Raises:
        ValueError: The task has no arm, or cannot be read.

    """

    joints: tuple[str, ...]
    lower: Array
    upper: Array
    speed: Array
    start: Array

    def __init__(self, task: str) -> None:
        self._native = ArmModel(str(task))
        self.joints = tuple(self._native.joints)
        self.lower, self.upper, self.speed = self._native.limits().T
        self.start = array(self._native.start)

    def __repr__(self) -> str:
        """Return its joints."""
        return f"RobotArm({', '.join(self.joints)})"

    def base(self, q: ArrayLike) -> Array:
        """Return the pose of the hand's base, (7,): position, m, and quaternion x y z w."""
        return array(self._native.base(self._joints(q)))

    def jacobian(self, q: ArrayLike) -> Array:
        """Return the geometric Jacobian (6, n) at the base's origin, world frame: linear, then angular."""
        return self._native.jacobian(self._joints(q)).T

    def inverse(self, base: Numbers, start: ArrayLike | None = None) -> Reached:
        """Return joints within their ranges for a pose of the hand's base, or those that come nearest.

        From `start` by the method of Levenberg (1944); where that ends elsewhere from 64 places all over the
        ranges. An arm with more than six joints has many solutions: the one found is near its start.

        Args:
            base: Position and quaternion x y z w, seven numbers.
            start: (n,), where the search begins; `RobotArm.start` when left out.

        """
        joints = self._joints(self.start if start is None else start)
        return Reached(**self._native.inverse(pose_of("base", base), joints))

    def _joints(self, q: ArrayLike) -> Sequence[float]:
        listed: list[float] = np.asarray(q, dtype=np.float64).ravel().tolist()
        return listed
