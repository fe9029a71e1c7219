"""Commands of other ROS nodes; without DDS."""

from __future__ import annotations

import math
from types import SimpleNamespace as Message
from typing import Any

import pytest

from palmares.bridges.ros2 import commands

NAN, INF = math.nan, math.inf


def header(frame: str) -> Any:
    return Message(frame_id=frame)


def xyz(*numbers: float) -> Any:
    return Message(**dict(zip("xyzw", numbers, strict=False)))


def pose_of(at: Any = None, turn: Any = None, frame: str = "world") -> Any:
    place = Message(position=at or xyz(0.1, 0.2, 0.3), orientation=turn or xyz(0.0, 1.0, 0.0, 0.0))
    return Message(header=header(frame), pose=place)


def twist_of(linear: Any, angular: Any, frame: str = "") -> Any:
    return Message(header=header(frame), twist=Message(linear=linear, angular=angular))


@pytest.mark.parametrize("frame", ["", "world"])
def test_good_commands_are_targets(frame: str) -> None:
    target: Any = commands.base_pose(pose_of(frame=frame))
    assert (target.position, target.quat_xyzw) == ((0.1, 0.2, 0.3), (0.0, 1.0, 0.0, 0.0))
    moving: Any = commands.base_twist(twist_of(xyz(0.1, 0.2, 0.3), xyz(0.0, 0.0, 1.0), frame))
    assert (moving.linear, moving.angular) == ((0.1, 0.2, 0.3), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (pose_of(at=xyz(NAN, 0.0, 0.5)), "pose.position: nan is not finite"),
        (pose_of(turn=xyz(0.0, 0.0, 0.0, INF)), "pose.orientation: inf is not finite"),
        (pose_of(turn=xyz(0.0, 0.0, 0.0, 0.0)), "the quaternion has length 0"),
        (pose_of(frame="camera/wrist"), "'camera/wrist'; transform it to 'world'"),
        (pose_of(frame="hand/base"), "'hand/base'; transform it to 'world'"),
    ],
)
def test_bad_poses_are_refused(command: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        commands.base_pose(command)


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (twist_of(xyz(-INF, 0.0, 0.0), xyz(0.0, 0.0, 0.0)), "twist.linear: -inf is not finite"),
        (twist_of(xyz(0.0, 0.0, 0.0), xyz(0.0, NAN, 0.0)), "twist.angular: nan is not finite"),
        (twist_of(xyz(0.0, 0.0, 0.0), xyz(0.0, 0.0, 0.0), "map"), "'map'; transform it to 'world'"),
    ],
)
def test_bad_velocities_are_refused(command: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        commands.base_twist(command)


@pytest.mark.parametrize(
    ("names", "positions", "why"),
    [
        (["a"], [NAN], "position of a: nan is not finite"),
        (["a", "b"], [0.5, INF], "position of b: inf is not finite"),
        (["c"], [0.5], "no motor 'c'; the hand has a, b"),
        (["a"], [], "1 names, 0 positions"),
        ([], [0.5], "0 names, 1 positions"),
    ],
)
def test_bad_commands_of_motors_are_refused(names: list[str], positions: list[float], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        commands.motor_targets(Message(name=names, position=positions), ["a", "b"], [0.1, 0.2])


def test_a_remark_is_made_once(capsys: pytest.CaptureFixture[str]) -> None:
    remarks = commands.Remarks()
    for k in range(200):
        remarks.make("joint_command", ValueError("position of a: nan is not finite"))
        remarks.make("joint_command", ValueError(f"no motor 'm{k}'"))
    said = capsys.readouterr().err.splitlines()
    assert len(said) == commands.MOST_REMARKS
    assert sum("nan is not finite; the message was ignored" in line for line in said) == 1
