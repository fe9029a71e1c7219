"""Replays, read with the official MCAP package, as Foxglove does."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.net.http import get_object
from tests.real_server import RealServer, needs_server

pytestmark = needs_server
mcap_reader = pytest.importorskip("mcap.reader", reason="the package mcap is not installed")
protobuf = pytest.importorskip("mcap_protobuf.decoder", reason="mcap-protobuf-support is not installed")

EXAMPLE = Path(__file__).parents[1] / "src/palmares/examples" / "leaderboard_from_replays.py"
TICKS = 130


def replay_of_a_run(server: RealServer, data: Path) -> Path:
    with palmares.Client(server.url, team="pytest") as client:
        obs = client.reset("balls", "softhand", seed=5)
        base = palmares.pose(obs.hand.base.xyz + np.array([0.05, 0.0, -0.1]), obs.hand.base.quat_xyzw)
        client.step(base=base, hand=[0.6], repeat=100)
        client.step(repeat=TICKS - 100)
        result = client.stop()
    return data / "replays" / f"{result.run_id}.mcap"


def test_the_records_are_readable_for_foxglove(tmp_path: Path) -> None:
    began = time.time()
    with RealServer(tmp_path) as server:
        path = replay_of_a_run(server, tmp_path)
    schemas: dict[str, str] = {}
    messages: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with path.open("rb") as stream:
        factories = [protobuf.DecoderFactory()]
        reader = mcap_reader.make_reader(stream, validate_crcs=True, decoder_factories=factories)
        for schema, channel, message in reader.iter_messages():
            if channel.topic in ("/tf", "/telemetry"):
                assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            else:
                assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
                assert json.loads(schema.data)["title"] == schema.name
                messages[channel.topic].append((message.log_time, json.loads(message.data)))
            assert message.log_time == message.publish_time
            schemas[channel.topic] = schema.name
        for _, channel, message, picture in reader.iter_decoded_messages(topics=["/tf", "/telemetry"]):
            messages[channel.topic].append((message.log_time, picture))
        summary = reader.get_summary()
    assert schemas == {
        "/action": "palmares.Action",
        "/hash": "palmares.Hash",
        "/scene": "foxglove.SceneUpdate",
        "/telemetry": "palmares.Telemetry",
        "/tf": "foxglove.FrameTransforms",
    }
    assert summary.statistics.message_count == sum(len(found) for found in messages.values())

    start, scene = messages["/scene"][0]
    assert began - 1 < start * 1e-9 < time.time() + 1
    entities = {entity["id"]: entity for entity in scene["entities"]}
    assert entities["box_a"]["frame_id"] == "world"
    assert len(entities["box_a"]["cubes"]) == 5
    assert entities["ball_3"]["frame_id"] == "ball_3"
    assert entities["ball_3"]["spheres"][0]["size"] == {"x": 0.1, "y": 0.1, "z": 0.1}

    actions = messages["/action"]
    assert [action["tick"] for _, action in actions] == list(range(TICKS))
    assert [when - start for when, _ in actions] == [10_000_000 * tick for tick in range(TICKS)]
    assert [state["tick"] for _, state in messages["/hash"]] == [0, 100]

    known: set[str] = set()
    parents: dict[str, str] = {}
    last = 0
    for when, picture in messages["/tf"]:
        assert when >= last
        last = when
        for transform in picture.transforms:
            stamp, q = transform.timestamp, transform.rotation
            assert stamp.seconds * 10**9 + stamp.nanos == when
            assert q.x**2 + q.y**2 + q.z**2 + q.w**2 == pytest.approx(1.0, abs=1e-3)
            child, parent = transform.child_frame_id, transform.parent_frame_id
            assert parent == "world" or parent in known
            assert parents.setdefault(child, parent) == parent
            known.add(child)
    assert parents["hand/base"] == parents["ball_3"] == "world"
    assert known == {entity["frame_id"] for entity in entities.values()} - {"world"}
    # 30 frames a second while the hand moves, only with moving bodies: the balls are at rest.
    moving = [picture for _, picture in messages["/tf"][1:-1]]
    times = [when for when, _ in messages["/tf"][:12]]
    assert {after - before for before, after in pairwise(times)} == {30_000_000, 40_000_000}
    assert not any("ball" in t.child_frame_id for picture in moving for t in picture.transforms)

    telemetry = [message for _, message in messages["/telemetry"]]
    assert len(telemetry) >= len(moving)
    assert telemetry[0].tick == 0
    assert telemetry[-1].command == pytest.approx([0.6], abs=1e-4)
    for message in telemetry:
        assert len(message.q) == len(message.predicted) > len(message.tension) > 0
        assert len(message.contact_force) == 3 * len(message.contact_a) == 3 * len(message.contact_use)


def test_messages_follow_their_schemas(tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema", reason="the package jsonschema is not installed")
    with RealServer(tmp_path) as server:
        path = replay_of_a_run(server, tmp_path)
    with path.open("rb") as stream:
        for schema, channel, message in mcap_reader.make_reader(stream).iter_messages():
            if channel.message_encoding == "json":
                jsonschema.validate(json.loads(message.data), json.loads(schema.data))


def test_the_leaderboard_can_be_computed_from_replays(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server:
        path = replay_of_a_run(server, tmp_path)
        key = get_object(server.url, "/v1/competition")["replay_key"]
        rows = get_object(server.url, "/v1/leaderboard")["rows"]

    def computed(*arguments: str) -> tuple[int, dict[str, Any]]:
        command = [sys.executable, str(EXAMPLE), str(path.parent), "--practice", *arguments]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        return ended.returncode, json.loads(ended.stdout)

    code, board = computed("--key", key)
    assert (code, board["refused"]) == (0, {})
    assert [row["team"] for row in board["rows"]] == ["pytest"]
    assert board["rows"][0]["total"] == rows[0]["total"]
    assert board["rows"][0]["tasks"]["balls"]["run_id"] == rows[0]["tasks"]["balls"]["run_id"]

    code, board = computed("--key", "00" * 32)
    assert code == 1
    assert "signed by" in board["refused"][path.name]
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    code, board = computed("--key", key)
    assert code == 1
    assert board["rows"] == []
