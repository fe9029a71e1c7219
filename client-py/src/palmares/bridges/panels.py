"""A run in the panels of Foxglove, in the topics of a replay."""

from __future__ import annotations

import base64
import time
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

import msgspec
from foxglove.messages import FrameTransform, FrameTransforms, SceneEntityDeletion, SceneUpdate, Timestamp
from foxglove.messages import SceneEntityDeletionType as Deletion

from palmares.bridges.panel_server import Channel, PanelServer
from palmares.bridges.shapes import WORLD, entity_of, frame_of, quaternion, vector

APP = "https://app.foxglove.dev"
NUMBERS = {"type": "array", "items": {"type": "number"}}
# The fields of a replay's `/telemetry`: docs/replays.md.
ROWS = (
    *("command", "position", "motor_tension", "work", "tension", "q", "predicted", "finger_force"),
    *("finger_torque", "touch", "readings", "contact_a", "contact_b", "contact_position", "contact_force"),
    "contact_use",
)
TELEMETRY = {
    "title": "palmares.Telemetry",
    "type": "object",
    "properties": {"tick": {"type": "integer"}, "score": {"type": "number"}, **dict.fromkeys(ROWS, NUMBERS)},
}
EVENT = {
    "title": "palmares.Event",
    "type": "object",
    "properties": {
        "tick": {"type": "integer"},
        "kind": {"type": "string"},
        "object": {"type": ["integer", "null"]},
    },
}


def protobuf_channel(topic: str, kind: Any, *, keeps_last: bool = False) -> Channel:
    """Return a channel with messages of Foxglove."""
    schema = kind.get_schema()
    text = base64.b64encode(schema.data).decode()
    return Channel(topic, "protobuf", schema.name, schema.encoding, text, keeps_last)


def json_channel(topic: str, schema: dict[str, Any]) -> Channel:
    """Return a channel with messages of our own."""
    return Channel(topic, "json", schema["title"], "jsonschema", msgspec.json.encode(schema).decode())


CHANNELS = (
    protobuf_channel("/scene", SceneUpdate, keeps_last=True),
    protobuf_channel("/tf", FrameTransforms),
    json_channel("/telemetry", TELEMETRY),
    json_channel("/event", EVENT),
)
SCENE_AT, FRAMES_AT, TELEMETRY_AT, EVENT_AT = range(4)


class Panels:
    """A Foxglove server: connect with the app to `url`.

    Args:
        host: The address to listen on.
        port: The port; 0 takes a free one.
        allowed_origins: Sites whose pages may connect.

    """

    def __init__(
        self, host: str = "127.0.0.1", port: int = 8765, allowed_origins: Sequence[str] = ()
    ) -> None:
        self._names: list[str] = []
        self._run_id, self._tick_s, self._score = "", 0.0, 0.0
        # The time of the run's start, ns since 1970 UTC; None before the first poses.
        self._start_ns: int | None = None
        self._now_ns = time.time_ns()
        self._server = PanelServer(host, port, CHANNELS, allowed_origins)
        self.port = self._server.port
        # The app in a browser, connected to this server.
        self.url = f"{APP}/?ds=foxglove-websocket&ds.url={quote(f'ws://{host}:{self.port}', safe='')}"

    def show(self, message: dict[str, Any]) -> None:
        """Show a message of the watch socket."""
        match message.get("op"):
            case "scene":
                self._begin(message)
            case "poses" if message["run_id"] == self._run_id:
                self._move(message)
            case "score" if message["run_id"] == self._run_id:
                self._score = float(message["score"])
            case "events" if message["run_id"] == self._run_id:
                for event in message["events"]:
                    self._server.publish(EVENT_AT, msgspec.json.encode(event), self._time(event["tick"]))

    def close(self) -> None:
        """Close all connections."""
        self._server.close()

    def _begin(self, scene: dict[str, Any]) -> None:
        """Show the bodies of another run."""
        self._run_id, self._tick_s = scene["run"]["run_id"], float(scene["run"]["tick_s"])
        self._start_ns, self._score = None, 0.0
        self._now_ns = max(self._now_ns, time.time_ns())
        moving = set(scene["moving"])
        bodies = {body["id"]: body for body in scene["bodies"]}
        self._names = [frame_of(bodies[number]) for number in scene["moving"]]
        stamp = timestamp(self._now_ns)
        # A body that cannot move stands in the world.
        entities = [
            entity_of(body if number in moving else {**body, "kind": "furniture"}, stamp)
            for number, body in bodies.items()
        ]
        update = SceneUpdate(
            deletions=[SceneEntityDeletion(timestamp=stamp, type=Deletion.All)], entities=entities
        )
        self._server.publish(SCENE_AT, update.encode(), self._now_ns)

    def _time(self, tick: int) -> int:
        """Return the simulated time of a tick, counted from the run's start; ns since 1970 UTC."""
        since = round(tick * self._tick_s * 1e9)
        if self._start_ns is None:
            # Time never goes back, though a run in lockstep can be faster than the clock.
            self._start_ns = self._now_ns - since
        self._now_ns = max(self._now_ns, self._start_ns + since)
        return self._start_ns + since

    def _move(self, message: dict[str, Any]) -> None:
        now_ns = self._time(message["tick"])
        stamp = timestamp(now_ns)
        transforms = [
            FrameTransform(
                timestamp=stamp,
                parent_frame_id=WORLD,
                child_frame_id=name,
                translation=vector(pose[:3]),
                rotation=quaternion(pose[3:]),
            )
            for name, pose in zip(self._names, message["poses"], strict=True)
        ]
        self._server.publish(FRAMES_AT, FrameTransforms(transforms=transforms).encode(), now_ns)
        self._server.publish(TELEMETRY_AT, msgspec.json.encode(self._telemetry_of(message)), now_ns)

    def _telemetry_of(self, message: dict[str, Any]) -> dict[str, Any]:
        telemetry, contacts = message.get("telemetry") or {}, message.get("contacts") or []
        motors, fingers = telemetry.get("motors", []), telemetry.get("fingers", [])
        return {
            "tick": message["tick"],
            "score": self._score,
            "command": [motor["command"] for motor in motors],
            "position": [motor["position"] for motor in motors],
            "motor_tension": [motor["tension"] for motor in motors],
            "work": [motor["work"] for motor in motors],
            **{name: telemetry.get(name, []) for name in ("tension", "q", "predicted", "readings")},
            "finger_force": [x for finger in fingers for x in finger["force"]],
            "finger_torque": [x for finger in fingers for x in finger["torque"]],
            "touch": [x for force in telemetry.get("touch", []) for x in force],
            "contact_a": [contact["a"] for contact in contacts],
            "contact_b": [contact["b"] for contact in contacts],
            "contact_position": [x for contact in contacts for x in contact["position"]],
            "contact_force": [x for contact in contacts for x in contact["force"]],
            "contact_use": [contact["use"] for contact in contacts],
        }


def timestamp(ns: int) -> Timestamp:
    """Return ns since 1970 UTC as a time of Foxglove."""
    return Timestamp(sec=ns // 1_000_000_000, nsec=ns % 1_000_000_000)
