"""Channels of a hand: its numbers in an observation, as arrays.

A server lists the channels of each hand in its greeting, so that a new channel becomes an array without a
change of this package.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from palmares.arrays import Array, array
from palmares.wire import CameraInfo, ChannelInfo, ColumnInfo, HandInfo, ImageInfo


def channels_of(hand: HandInfo) -> list[ChannelInfo]:
    """Return the channels of a hand; `early_channels` for servers that do not list them."""
    return hand.channels or early_channels(len(hand.motors), len(hand.encoders), len(hand.taxels))


def array_of(channel: ChannelInfo, hand: Any) -> Array:
    """Return the numbers of a channel in a `HandState` as an array of the channel's shape."""
    value = getattr(hand, channel.key)
    if channel.columns[0].name:
        rows = value if isinstance(value, list) else [value]
        value = [list(_row(channel, row)) for row in rows]
    return array(value, *channel.shape)


def depth_of(camera: CameraInfo) -> ImageInfo:
    """Return the depth image of a camera, also for servers that do not list images."""
    found = [image for image in camera.images if image.name == "depth"]
    if found:
        return found[0]
    shape = [camera.height, camera.width]
    limits = {"minimum": 0.0, "maximum": camera.far}
    return ImageInfo(name="depth", shape=shape, unit="m", truth=False, description="", **limits)


def early_channels(motors: int, encoders: int, taxels: int, acceleration: bool = False) -> list[ChannelInfo]:
    """Return the channels of servers that do not list them."""
    body = [("position", 3, "m"), ("quat_xyzw", 4, ""), ("linear", 3, "m/s"), ("angular", 3, "rad/s")]
    motor = [("command", 1, ""), ("position", 1, ""), ("velocity", 1, "1/s"), ("tension", 1, "tendon")]
    known = [
        _channel("base", "base", [13], body),
        _channel("motors", "actuators", [motors, 4], motor),
        _channel("wrist", "wrist", [6], [("force", 3, "N"), ("torque", 3, "N·m")]),
        _channel("encoders", "joints", [encoders], [("", 1, "rad")]),
        _channel("touch", "touch", [taxels, 3], [("", 3, "N")]),
        _channel("acceleration", "acceleration", [3 if acceleration else 0], [("", 3, "m/s²")]),
    ]
    return [channel for channel in known if channel.shape[0] != 0]


def _channel(name: str, key: str, shape: list[int], columns: list[tuple[str, int, str]]) -> ChannelInfo:
    found = [ColumnInfo(name=column, width=width, unit=unit) for column, width, unit in columns]
    return ChannelInfo(name=name, key=key, shape=shape, columns=found, truth=False, description="")


def _row(channel: ChannelInfo, record: Any) -> Iterable[float]:
    for column in channel.columns:
        value = record[column.name] if isinstance(record, Mapping) else getattr(record, column.name)
        if column.width == 1:
            yield value
        else:
            yield from value
