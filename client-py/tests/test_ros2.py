"""`palmares ros2`: its types against the definitions of ROS in the package rosbags, and a run over DDS."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest

import palmares
from tests.real_server import RealServer, needs_server

pytest.importorskip("cyclonedds", reason="pip install 'palmares[ros2]' enables this test")

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from palmares.bridges.ros2 import commands
from palmares.bridges.ros2 import messages as ros
from palmares.bridges.ros2.node import QOS

Found = TypeVar("Found")
PROGRAM = [sys.executable, "-c", "from palmares.program import main; main()", "ros2"]
# A node of ROS 2 on RustDDS.
PEER = os.environ.get("PALMARES_DDS_PEER")
NOW = ros.Time(sec=3, nanosec=250)
HEADER = ros.Header(stamp=NOW, frame_id="world")
KINDS: list[tuple[str, Any]] = [
    ("rosgraph_msgs/msg/Clock", ros.Clock(clock=NOW)),
    ("std_msgs/msg/Float64", ros.Float64(data=1.5)),
    (
        "std_msgs/msg/Float64MultiArray",
        ros.Float64MultiArray(
            layout=ros.MultiArrayLayout(dim=[ros.MultiArrayDimension("taxel", 1, 3)]), data=[1.0, 2.0, 3.0]
        ),
    ),
    (
        "geometry_msgs/msg/PoseStamped",
        ros.PoseStamped(header=HEADER, pose=ros.Pose(ros.Point(1.0, 2.0, 3.0))),
    ),
    ("geometry_msgs/msg/TwistStamped", ros.TwistStamped(HEADER, ros.Twist(ros.Vector3(1.0, 2.0, 3.0)))),
    ("geometry_msgs/msg/WrenchStamped", ros.WrenchStamped(HEADER, ros.Wrench(ros.Vector3(1.0, 2.0, 3.0)))),
    ("tf2_msgs/msg/TFMessage", ros.TFMessage([ros.TransformStamped(HEADER, "base")])),
    ("sensor_msgs/msg/JointState", ros.JointState(HEADER, ["motor", "thumb"], [0.5, 0.25], [], [1.0, 2.0])),
    ("sensor_msgs/msg/Image", ros.Image(HEADER, 1, 2, "32FC1", 0, 8, bytes(range(8)))),
    ("sensor_msgs/msg/CameraInfo", ros.CameraInfo(HEADER, 1, 2, "plumb_bob", [0.0] * 5, list(range(9)))),
]


def plain(value: Any) -> Any:
    """Return a message as numbers, texts, lists and dictionaries."""
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, bytes | list | tuple | np.ndarray):
        return [plain(each) for each in (value.tolist() if isinstance(value, np.ndarray) else value)]
    fields = getattr(value, "__dataclass_fields__", None)
    assert fields is not None, value
    names = [name for name in fields if not name.startswith("__")]
    return {name.lower(): plain(getattr(value, name)) for name in names}


@pytest.mark.parametrize(("name", "message"), KINDS, ids=[name for name, _ in KINDS])
def test_messages_have_the_bytes_of_ros(name: str, message: Any) -> None:
    typesys = pytest.importorskip("rosbags.typesys", reason="pip install rosbags enables this test")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    package, _, kind = name.split("/")
    assert message.__idl__.idl_transformed_typename == f"{package}::msg::dds_::{kind}_"
    theirs = store.deserialize_cdr(message.serialize(use_version_2=False), name)
    assert plain(theirs) == plain(message)
    ours = type(message).deserialize(bytes(store.serialize_cdr(theirs, name)))
    assert plain(ours) == plain(message)


def test_a_command_names_motors() -> None:
    command = ros.JointState(name=["b"], position=[0.5])
    assert commands.motor_targets(command, ["a", "b"], [0.1, 0.2]) == [0.1, 0.5]
    with pytest.raises(ValueError, match="no motor 'b'; the hand has a"):
        commands.motor_targets(command, ["a"], [0.1])
    with pytest.raises(ValueError, match="1 names, 0 positions"):
        commands.motor_targets(ros.JointState(name=["b"]), ["b"], [0.1])


def until(found: Callable[[], Found | None]) -> Found:
    """Return the first answer that is not None."""
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        value = found()
        if value is not None:
            return value
        time.sleep(0.02)
    raise AssertionError("nothing came within 60 s")


def tcp_ports(pid: int) -> list[int]:
    """Return the TCP ports on which a process listens. Linux only."""
    sockets = {os.readlink(link) for link in Path(f"/proc/{pid}/fd").iterdir() if link.is_symlink()}
    rows = [
        row.split()
        for table in ("tcp", "tcp6")
        for row in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]
    ]
    listening, inode = "0A", 9
    return [
        int(row[1].rsplit(":", 1)[1], 16)
        for row in rows
        if row[3] == listening and f"socket:[{row[inode]}]" in sockets
    ]


@needs_server
def test_a_node_reads_sensors_and_moves_the_hand(tmp_path: Path) -> None:
    domain = 70 + os.getpid() % 60
    participant = DomainParticipant(domain)

    def reader(name: str, kind: Any) -> Any:
        return DataReader(participant, Topic(participant, f"rt/{name}", kind, qos=QOS), qos=QOS)

    def writer(name: str, kind: Any) -> Any:
        return DataWriter(participant, Topic(participant, f"rt/{name}", kind, qos=QOS), qos=QOS)

    def newest(source: Any) -> Any:
        taken = source.take(N=100)
        return taken[-1] if taken else None

    joints, clock, frames = (
        reader("joint_states", ros.JointState),
        reader("clock", ros.Clock),
        reader("tf", ros.TFMessage),
    )
    wrench = reader("wrist/wrench", ros.WrenchStamped)
    written_topics = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    command, twist = writer("joint_command", ros.JointState), writer("base/target_twist", ros.TwistStamped)
    with RealServer(tmp_path) as server:
        with palmares.Client(server.url, team="look") as client:
            camera = client.welcome.task("grasp").cameras[0].name
        images = reader(f"{camera}/depth/image_raw", ros.Image)
        options = ["--url", server.url, "--seed", "1", "--domain", str(domain), "--camera", camera]
        process = subprocess.Popen([*PROGRAM, *options], env=os.environ)
        try:
            first = until(lambda: newest(joints))
            motor = first.name[0]
            assert len(first.name) == len(first.position) > 10
            if sys.platform == "linux":
                # DDS is UDP: a web page, which speaks HTTP and WebSocket, reaches nothing of it.
                assert tcp_ports(os.getpid()) == tcp_ports(process.pid) == []
            # The SoftHand has no taxels.
            topics = {written.topic_name for written in written_topics.take(N=200)}
            assert "rt/wrist/wrench" in topics
            assert "rt/tactile" not in topics
            start = until(lambda: newest(frames)).transforms[0]
            assert (start.header.frame_id, start.child_frame_id) == ("world", "hand/base")

            def closed() -> float | None:
                command.write(ros.JointState(name=[motor], position=[0.5]))
                twist.write(ros.TwistStamped(twist=ros.Twist(linear=ros.Vector3(z=0.05))))
                state = newest(joints)
                return state.position[0] if state is not None and state.position[0] > 0.2 else None

            assert until(closed) <= 0.5 + 1e-6

            def higher() -> float | None:
                now = newest(frames)
                rise = (
                    0.0
                    if now is None
                    else now.transforms[0].transform.translation.z - start.transform.translation.z
                )
                return rise if rise > 0.005 else None

            until(higher)
            heights: list[float] = []

            def stopped() -> bool | None:
                now = newest(frames)
                if now is not None:
                    heights.append(now.transforms[0].transform.translation.z)
                return (len(heights) > 20 and max(heights[-20:]) - min(heights[-20:]) < 1e-4) or None

            until(stopped)  # Nobody repeats the velocity.
            assert until(lambda: newest(clock)).clock.nanosec >= 0
            assert until(lambda: newest(wrench)).header.frame_id == "hand/base"
            image = until(lambda: newest(images))
            depth = np.frombuffer(bytes(image.data), "<f4").reshape(image.height, image.width)
            assert 0.05 < np.nanmin(depth) < 5.0
            assert math.isfinite(float(np.nanmax(depth)))
        finally:
            process.kill()
            process.wait()


@needs_server
@pytest.mark.skipif(
    PEER is None, reason="PALMARES_DDS_PEER names no program; tests/ros2_peer has its sources"
)
def test_a_node_on_another_implementation_of_dds_moves_the_hand(tmp_path: Path) -> None:
    domain = str(130 + os.getpid() % 60)
    with RealServer(tmp_path) as server:
        options = ["--url", server.url, "--seed", "1", "--domain", domain]
        process = subprocess.Popen([*PROGRAM, *options], env=os.environ)
        try:
            words = [str(PEER), domain, "motor", "0.5"]
            done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
            assert done.returncode == 0, done.stderr
            rows = {
                name: [float(x) for x in rest] for name, *rest in map(str.split, done.stdout.splitlines())
            }
            position, _, tension = rows["motor"]
            assert position == pytest.approx(0.5, abs=0.011)
            assert tension > 0.0
            assert len(rows) > 10
        finally:
            process.kill()
            process.wait()
