"""The channels of a hand: the numbers that an observation has of it, and the arrays that they become.

A server lists the channels of each hand in its greeting. A new channel of a server is an array here without a
change of this package.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import msgspec

from palmares.arrays import Array, array


class Column(msgspec.Struct, kw_only=True):
    """Numbers of a channel that have a unit and a range in common."""

    name: str = ""
    """Empty where the channel's numbers have no names"""
    width: int = 1
    """How many numbers"""
    unit: str = ""
    """Empty for a pure number"""
    minimum: float | None = None
    maximum: float | None = None


class Channel(msgspec.Struct, kw_only=True):
    """A channel of a hand."""

    name: str
    """Name of its array in environments and batches"""
    key: str
    """Its field in `Observation.hand`"""
    shape: list[int]
    """Shape of the array"""
    columns: list[Column]
    """Columns along the array's last axis"""
    truth: bool = False
    """Whether it is only in observations with sensing ``truth``"""
    description: str = ""

    def array(self, hand: Any) -> Array:
        """Return the numbers of a `HandState` as an array of this shape."""
        value = getattr(hand, self.key)
        if self.columns[0].name:
            rows = value if isinstance(value, list) else [value]
            value = [list(self._row(row)) for row in rows]
        return array(value, *self.shape)

    def _row(self, record: Any) -> Iterable[float]:
        for column in self.columns:
            value = record[column.name] if isinstance(record, Mapping) else getattr(record, column.name)
            if column.width == 1:
                yield value
            else:
                yield from value


class ImageInfo(msgspec.Struct, kw_only=True):
    """An image that a camera takes."""

    name: str
    """``depth``, ``rgb`` or ``bodies``: its attribute in `CameraImage`"""
    shape: list[int]
    """Rows, pixels in a row, and the numbers of a pixel if it has several"""
    unit: str = ""
    """Empty for a pure number"""
    minimum: float
    maximum: float
    truth: bool = False
    """Whether it is only for runs with sensing ``truth``"""
    description: str = ""


def early_channels(motors: int, encoders: int, taxels: int, acceleration: bool = False) -> list[Channel]:
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


def _channel(name: str, key: str, shape: list[int], columns: list[tuple[str, int, str]]) -> Channel:
    found = [Column(name=column, width=width, unit=unit) for column, width, unit in columns]
    return Channel(name=name, key=key, shape=shape, columns=found)
