"""Where the base should go."""

from __future__ import annotations

from collections.abc import Iterable

from palmares.messages import Action, BaseTarget


def pose(position: Iterable[float], quat_xyzw: Iterable[float]) -> BaseTarget:
    """Return a base target: be at `position` (m) with orientation `quat_xyzw`, world frame."""
    x, y, z = map(float, position)
    qx, qy, qz, qw = map(float, quat_xyzw)
    return BaseTarget(position=(x, y, z), quat_xyzw=(qx, qy, qz, qw))


def twist(linear: Iterable[float], angular: Iterable[float]) -> BaseTarget:
    """Return a base target: move with `linear` (m/s) and `angular` (rad/s), world frame."""
    vx, vy, vz = map(float, linear)
    wx, wy, wz = map(float, angular)
    return BaseTarget(linear=(vx, vy, vz), angular=(wx, wy, wz))


def action_of(base: BaseTarget | None, hand: Iterable[float] | None) -> Action:
    """Return the action with these targets; ``None`` keeps the last one."""
    return Action(base=base, hand=None if hand is None else list(map(float, hand)))
