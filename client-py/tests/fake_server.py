"""A server without physics, for part of the protocol: the base jumps to its target, balls do not move."""

from __future__ import annotations

import contextlib
import json
import ssl
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from socket import SHUT_RDWR
from typing import Any, Self

import msgspec
import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve
from websockets.typing import Subprotocol


@dataclass
class FakeServer:
    """A fake server; tests set its behaviour and read its requests."""

    requests: list[dict[str, Any]] = field(default_factory=list)
    replies: list[dict[str, Any]] = field(default_factory=list)
    """Sent instead of the usual replies, in this order; `id` is filled in."""
    drop_before: set[str] = field(default_factory=set)
    """Operations at which the connection breaks once, before they are processed."""
    drop_after: set[str] = field(default_factory=set)
    """Operations at which the connection breaks once, after they were processed."""
    subprotocols: tuple[str, ...] = ("palmares.v1.json", "palmares.v1.msgpack")
    """Subprotocols of the server, its preferred one first."""
    token: str | None = None
    """The token that a client needs; ``None`` for none."""
    ping_interval_s: float | None = 20.0
    note: str | None = None
    """`welcome.note`"""
    forget: bool = False
    """Greet a reconnected client without a run, as after a restart."""
    unavailable: int = 0
    """Number of handshakes that a proxy answers with 503, since it reaches no server."""
    repeats: bool = True
    """Send the reply to the last request that changed the run again, as servers do since 0.3."""
    last: tuple[dict[str, Any], dict[str, Any]] | None = None
    """That request and its reply."""
    closed_meanwhile: bool = False
    """Greet a reconnected client with an ended run, which waits for `stop`."""
    rewind_to: int | None = None
    """Greet the next reconnected client with the run at this tick, as after a host's death."""
    taken_over: bool = False
    """Whether this has happened, and no step was made since."""
    drop_at: set[int] = field(default_factory=set)
    """Numbers of requests, from 1, at which the connection breaks before they are processed."""
    rewinds: dict[int, int] = field(default_factory=dict)
    """Ticks of a real-time run after which it continues from an earlier tick, once each."""
    ticks: int = 20
    """Ticks until a real-time run is truncated."""
    realtime_tick_s: float = 0.002
    events: dict[int, str] = field(default_factory=dict)
    """Events of a real-time run: their kinds by tick."""
    tick: int = 0
    running: bool = False
    base: dict[str, Any] = field(
        default_factory=lambda: {"position": [0.0, 0.0, 0.8], "quat_xyzw": [0.0, 0.0, 0.0, 1.0]}
    )
    sigma: float = 0.0
    tls: ssl.SSLContext | None = None
    server: Server | None = None

    @property
    def url(self) -> str:
        """Address of the server."""
        assert self.server is not None
        host, port = self.server.socket.getsockname()[:2]
        return f"http{'s' if self.tls else ''}://{host}:{port}"

    def __enter__(self) -> Self:
        self.server = serve(
            self._talk,
            "127.0.0.1",
            0,
            select_subprotocol=self._select,
            process_request=self._authorize,
            compression=None,
            ssl=self.tls,
            ping_interval=self.ping_interval_s,
            ping_timeout=self.ping_interval_s,
        )
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        assert self.server is not None
        self.server.shutdown()

    def _select(self, _socket: ServerConnection, offered: Sequence[Subprotocol]) -> Subprotocol | None:
        return next((Subprotocol(name) for name in self.subprotocols if name in offered), None)

    def _authorize(self, socket: ServerConnection, request: Request) -> Response | None:
        if self.unavailable > 0:
            self.unavailable -= 1
            return socket.respond(503, "<html><body><h1>503 Service Unavailable</h1></body></html>")
        if self.token is None or request.headers.get("Authorization") == f"Bearer {self.token}":
            return None
        problem = {"title": "Unauthorized", "status": 401, "detail": "no team", "code": "not_authorized"}
        return socket.respond(401, json.dumps(problem))

    def _say(self, socket: ServerConnection, message: dict[str, Any]) -> None:
        if message.get("op") == "error":
            message = {"fatal": False} | message
        if socket.subprotocol == "palmares.v1.msgpack":
            truth = {"truth": packed(message["truth"])} if "truth" in message else {}
            socket.send(msgspec.msgpack.encode(message | truth))
        else:
            socket.send(json.dumps(message))

    def _stream(self, socket: ServerConnection) -> None:
        """Send observations until the run ends or the connection breaks."""
        with contextlib.suppress(ConnectionClosed, OSError):
            while self.running and self.tick < self.ticks:
                time.sleep(self.realtime_tick_s)
                gone_back = self.rewinds.pop(self.tick, None)
                self.tick = (self.tick if gone_back is None else gone_back) + 1
                obs = self._obs() | ({} if gone_back is None else {"resumed": True})
                if self.tick in self.events:
                    obs["events"] = [{"tick": self.tick, "kind": self.events[self.tick]}]
                if self.tick == self.ticks:
                    obs |= {"truncated": True, "reason": "time_limit"}
                self._say(socket, obs)

    def _talk(self, socket: ServerConnection) -> None:
        binary = socket.subprotocol == "palmares.v1.msgpack"
        try:
            for frame in socket:
                assert isinstance(frame, bytes) == binary
                request = msgspec.msgpack.decode(frame) if isinstance(frame, bytes) else json.loads(frame)
                self.requests.append(request)
                op = request["op"]
                if len(self.requests) in self.drop_at:
                    socket.socket.shutdown(SHUT_RDWR)
                    return
                if op in self.drop_before:
                    self.drop_before.discard(op)
                    socket.socket.shutdown(SHUT_RDWR)
                    return
                reply = {**(self.replies.pop(0) if self.replies else self._again(request))}
                if reason := reply.pop("close", None):
                    socket.close(4409 if reason == "session_taken" else 4408, reason)
                    return
                if op in self.drop_after:
                    self.drop_after.discard(op)
                    socket.socket.shutdown(SHUT_RDWR)
                    return
                reply.setdefault("id", request["id"])
                self._say(socket, reply)
                if op == "reset" and request["mode"] == "realtime":
                    threading.Thread(target=self._stream, args=(socket,), daemon=True).start()
        except (ConnectionClosed, OSError):
            return

    def _again(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the reply to a request, the same one to the same request."""
        if self.repeats and self.last is not None and self.last[0] == request:
            return self.last[1]
        reply = self._reply(request)
        if request["op"] in ("reset", "step", "perturb", "stop") and reply["op"] != "error":
            self.last = request, reply
        return reply

    def _reply(self, request: dict[str, Any]) -> dict[str, Any]:
        match request["op"]:
            case "hello":
                if self.rewind_to is not None and self.running:
                    self.tick, self.rewind_to = self.rewind_to, None
                    self.taken_over, self.last = True, None
                run = {
                    "run_id": "run-1",
                    "task": "balls",
                    "hand": "softhand",
                    "mode": "lockstep",
                    "tick": self.tick,
                    "open": not self.closed_meanwhile,
                }
                return {
                    "op": "welcome",
                    "session_id": "s",
                    "resume_token": "r",
                    "team": request["client"]["name"],
                    "session_left_s": None,
                    **GREETING,
                    "run": run if self.running and not self.forget else None,
                    **({} if self.note is None else {"note": self.note}),
                }
            case "reset" if self.running:
                return {"op": "error", "code": "wrong_state", "message": "stop the open run first"}
            case "reset":
                self.tick = 0
                self.running = True
                opened: dict[str, Any] = {
                    "task": "balls",
                    "hand": "softhand",
                    "mode": request["mode"],
                    "sensing": "truth",
                    "noise": "none",
                }
                opened |= {"seed": request.get("seed", 77), "tick_s": 0.01, "time_limit_s": 600.0}
                return {**self._obs(), "run": opened, "scene": SCENE}
            case "step":
                if self.closed_meanwhile and "hello" in [old["op"] for old in self.requests[1:]]:
                    return {"op": "error", "code": "wrong_state", "message": "the run has ended"}
                end = request["tick"] + request.get("repeat", 1)
                made = self.taken_over and request["tick"] <= self.tick <= end
                if request["tick"] != self.tick and not made:
                    return {"op": "error", "code": "stale_tick", "message": "", "fatal": False}
                self.tick, self.taken_over = end, False
                action = request["action"]
                if "position" in action.get("base", {}):
                    self.base = action["base"]
                self.sigma = action.get("hand", [self.sigma])[0]
                return self._obs()
            case "act" | "perturb":
                self.sigma = request.get("action", {}).get("hand", [self.sigma])[0]
                return {"op": "ack", "tick": self.tick}
            case "stop":
                self.running = False
                return {
                    "op": "result",
                    "run_id": "run-1",
                    "task": "balls",
                    "task_hash": "0" * 64,
                    "hand": "softhand",
                    "mode": "lockstep",
                    "score": 0.0,
                    "in_goal": 0,
                    "outside": 0,
                    "status": "practice",
                    "reason": "stopped",
                    "ticks": self.tick,
                    "sim_time_s": self.tick * 0.01,
                    "missed_ticks": 0,
                    "late_ticks": 0,
                    "late_max_s": 0.0,
                    "dropped_obs": 0,
                    "state_hash": "0" * 16,
                    "events": [],
                    "session_left_s": None,
                }
            case "time":
                clock = dict.fromkeys(("elapsed_s", "wall_s", "simulated_s", "refunded_s"), 0.0)
                session = {"session_left_s": None, "session_s": None, "paused": False, "run": None}
                return {"op": "time", **clock, **session, "server_unix_ms": 0}
            case op:
                return {"op": "error", "code": "unknown_op", "message": op, "fatal": False}

    def _obs(self) -> dict[str, Any]:
        still = {"linear": [0.0] * 3, "angular": [0.0] * 3}
        motor = {
            "name": "synergy",
            "command": self.sigma,
            "position": self.sigma,
            "velocity": 0.0,
            "tension": 0.1,
        }
        return {
            "op": "obs",
            "run_id": "run-1",
            "session_left_s": None,
            "tick": self.tick,
            "sim_time_s": self.tick * 0.01,
            "applied_action": {"base": self.base, "hand": [self.sigma]},
            "hand": {
                "base": {**self.base, **still},
                "actuators": [motor],
                "wrist": {"force": [0.0] * 3, "torque": [0.0] * 3},
            },
            "truth": {
                "objects": {
                    "position": BALLS,
                    "quat_xyzw": [[0.0, 0.0, 0.0, 1.0]] * len(BALLS),
                    "linear": [[0.0] * 3] * len(BALLS),
                    "angular": [[0.0] * 3] * len(BALLS),
                },
                "joints": {"position": [0.5, 1.0], "velocity": [0.0, 0.0]},
                "contacts": {
                    "a": ["palm"],
                    "b": ["ball_1"],
                    "position": [[0.1, 0.2, 0.3]],
                    "force": [[0.0, 0.0, -2.0]],
                },
                "predicted_equilibrium": [0.25, 0.75],
            },
            "events": [],
            "score": 0.0,
            "terminated": False,
            "truncated": False,
        }


def packed(tables: Any) -> Any:
    """Return tables of numbers as bytes, as in MessagePack."""
    if isinstance(tables, dict):
        return {name: packed(table) for name, table in tables.items()}
    strings = any(isinstance(entry, str) for entry in tables)
    return tables if strings else np.array(tables, "<f8").tobytes()


GREETING: dict[str, Any] = {
    "server": {"version": "0.1.0", "build_hash": "0" * 12},
    "competition": {
        "name": "Practice",
        "mode": "practice",
        "session_s": None,
        "reset_cost_s": 0.0,
        "noise": "none",
        "sensors_only": [],
    },
    "tasks": [
        {
            "name": "balls",
            "description": "",
            "tick_s": 0.01,
            "step_s": 0.001,
            "time_limit_s": 600.0,
            "cameras": [],
            "hash": "0" * 64,
        }
    ],
    "hands": [
        {
            "name": "softhand",
            "description": "",
            "motors": ["synergy"],
            "joints": ["thumb", "index"],
            "encoders": [],
            "taxels": [],
            "cameras": [],
        }
    ],
    "limits": {
        "message_bytes": 65536,
        "repeat": 1000,
        "requests_per_s": 5000.0,
        "requests_burst": 1000.0,
        "resume_grace_s": 30.0,
        "ping_interval_s": 5.0,
        "ping_timeout_s": 10.0,
        "hello_timeout_s": 10.0,
        "hold_ticks": 20,
        "outbox_obs": 8,
    },
    "specs": {
        "action": [
            {"name": "base.position", "shape": [3], "unit": "m", "minimum": -2.0, "maximum": 2.0},
            {"name": "base.linear", "shape": [3], "unit": "m/s", "minimum": -1.5, "maximum": 1.5},
            {"name": "base.angular", "shape": [3], "unit": "rad/s", "minimum": -2.5, "maximum": 2.5},
            {"name": "hand", "shape": ["motors"], "unit": "", "minimum": 0.0, "maximum": 1.0},
        ],
        "observation": [{"name": "tick", "shape": [], "unit": "", "minimum": 0.0, "maximum": None}],
    },
}
BALLS = [[0.0, 0.0, 0.05], [0.15, 0.1, 0.05], [0.7, 0.0, 0.05]]
SCENE: dict[str, Any] = {
    "bodies": [
        {
            "id": i,
            "name": f"ball_{i}",
            "free": True,
            "mass": 1.0,
            "com": [0, 0, 0],
            "friction": 1.0,
            "position": p,
            "quat_xyzw": [0, 0, 0, 1],
            "color": [1, 0, 0],
            "parts": [
                {
                    "position": [0, 0, 0],
                    "quat_xyzw": [0, 0, 0, 1],
                    "shape": {"type": "sphere", "radius": 0.05},
                }
            ],
        }
        for i, p in enumerate(BALLS)
    ],
    "regions": [
        {"name": "box_a", "role": "start", "min": [-0.25, -0.25, 0.0], "max": [0.25, 0.25, 0.3]},
        {"name": "box_b", "role": "goal", "min": [0.45, -0.25, 0.0], "max": [0.95, 0.25, 0.3]},
    ],
    "gravity": [0, 0, -9.81],
}
