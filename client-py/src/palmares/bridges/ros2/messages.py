"""Standard messages of ROS 2 as types of DDS, made of their definitions.

ROS writes the message `sensor_msgs/msg/JointState` as the DDS type `sensor_msgs::msg::dds_::JointState_`,
and the topic `/joint_states` as `rt/joint_states`. Fields, their order and their types are those of
<https://github.com/ros2/common_interfaces> and <https://github.com/ros2/rcl_interfaces>.
"""

from __future__ import annotations

import types
from dataclasses import dataclass, field
from typing import Any

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, int32, sequence, uint8, uint32

DEFINITIONS = """
builtin_interfaces Time: int32 sec, uint32 nanosec
std_msgs Header: Time stamp, string frame_id
std_msgs Float64: float64 data
std_msgs MultiArrayDimension: string label, uint32 size, uint32 stride
std_msgs MultiArrayLayout: MultiArrayDimension[] dim, uint32 data_offset
std_msgs Float64MultiArray: MultiArrayLayout layout, float64[] data
geometry_msgs Vector3: float64 x, float64 y, float64 z
geometry_msgs Point: float64 x, float64 y, float64 z
geometry_msgs Quaternion: float64 x, float64 y, float64 z, float64 w = 1
geometry_msgs Pose: Point position, Quaternion orientation
geometry_msgs PoseStamped: Header header, Pose pose
geometry_msgs Twist: Vector3 linear, Vector3 angular
geometry_msgs TwistStamped: Header header, Twist twist
geometry_msgs Wrench: Vector3 force, Vector3 torque
geometry_msgs WrenchStamped: Header header, Wrench wrench
geometry_msgs Transform: Vector3 translation, Quaternion rotation
geometry_msgs TransformStamped: Header header, string child_frame_id, Transform transform
tf2_msgs TFMessage: TransformStamped[] transforms
rosgraph_msgs Clock: Time clock
sensor_msgs JointState: Header header, string[] name, float64[] position, float64[] velocity, float64[] effort
sensor_msgs Image: Header header, uint32 height, uint32 width, string encoding, uint8 is_bigendian, \
uint32 step, uint8[] data
sensor_msgs RegionOfInterest: uint32 x_offset, uint32 y_offset, uint32 height, uint32 width, bool do_rectify
sensor_msgs CameraInfo: Header header, uint32 height, uint32 width, string distortion_model, float64[] d, \
float64[9] k, float64[9] r, float64[12] p, uint32 binning_x, uint32 binning_y, RegionOfInterest roi
"""
"""Package and name of each message: type and name of each field, as ROS writes them, and a default but 0"""
PLAIN = {"string": str, "bool": bool, "float64": float64, "int32": int32, "uint8": uint8, "uint32": uint32}
"""Types without fields"""


def _field(kind: str, given: str) -> tuple[Any, Any]:
    """Return the type of a field and its default."""
    name, _, count = kind.rstrip("]").partition("[")
    of: Any = PLAIN.get(name) or globals()[name]
    if count:
        return array[of, int(count)], field(default_factory=lambda: [0.0] * int(count))
    if kind.endswith("[]"):
        return sequence[of], field(default_factory=list)
    if name not in PLAIN:
        return of, field(default_factory=of)
    if name == "float64":
        return of, float(given or 0)
    return of, {"string": "", "bool": False}.get(name, 0)


def _message(definition: str) -> type[Any]:
    """Return the type of one line of `DEFINITIONS`."""
    head, _, body = definition.partition(": ")
    package, name = head.split()
    content: dict[str, Any] = {"__annotations__": {}, "__module__": __name__}
    for each in body.split(", "):
        declared, _, given = each.partition(" = ")
        kind, field_name = declared.split()
        content["__annotations__"][field_name], content[field_name] = _field(kind, given)
    made = types.new_class(
        name, (IdlStruct,), {"typename": f"{package}.msg.dds_.{name}_"}, lambda space: space.update(content)
    )
    return dataclass(made)


for _line in DEFINITIONS.strip().splitlines():
    _made = _message(_line)
    globals()[_made.__name__] = _made


def __getattr__(name: str) -> Any:
    """Tell readers of types that messages are there which no line here assigns."""
    raise AttributeError(f"module {__name__!r} has no message {name!r}")
