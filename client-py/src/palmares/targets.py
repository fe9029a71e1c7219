"""Targets in an action: pose or velocity of the base, joints of the arm, positions of the motors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeAlias

import numpy as np

from palmares.arguments import short
from palmares.arrays import Array, Vec3
from palmares.errors import BadActionError
from palmares.wire import Action, BaseTarget

Numbers: TypeAlias = Iterable[float] | Array
"""A list, a tuple, an array or another iterable of numbers"""
Base: TypeAlias = BaseTarget | Numbers | tuple[Numbers, Numbers]
"""A target, or a pose as ``(position, quat_xyzw)`` or as seven numbers"""
BaseKind: TypeAlias = Literal["twist", "pose", "joints"]
"""The base in arrays of actions: velocities, the pose that it moves to, or joints of its arm"""
Hand: TypeAlias = float | Numbers
"""A number of every motor, such as σ; for a single motor also a number"""


def pose(position: Numbers, quat_xyzw: Numbers) -> BaseTarget:
    """Return a pose target: `position` (3,), m, and `quat_xyzw` (4,), world frame."""
    qx, qy, qz, qw = numbers("quat_xyzw", quat_xyzw, 4, "x, y, z, w")
    return BaseTarget(position=vector("position", position), quat_xyzw=(qx, qy, qz, qw))


def twist(linear: Numbers, angular: Numbers) -> BaseTarget:
    """Return a velocity target: `linear` (3,), m/s, and `angular` (3,), rad/s, world frame."""
    return BaseTarget(linear=vector("linear", linear), angular=vector("angular", angular))


def joints(q: Numbers) -> BaseTarget:
    """Return a target of the arm's joints: `q` (n,), rad or m, in the order of `TaskInfo.arm`."""
    listed = list(np.asarray(q).tolist()) if isinstance(q, np.ndarray) else list(q)
    return BaseTarget(joints=numbers("joints", listed, len(listed), "a number for each joint of the arm"))


def action_of(base: Base | None, hand: Hand | None, motors: int, effort: Hand | None = None) -> Action:
    """Return the action for a hand with `motors` motors; ``None`` keeps the last target."""
    return Action(
        base=base if base is None or isinstance(base, BaseTarget) else _pose_of(base),
        hand=None if hand is None else _of_motors("hand", "σ", hand, motors),
        effort=None if effort is None else _of_motors("effort", "the effort", effort, motors),
    )


def vector(field: str, value: Numbers) -> Vec3:
    """Return three numbers as floats; see `numbers`."""
    x, y, z = numbers(field, value, 3, "x, y, z")
    return (x, y, z)


def numbers(field: str, value: Any, count: int, meaning: str) -> list[float]:
    """Return `count` numbers as floats.

    Raises:
        BadActionError: The shape differs or a number is not finite; the message names field and shapes.

    """
    if (
        type(value) in (list, tuple)
        and len(value) == count
        and all(type(x) is float and math.isfinite(x) for x in value)
    ):
        return list(value)  # The usual case, without the cost of NumPy.
    wanted = f"shape ({count},): {meaning}"
    if not isinstance(value, str | bytes | np.ndarray) and isinstance(value, Iterable):
        value = list(value)
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.array(None)  # Lists of different lengths.
    if array.dtype.kind not in "fiub":
        found = f"{type(value).__name__} {short(value)}"
        raise BadActionError(f"{field}: found {found}, which are not numbers; wanted {wanted}")
    if array.shape != (count,):
        found = f"the single number {array}" if array.ndim == 0 else f"shape {array.shape}"
        raise BadActionError(f"{field}: found {found}; wanted {wanted}")
    if not np.isfinite(array).all():
        raise BadActionError(f"{field}: found {short(array.tolist())}; wanted finite numbers")
    listed: list[float] = array.astype(np.float64).tolist()
    return listed


def _of_motors(field: str, what: str, value: Hand, motors: int) -> list[float]:
    single = value.ndim == 0 if isinstance(value, np.ndarray) else isinstance(value, int | float | np.number)
    meaning = f"{what} of the motor" if motors == 1 else f"{what} of every motor"
    return numbers(field, [value] if motors == 1 and single else value, motors, meaning)


def _pose_of(base: Numbers | tuple[Numbers, Numbers]) -> BaseTarget:
    if isinstance(base, Mapping):
        found = f"a dictionary with {', '.join(map(str, base))}" if base else "an empty dictionary"
        wanted = "palmares.twist(linear, angular), palmares.pose(position, quat_xyzw) or palmares.joints(q)"
        raise BadActionError(f"base: found {found}; wanted {wanted}")
    parts: Any = list(base) if isinstance(base, Iterable) else base
    if isinstance(parts, list) and len(parts) == 2:
        quat_xyzw = numbers("base: quat_xyzw", parts[1], 4, "x, y, z, w")
        return pose(vector("base: position", parts[0]), quat_xyzw)
    meaning = (
        "position and quat_xyzw; or palmares.pose(…), or palmares.twist(…) for a velocity; "
        "σ of the motors is `hand=`"
    )
    seven = numbers("base", parts, 7, meaning)
    return pose(seven[:3], seven[3:])
