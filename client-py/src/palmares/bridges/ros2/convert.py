"""Observations as messages of ROS 2, and messages as targets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palmares.bridges.ros2 import messages as ros
from palmares.cameras import CameraImage
from palmares.messages import HandState, Observation
from palmares.rotation import matrix_of
from palmares.wire import HandInfo

WORLD, BASE = "world", "hand/base"


def time_of(seconds: float) -> ros.Time:
    """Return simulated time as a time of ROS."""
    ns = round(seconds * 1e9)
    return ros.Time(sec=ns // 1_000_000_000, nanosec=ns % 1_000_000_000)


def joint_state(observation: Observation, info: HandInfo, now: ros.Time) -> ros.JointState:
    """Return motors (σ, 1/s, tension), then joints (rad, rad/s, no effort).

    With sensing `truth` these are all joint coordinates, else the joints with an encoder, without velocity.
    """
    motors = observation.hand.actuators
    if not observation.has_truth:
        names, angles = info.encoders, observation.hand.joints
        speeds = np.full(len(angles), np.nan)
    else:
        joints = observation.truth.joints
        names, angles, speeds = info.joints, joints.position, joints.velocity
    return ros.JointState(
        header=ros.Header(stamp=now, frame_id=BASE),
        name=[*(motor.name for motor in motors), *names],
        position=[*(motor.position for motor in motors), *angles.tolist()],
        velocity=[*(motor.velocity for motor in motors), *speeds.tolist()],
        effort=[*(motor.tension for motor in motors), *[math.nan] * len(angles)],
    )


def wrench(hand: HandState, now: ros.Time) -> ros.WrenchStamped:
    """Return force and torque at the wrist in the frame of the base."""
    to_base = matrix_of(hand.base.quat_xyzw).T
    return ros.WrenchStamped(
        header=ros.Header(stamp=now, frame_id=BASE),
        wrench=ros.Wrench(
            force=vector(to_base @ np.array(hand.wrist.force)),
            torque=vector(to_base @ np.array(hand.wrist.torque)),
        ),
    )


def tactile(hand: HandState) -> ros.Float64MultiArray:
    """Return the forces on the taxels, (taxels, 3), N."""
    rows, columns = len(hand.touch), 3
    layout = ros.MultiArrayLayout(
        dim=[
            ros.MultiArrayDimension(label="taxel", size=rows, stride=rows * columns),
            ros.MultiArrayDimension(label="force", size=columns, stride=columns),
        ]
    )
    return ros.Float64MultiArray(layout=layout, data=[float(x) for x in hand.touch.ravel()])


def base_pose(hand: HandState, now: ros.Time) -> ros.PoseStamped:
    """Return the pose of the base in the world."""
    x, y, z = hand.base.position
    pose = ros.Pose(position=ros.Point(x=x, y=y, z=z), orientation=quaternion(hand.base.quat_xyzw))
    return ros.PoseStamped(header=ros.Header(stamp=now, frame_id=WORLD), pose=pose)


def frames(observation: Observation, now: ros.Time) -> ros.TFMessage:
    """Return the frames of base, cameras and, with sensing `truth`, objects; all of them in the world."""
    base = observation.hand.base
    places = [(BASE, base.position, base.quat_xyzw)]
    for image in observation.cameras.values():
        places.append((optical_frame(image), image.position, image.quat_xyzw))
    if observation.has_truth:
        for body in observation.truth.objects:
            places.append((body.name, body.position, body.quat_xyzw))
    return ros.TFMessage(
        transforms=[
            ros.TransformStamped(
                header=ros.Header(stamp=now, frame_id=WORLD),
                child_frame_id=name,
                transform=ros.Transform(translation=vector(position), rotation=quaternion(turn)),
            )
            for name, position, turn in places
        ]
    )


def optical_frame(image: CameraImage) -> str:
    """Return the name of a camera's frame: x right, y down, z forward, as ROS has it."""
    return f"camera/{image.camera}"


def depth(image: CameraImage, now: ros.Time) -> ros.Image:
    """Return a depth image: 32FC1, m, NaN without a reading."""
    pixels = np.ascontiguousarray(image.depth, "<f4")
    return ros.Image(
        header=ros.Header(stamp=now, frame_id=optical_frame(image)),
        height=image.height,
        width=image.width,
        encoding="32FC1",
        step=4 * image.width,
        data=pixels.tobytes(),
    )


def camera_info(image: CameraImage, now: ros.Time) -> ros.CameraInfo:
    """Return the pinhole of a camera. ROS has the middle of the first pixel at 0, 0, Palmares at 0.5, 0.5."""
    fx, fy, cx, cy = image.fx, image.fy, image.cx - 0.5, image.cy - 0.5
    return ros.CameraInfo(
        header=ros.Header(stamp=now, frame_id=optical_frame(image)),
        height=image.height,
        width=image.width,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def vector(xyz: Any) -> ros.Vector3:
    """Return three numbers as a vector."""
    x, y, z = (float(value) for value in xyz)
    return ros.Vector3(x=x, y=y, z=z)


def quaternion(xyzw: Any) -> ros.Quaternion:
    """Return x, y, z, w as a quaternion."""
    x, y, z, w = (float(value) for value in xyzw)
    return ros.Quaternion(x=x, y=y, z=z, w=w)
