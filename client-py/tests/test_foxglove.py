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
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

import palmares
from tests.real_server import RealServer, needs_server

foxglove = pytest.importorskip("foxglove", reason="pip install 'palmares[foxglove]' enables this test")
pytest.importorskip("scipy", reason="pip install 'palmares[foxglove]' enables this test")

SUBPROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE_DATA = 1


PROGRAM = [
    sys.executable,
    "-c",
    "import sys; from palmares.program import main; sys.exit(main())",
    "foxglove",
]
# Nothing listens here: the bridge waits for the server.
NOWHERE = "http://127.0.0.1:1"


@contextmanager
def bridge(url: str, *options: str) -> Iterator[str]:
    """Run `palmares foxglove`; yield its address."""
    process = subprocess.Popen(
        [*PROGRAM, "--url", url, "--port", "0", *options], stdout=subprocess.PIPE, text=True, env=os.environ
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
            last: dict[str, bytes] = {}
            last_ns = 0
            telemetry: dict[str, Any] = {}
            while "/scene" not in last or telemetry.get("tick", 0) < observation.tick or not observation.tick:
                if not observation.tick:
                    observation = client.step(hand=[0.4], repeat=20)
                subscription, time_ns, payload = next_data(app)
                topic = topics[subscription]
                last[topic] = payload
                if topic == "/telemetry":
                    telemetry = json.loads(payload)
                    assert time_ns >= last_ns
                    last_ns = time_ns
        assert telemetry["tick"] == 20
        assert telemetry["command"] == pytest.approx([0.4], abs=1e-6)
        assert telemetry["position"] == pytest.approx([observation.hand.actuators[0].position], abs=1e-3)
        frames = decoded(channels["/tf"], last["/tf"])["transforms"]
        base = next(frame for frame in frames if frame["childFrameId"] == "hand/base")
        assert base["parentFrameId"] == "world"
        place = [base["translation"].get(axis, 0.0) for axis in "xyz"]
        assert place == pytest.approx(list(observation.hand.base.xyz), abs=1e-4)
        scene = decoded(channels["/scene"], last["/scene"])
        ids = {entity["id"] for entity in scene["entities"]}
        assert {"hand/base"} | scene_names <= ids
        shapes = {kind for entity in scene["entities"] for kind in entity if kind.endswith(("s", "es"))}
        assert {"cubes", "cylinders"} & shapes
        assert FrameTransforms.get_schema().name == channels["/tf"]["schemaName"]
        assert SceneUpdate.get_schema().name == channels["/scene"]["schemaName"]


def opens(address: str, *origins: str) -> bool:
    """Connect as a page does that the browser names by these headers; return whether it got the channels."""
    headers = [("Origin", origin) for origin in origins]
    try:
        with connect(address, subprotocols=[SUBPROTOCOL], additional_headers=headers, proxy=None) as app:
            advertised(app, {"/scene", "/tf"})
        return True
    except InvalidStatus as error:
        refused = error.response
    said = bytes(refused.body or b"").decode()
    assert (refused.status_code, "may not use this server; allow it with --allowed-origin" in said) == (
        403,
        True,
    )
    return False


def test_pages_of_other_sites_are_refused() -> None:
    own = "https://panels.example.org"
    with bridge(NOWHERE, "--allowed-origin", own) as address:
        port = address.rsplit(":", 1)[1]
        assert opens(address), "a program"
        assert opens(address, own)
        assert opens(address, own.upper())
        for page in (
            "https://evil.example",
            "https://app.foxglove.dev",
            "http://panels.example.org",
            f"{own}.evil.example",
            f"{own}:8443",
            f"http://127.0.0.1:{port}",
            f"http://localhost:{port}",
            "null",
            "file://",
            "",
        ):
            assert not opens(address, page), page
        assert not opens(address, own, "https://evil.example"), "two headers"
    with bridge(NOWHERE, "--allowed-origin", own, "--allowed-origin", "https://app.foxglove.dev") as address:
        assert opens(address, "https://app.foxglove.dev")
        assert opens(address, own)


@pytest.mark.parametrize("origin", ["null", "app.foxglove.dev", "https://app.foxglove.dev/", "https://a b"])
def test_an_origin_that_no_browser_sends_is_named(origin: str) -> None:
    done = subprocess.run([*PROGRAM, "--allowed-origin", origin], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--allowed-origin" in done.stderr
    assert "expected a site such as https://app.foxglove.dev, without a path" in done.stderr


def test_the_server_answers_as_that_of_the_sdk() -> None:
    """Foxglove's own server is the reference: same channels, and an error for each wrong message."""
    from foxglove import Channel, Context
    from foxglove.channels import FrameTransformsChannel, SceneUpdateChannel

    from palmares.bridges.panels import EVENT, TELEMETRY

    context = Context()
    channels = [
        SceneUpdateChannel("/scene", context=context),
        FrameTransformsChannel("/tf", context=context),
        Channel("/telemetry", schema=TELEMETRY, context=context),
        Channel("/event", schema=EVENT, context=context),
    ]
    sdk = foxglove.start_server(name="Palmares", host="127.0.0.1", port=0, context=context)
    topics = {"/scene", "/tf", "/telemetry", "/event"}
    wrong = (
        '{"op": "nothing"}',
        "no JSON",
        '{"op": "subscribeConnectionGraph"}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": @0}, {"id": 2, "channelId": @0}]}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": @1}]}',
        b"\x01\x02",
    )

    def replies_of(address: str) -> tuple[Any, Any, list[Any]]:
        with connect(address, subprotocols=[SUBPROTOCOL], proxy=None) as app:
            info = json.loads(app.recv(timeout=30))
            found = advertised(app, topics)
            scene, frames = (str(found[topic]["id"]) for topic in ("/scene", "/tf"))
            answers = []
            for message in wrong:
                if isinstance(message, str):
                    message = message.replace("@0", scene).replace("@1", frames)
                app.send(message)
                answer = json.loads(app.recv(timeout=30))
                answers.append((answer["op"], answer["level"]))
            for channel in found.values():
                del channel["id"]
                if channel["encoding"] == "json":
                    channel["schema"] = json.loads(channel["schema"])
            return {key: info[key] for key in ("op", "name", "capabilities")}, found, answers

    try:
        reference = replies_of(f"ws://127.0.0.1:{sdk.port}")
        with bridge(NOWHERE) as address:
            assert replies_of(address) == reference
        assert len(channels) == len(reference[1])
    finally:
        sdk.stop()


def test_a_client_that_does_not_read_delays_nobody() -> None:
    from palmares.bridges.panel_server import BACKLOG, Channel, PanelServer

    server = PanelServer("127.0.0.1", 0, [Channel("/a", "json", "a", "jsonschema", "{}")])
    address = f"ws://127.0.0.1:{server.port}"
    subscribing = json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 0}]})
    payload = bytes(10_000)
    try:
        with (
            connect(address, subprotocols=[SUBPROTOCOL], proxy=None, max_queue=1, ping_interval=None) as idle,
            connect(address, subprotocols=[SUBPROTOCOL], proxy=None) as quick,
        ):
            for app in (idle, quick):
                advertised(app, {"/a"})
                app.send(subscribing)
                # The answer to the second one comes after the first was taken.
                app.send(subscribing)
                assert json.loads(app.recv(timeout=30))["op"] == "status"
            # More than the idle client's place and the sockets' buffers take.
            for count in range(3 * BACKLOG):
                server.publish(0, payload, count)
                assert next_data(quick) == (7, count, payload)
            # The idle client goes on with what is left.
            last = -1
            while last != 3 * BACKLOG - 1:
                _, time_ns, _ = next_data(idle)
                assert time_ns > last
                last = time_ns
    finally:
        server.close()


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
