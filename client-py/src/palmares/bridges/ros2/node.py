"""The topics of the bridge: one publisher or subscriber for each."""

from __future__ import annotations

from typing import Any

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from palmares.bridges.ros2 import commands, convert
from palmares.bridges.ros2 import messages as ros
from palmares.messages import Observation
from palmares.targets import Base, twist
from palmares.wire import HandInfo

# As ROS 2 has them by default: reliable, the last 10, nothing for late subscribers, and its encoding.
QOS = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.History.KeepLast(10),
    Policy.Durability.Volatile,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


class Node:
    """The bridge on a DDS domain.

    Args:
        domain: The domain, `ROS_DOMAIN_ID` of ROS.
        hand: The hand of the run.
        cameras: The cameras whose depth is published.
        velocity_timeout_s: Simulated time after which a velocity of the base that is not repeated becomes
            zero.

    """

    def __init__(
        self, domain: int, hand: HandInfo, cameras: list[str], velocity_timeout_s: float = 0.5
    ) -> None:
        self._participant = DomainParticipant(domain)
        self._hand = hand
        self._motors = hand.motors
        self._clock = self._writer("clock", ros.Clock)
        self._joints = self._writer("joint_states", ros.JointState)
        self._wrench = self._writer("wrist/wrench", ros.WrenchStamped)
        # A topic that never speaks would mislead.
        self._tactile = self._writer("tactile", ros.Float64MultiArray) if hand.taxels else None
        self._base = self._writer("base/pose", ros.PoseStamped)
        self._frames = self._writer("tf", ros.TFMessage)
        self._score = self._writer("score", ros.Float64)
        self._depth = {name: self._writer(f"{name}/depth/image_raw", ros.Image) for name in cameras}
        self._info = {name: self._writer(f"{name}/depth/camera_info", ros.CameraInfo) for name in cameras}
        self._target_pose = self._reader("base/target_pose", ros.PoseStamped)
        self._target_twist = self._reader("base/target_twist", ros.TwistStamped)
        self._command = self._reader("joint_command", ros.JointState)
        self._timeout_s = velocity_timeout_s
        self._remarks = commands.Remarks()
        self._base_target: Base | None = None
        self._moving_until_s: float | None = None
        self._hand_target: list[float] | None = None

    def publish(self, observation: Observation) -> None:
        """Publish an observation; all messages have its simulated time."""
        now, hand = convert.time_of(observation.sim_time_s), observation.hand
        self._clock.write(ros.Clock(clock=now))
        self._frames.write(convert.frames(observation, now))
        self._joints.write(convert.joint_state(observation, self._hand, now))
        self._wrench.write(convert.wrench(hand, now))
        self._base.write(convert.base_pose(hand, now))
        self._score.write(ros.Float64(data=observation.score))
        if self._tactile is not None:
            self._tactile.write(convert.tactile(hand))
        for name, image in observation.cameras.items():
            self._depth[name].write(convert.depth(image, now))
            self._info[name].write(convert.camera_info(image, now))

    def targets(self, observation: Observation) -> tuple[Base | None, list[float] | None]:
        """Return the newest targets of base and motors; None before the first command."""
        for wanted in self._target_pose.take(N=100):
            try:
                self._base_target = commands.base_pose(wanted)
                self._moving_until_s = None
            except ValueError as wrong:
                self._remarks.make("base/target_pose", wrong)
        for moving in self._target_twist.take(N=100):
            try:
                self._base_target = commands.base_twist(moving)
                self._moving_until_s = observation.sim_time_s + self._timeout_s
            except ValueError as wrong:
                self._remarks.make("base/target_twist", wrong)
        if self._moving_until_s is not None and observation.sim_time_s > self._moving_until_s:
            # Its node may have died.
            self._moving_until_s = None
            self._base_target = twist([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        for command in self._command.take(N=100):
            last = self._hand_target or [motor.command for motor in observation.hand.actuators]
            try:
                self._hand_target = commands.motor_targets(command, self._motors, last)
            except ValueError as wrong:
                self._remarks.make("joint_command", wrong)
        return self._base_target, self._hand_target

    def _writer(self, name: str, kind: Any) -> Any:
        return DataWriter(self._participant, self._topic(name, kind), qos=QOS)

    def _reader(self, name: str, kind: Any) -> Any:
        return DataReader(self._participant, self._topic(name, kind), qos=QOS)

    def _topic(self, name: str, kind: Any) -> Any:
        # ROS marks its topics with `rt/`.
        return Topic(self._participant, f"rt/{name}", kind, qos=QOS)
