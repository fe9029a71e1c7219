"""A channel that a newer server has and this package does not know, and a server that lists no channels."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest

from palmares.channels import array_of, channels_of
from palmares.messages import FieldSpec, Observation, Specs
from palmares.net.codec import CODECS, Encoding, with_channels
from palmares.wire import ChannelInfo, ColumnInfo, HandInfo

KNOWN = [
    "tick",
    "hand.base.position",
    "hand.actuators[].command",
    "hand.wrist.force",
    "hand.joints",
    "hand.touch",
]


def specs(*names: str) -> Specs:
    return Specs(action=[], observation=[FieldSpec(name=name, shape=[], unit="") for name in names])


def channel(name: str, column: ColumnInfo) -> ChannelInfo:
    return ChannelInfo(name=name, key=name, shape=[2], columns=[column], truth=False, description="")


@pytest.mark.parametrize("encoding", ["json", "msgpack"])
def test_a_new_channel_becomes_an_array(encoding: Encoding) -> None:
    codec = with_channels(CODECS[encoding], specs(*KNOWN, "hand.temperature", "hand.slip[].speed"))
    base = {
        "position": [0.0] * 3,
        "quat_xyzw": [0.0, 0.0, 0.0, 1.0],
        "linear": [0.0] * 3,
        "angular": [0.0] * 3,
    }
    numbers = [20.0, 21.5]
    wire: Any = numbers if encoding == "json" else np.array(numbers, "<f8").tobytes()
    hand = {
        "base": base,
        "actuators": [],
        "wrist": {"force": [0.0] * 3, "torque": [0.0] * 3},
        "temperature": wire,
        "slip": [{"name": "a", "speed": 0.5}, {"name": "b", "speed": 0.25}],
    }
    message = {"op": "obs", "run_id": "r", "tick": 1, "sim_time_s": 0.0, "applied_action": {}, "hand": hand}
    message |= {"events": [], "score": 0.0, "terminated": False, "truncated": False, "session_left_s": None}
    raw = (msgspec.json if encoding == "json" else msgspec.msgpack).encode(message)
    obs = codec.message(raw)
    assert isinstance(obs, Observation)
    temperature = ChannelInfo(
        name="temperature",
        key="temperature",
        shape=[2],
        columns=[ColumnInfo(width=1, unit="°C")],
        truth=False,
        description="",
    )
    slip = ChannelInfo(
        name="slip",
        key="slip",
        shape=[2],
        columns=[ColumnInfo(name="speed", width=1, unit="m/s")],
        truth=False,
        description="",
    )
    np.testing.assert_array_equal(array_of(temperature, obs.hand), numbers)
    np.testing.assert_array_equal(array_of(slip, obs.hand), [0.5, 0.25])
    # The package itself reads the message without them.
    assert isinstance(CODECS[encoding].message(raw), Observation)


def test_a_server_without_news_gets_the_codec_of_the_package() -> None:
    assert with_channels(CODECS["json"], specs(*KNOWN)) is CODECS["json"]


def test_a_server_that_lists_no_channels_has_those_of_its_lengths() -> None:
    hand = HandInfo(name="old", description="", motors=["a", "b"], joints=["x"], taxels=["t"])
    shapes = {one.name: one.shape for one in channels_of(hand)}
    assert shapes == {"base": [13], "motors": [2, 4], "wrist": [6], "touch": [1, 3]}
