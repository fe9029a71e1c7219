"""Commands of other nodes as targets. A node can send anything: what is no target is refused with a reason.

The messages are those of `palmares.bridges.ros2.messages`; nothing here needs DDS.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

from palmares.targets import Base, pose, twist

# Lengths below this are refused by servers.
SHORTEST = 1e-6
# Most different remarks of a run.
MOST_REMARKS = 50


class Remarks:
    """Prints each remark on a topic once: a node repeats its messages many times a second."""

    def __init__(self) -> None:
        self._made: set[str] = set()

    def make(self, topic: str, why: Exception) -> None:
        """Print why a message was ignored."""
        text = f"palmares ros2: /{topic}: {why}; the message was ignored"
        if text not in self._made and len(self._made) < MOST_REMARKS:
            self._made.add(text)
            print(f"{text}; this is said once", file=sys.stderr)


def base_pose(command: Any) -> Base:
    """Return the target of a ``PoseStamped``.

    Raises:
        ValueError: It is in another frame than the world, a number is not finite, or the quaternion has no
            length.

    """
    in_world(command.header.frame_id)
    at, turn = command.pose.position, command.pose.orientation
    position = finite("pose.position", [at.x, at.y, at.z])
    quat = finite("pose.orientation", [turn.x, turn.y, turn.z, turn.w])
    if math.hypot(*quat) < SHORTEST:
        raise ValueError("pose.orientation: the quaternion has length 0; a unit quaternion x y z w is wanted")
    return pose(position, quat)


def base_twist(command: Any) -> Base:
    """Return the target of a ``TwistStamped``.

    Raises:
        ValueError: It is in another frame than the world, or a number is not finite.

    """
    in_world(command.header.frame_id)
    v, w = command.twist.linear, command.twist.angular
    return twist(finite("twist.linear", [v.x, v.y, v.z]), finite("twist.angular", [w.x, w.y, w.z]))


def motor_targets(command: Any, motors: list[str], last: list[float]) -> list[float]:
    """Return σ of all motors: those that a ``JointState`` names, and the last ones of the others.

    Raises:
        ValueError: A name is no motor, the lists have different lengths, or a position is not finite.

    """
    if len(command.name) != len(command.position):
        raise ValueError(f"{len(command.name)} names, {len(command.position)} positions; expected as many")
    targets = dict(zip(motors, last, strict=True))
    for name, position in zip(command.name, command.position, strict=True):
        if name not in targets:
            raise ValueError(f"no motor {name!r}; the hand has {', '.join(motors)}")
        targets[name] = finite(f"position of {name}", [position])[0]
    return list(targets.values())


def in_world(frame: str) -> None:
    """Check that a message is in the frame ``world``, or names none.

    Raises:
        ValueError: It is in another frame.

    """
    if frame not in ("", "world"):
        raise ValueError(f"header.frame_id is {frame!r}; transform it to 'world'")


def finite(field: str, numbers: Sequence[float]) -> list[float]:
    """Return finite numbers.

    Raises:
        ValueError: A number is not finite.

    """
    for number in numbers:
        if not math.isfinite(number):
            raise ValueError(f"{field}: {number} is not finite")
    return [float(number) for number in numbers]
