"""Foxglove's protocol from `palmares foxglove`, read by a client written from its documentation.

<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>; the subprotocol is `foxglove.sdk.v1`.
"""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

import palmares
from tests.real_server import RealServer, needs_server

foxglove = pytest.importorskip("foxglove", reason="pip install 'palmares[foxglove]' enables this test")
pytest.importorskip("scipy", reason="pip install 'palmares[foxglove]' enables this test")

SUBPROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE_DATA = 1


@contextmanager
def bridge(url: str) -> Iterator[str]:
    """Run `palmares foxglove`; yield its address."""
    command = [sys.executable, "-c", "from palmares.program import main; main()"]
    process = subprocess.Popen(
        [*command, "foxglove", "--url", url, "--port", "0"], stdout=subprocess.PIPE, text=True, env=os.environ
    )
    try:
        assert process.stdout is not None
        found = re.search(r"ws://\S+", process.stdout.readline())
        assert found is not None
        yield found[0]
    finally:
        process.kill()
        process.wait()


def advertised(app: ClientConnection, wanted: set[str]) -> dict[str, dict[str, Any]]:
    """Wait for the channels of these topics."""
    channels: dict[str, dict[str, Any]] = {}
    while not wanted <= channels.keys():
        message = json.loads(app.recv(timeout=30))
        if message["op"] == "advertise":
            channels |= {channel["topic"]: channel for channel in message["channels"]}
    return channels


def subscribe(app: ClientConnection, channels: dict[str, dict[str, Any]]) -> dict[int, str]:
    """Subscribe to all channels; return the topic of each subscription."""
    topics = dict(enumerate(channels))
    wanted = [{"id": number, "channelId": channels[topic]["id"]} for number, topic in topics.items()]
    app.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    return topics


def next_data(app: ClientConnection) -> tuple[int, int, bytes]:
    """Return subscription, time (ns) and payload of the next message."""
    while True:
        data = app.recv(timeout=30)
        if isinstance(data, bytes) and data[0] == MESSAGE_DATA:
            subscription, time_ns = struct.unpack_from("<IQ", data, 1)
            return subscription, time_ns, data[13:]


@needs_server
def test_a_client_of_foxglove_sees_a_run(tmp_path: Path) -> None:
    from foxglove.messages import FrameTransforms, SceneUpdate

    with RealServer(tmp_path) as server, palmares.Client(server.url, team="crabs") as client:
        observation = client.reset("grasp", "softhand", seed=1)
        scene_names = {body.name for body in client.scene.free}
        with bridge(server.url) as address, connect(address, subprotocols=[SUBPROTOCOL]) as app:
            assert app.subprotocol == SUBPROTOCOL
            assert json.loads(app.recv(timeout=30))["op"] == "serverInfo"
            channels = advertised(app, {"/scene", "/tf", "/telemetry", "/event"})
            assert channels["/scene"]["schemaName"] == "foxglove.SceneUpdate"
            assert channels["/tf"]["schemaName"] == "foxglove.FrameTransforms"
            assert channels["/scene"]["encoding"] == channels["/tf"]["encoding"] == "protobuf"
            topics = subscribe(app, channels)
            # The scene was there before this client; the others follow the world.
            seen: dict[str, bytes] = {}
            last_ns = 0
            telemetry: dict[str, Any] = {}
            while "/scene" not in seen or telemetry.get("tick", 0) < observation.tick or not observation.tick:
                if not observation.tick:
                    observation = client.step(hand=[0.4], repeat=20)
                subscription, time_ns, payload = next_data(app)
                topic = topics[subscription]
                seen[topic] = payload
                if topic == "/telemetry":
                    telemetry = json.loads(payload)
                    assert time_ns >= last_ns
                    last_ns = time_ns
        assert telemetry["tick"] == 20
        assert telemetry["command"] == pytest.approx([0.4], abs=1e-6)
        assert telemetry["position"] == pytest.approx([observation.hand.actuators[0].position], abs=1e-3)
        frames = decoded(channels["/tf"], seen["/tf"])["transforms"]
        base = next(frame for frame in frames if frame["childFrameId"] == "hand/base")
        assert base["parentFrameId"] == "world"
        place = [base["translation"].get(axis, 0.0) for axis in "xyz"]
        assert place == pytest.approx(list(observation.hand.base.xyz), abs=1e-4)
        scene = decoded(channels["/scene"], seen["/scene"])
        ids = {entity["id"] for entity in scene["entities"]}
        assert {"hand/base"} | scene_names <= ids
        shapes = {kind for entity in scene["entities"] for kind in entity if kind.endswith(("s", "es"))}
        assert {"cubes", "cylinders"} & shapes
        assert FrameTransforms.get_schema().name == channels["/tf"]["schemaName"]
        assert SceneUpdate.get_schema().name == channels["/scene"]["schemaName"]


def decoded(channel: dict[str, Any], payload: bytes) -> dict[str, Any]:
    """Decode a message by the schema that the channel brings."""
    import base64

    from google.protobuf import (  # type: ignore[import-untyped]
        descriptor_pb2,
        descriptor_pool,
        json_format,
        message_factory,
    )

    files = descriptor_pb2.FileDescriptorSet.FromString(base64.b64decode(channel["schema"]))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(channel["schemaName"]))
    fields: dict[str, Any] = json_format.MessageToDict(kind.FromString(payload))
    return fields


def test_the_faces_of_a_hull_look_outwards() -> None:
    from palmares.bridges.shapes import faces_of

    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    faces = corners[faces_of(corners)]
    assert len(faces) == 12
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    assert (np.einsum("ij,ij->i", normals, faces.mean(axis=1)) > 0).all()
