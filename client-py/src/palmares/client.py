"""The client: one session with the server, one request at a time."""

from __future__ import annotations

import contextlib
import logging
import os
import time
from collections.abc import Iterable
from types import TracebackType
from typing import Any, Literal, Self, TypeVar
from urllib.parse import urlsplit

import msgspec
from websockets.exceptions import (
    ConnectionClosed,
    InvalidHandshake,
    InvalidStatus,
    InvalidURI,
    WebSocketException,
)
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from palmares import rest
from palmares.errors import (
    ConnectionLostError,
    NoServerError,
    ProtocolError,
    RateLimitedError,
    SessionTakenError,
    WrongStateError,
    error_of,
)
from palmares.messages import (
    Action,
    BaseTarget,
    Envelope,
    ErrorMessage,
    LeaderboardRow,
    Observation,
    Result,
    RunInfo,
    Scene,
    SessionWarning,
    Time,
    Welcome,
)
from palmares.version import VERSION

SUBPROTOCOL = Subprotocol("palmares.v1.json")
# The server keeps a broken session for 30 s; it may need 15 s to notice that the old socket is dead.
RESUME_DELAYS_S = (0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 8.0)
# A scene with hulls is larger than the library's default of 1 MiB.
LARGEST_MESSAGE = 64 * 1024 * 1024

# How often a single request may be put off by the rate limit or a broken connection.
MOST_WAITS = 20

LOG = logging.getLogger("palmares")
Reply = TypeVar("Reply")


def pose(position: Iterable[float], quat_xyzw: Iterable[float]) -> BaseTarget:
    """Return a base target: be at `position` (m) with orientation `quat_xyzw`, world frame."""
    x, y, z = (float(v) for v in position)
    qx, qy, qz, qw = (float(v) for v in quat_xyzw)
    return BaseTarget(position=(x, y, z), quat_xyzw=(qx, qy, qz, qw))


def twist(linear: Iterable[float], angular: Iterable[float]) -> BaseTarget:
    """Return a base target: move with `linear` (m/s) and `angular` (rad/s), world frame."""
    vx, vy, vz = (float(v) for v in linear)
    wx, wy, wz = (float(v) for v in angular)
    return BaseTarget(linear=(vx, vy, vz), angular=(wx, wy, wz))


class Client:
    """A session with a Palmares server. Not safe to share between threads.

    Args:
        url: Where the server listens: ``http://host:port`` (or https, ws, wss).
        team: The name on a practice server's leaderboard, 1 to 64 characters.
        token: The team's token; the environment variable ``PALMARES_TOKEN`` when left out. A
            practice server needs none.
        session_s: Practice only: ask for a session of this length, s. Left out, it has no limit.
        timeout_s: How long to wait for any reply before giving up, s.

    Raises:
        NoServerError: Nobody answers at `url`.
        PalmaresError: The server refused the greeting.

    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        *,
        team: str = "palmares-py",
        token: str | None = None,
        session_s: float | None = None,
        timeout_s: float = 60.0,
    ) -> None:
        self._http_url, self._ws_url = _addresses(url)
        self._token = token if token is not None else os.environ.get("PALMARES_TOKEN")
        self._team = team
        self._session_s = session_s
        self._timeout_s = timeout_s
        self._last_id = 0
        self._tick: int | None = None
        self._scene: Scene | None = None
        self._resume_token: str | None = None
        self._open = contextlib.ExitStack()
        self._socket = self._open_socket()
        try:
            self._welcome = self._greet()
        except BaseException:
            self._open.close()
            raise

    # --- what a controller calls ---

    def reset(
        self,
        task: str,
        hand: str,
        *,
        mode: Literal["lockstep"] = "lockstep",
        sensing: Literal["sensors", "truth"] = "truth",
        seed: int | None = None,
    ) -> Observation:
        """Open a run and return its first observation, tick 0, with the `scene` in it.

        Args:
            task: Name of the task, such as ``balls``.
            hand: Name of the hand, such as ``softhand``.
            mode: ``lockstep``: the world waits for every step.
            sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
            seed: Which scene, in practice; left out, the server draws one and `obs.run.seed` tells it.

        A run still open must be stopped first.

        """
        fields: dict[str, Any] = {"task": task, "hand": hand, "mode": mode, "sensing": sensing}
        if seed is not None:
            fields["seed"] = seed
        self._tick = None
        obs = self._request("reset", fields, "obs", Observation)
        self._tick, self._scene = obs.tick, obs.scene
        return obs

    def step(
        self,
        base: BaseTarget | None = None,
        hand: Iterable[float] | None = None,
        repeat: int = 1,
    ) -> Observation:
        """Advance the world by `repeat` ticks (of 10 ms) under one action; return what follows.

        Args:
            base: `palmares.pose(…)` or `palmares.twist(…)`; left out, the last target stands.
            hand: σ of every motor in [0, 1]; left out, the last command stands.
            repeat: How many ticks; fewer are taken when the run ends before.

        """
        if self._tick is None:
            raise WrongStateError("wrong_state: no run is open; call reset(…) first")
        action = Action(base=base, hand=None if hand is None else [float(s) for s in hand])
        fields = {"tick": self._tick, "action": action, "repeat": repeat}
        obs = self._request("step", fields, "obs", Observation)
        self._tick = obs.tick
        return obs

    def stop(self) -> Result:
        """Close the run: the objects settle, the referee counts."""
        result = self._request("stop", {}, "result", Result)
        self._tick = None
        return result

    def time(self) -> Time:
        """Read the session's clock. Works at any moment."""
        return self._request("time", {}, "time", Time)

    def leaderboard(self) -> list[LeaderboardRow]:
        """Return the rows of the leaderboard, best first."""
        return rest.leaderboard(self._http_url)

    def describe_hand(self, name: str) -> dict[str, Any]:
        """Return the description of a hand as the server gives it: links, joints, motors, shapes."""
        return rest.get_object(self._http_url, f"/v1/hands/{name}")

    @property
    def welcome(self) -> Welcome:
        """What the server said when this session began: tasks, hands, limits, specs."""
        return self._welcome

    @property
    def scene(self) -> Scene:
        """The scene of the present run."""
        if self._scene is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._scene

    @property
    def tick(self) -> int | None:
        """Ticks since reset; ``None`` when no run is open."""
        return self._tick

    def close(self) -> None:
        """End the session. A run still open is stopped and scored by the server."""
        # If the connection is gone already, that is what was wanted.
        with contextlib.suppress(WebSocketException, OSError):
            self._send("bye", {})
        self._open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    # --- requests and replies ---

    def _send(self, op: str, fields: dict[str, Any]) -> int:
        self._last_id += 1
        message = {"op": op, "id": self._last_id, **fields}
        self._socket.send(msgspec.json.encode(message), text=True)
        return self._last_id

    def _request(self, op: str, fields: dict[str, Any], reply_op: str, kind: type[Reply]) -> Reply:
        """Ask until there is an answer: wait when told to, take up the session when it breaks."""
        for _ in range(MOST_WAITS):
            try:
                return self._exchange(op, fields, reply_op, kind)
            except RateLimitedError as slower:
                # A request that fails has changed nothing, so it can be sent again.
                time.sleep(0.1 if slower.retry_after_s is None else slower.retry_after_s)
            except ConnectionClosed as lost:
                _raise_if_fatal(lost)
                run = self._resume(lost).run
                fields = self._after_resume(op, fields, run)
        return self._exchange(op, fields, reply_op, kind)

    def _after_resume(self, op: str, fields: dict[str, Any], run: RunInfo | None) -> dict[str, Any]:
        """Return what to send now that the connection is back; the request may have been taken before."""
        if op == "step" and run is not None and run.tick != fields["tick"]:
            # The step was taken but its observation is lost: one tick more, with the same targets, shows it.
            return {"tick": run.tick, "action": Action(), "repeat": 1}
        if op == "reset" and run is not None:
            # The run was opened but its scene is lost: close it and open another.
            self._exchange("stop", {}, "result", Result)
        return fields

    def _exchange(self, op: str, fields: dict[str, Any], reply_op: str, kind: type[Reply]) -> Reply:
        request_id = self._send(op, fields)
        while True:
            try:
                raw = self._socket.recv(timeout=self._timeout_s)
            except TimeoutError:
                raise ConnectionLostError(
                    f"no reply to `{op}` within {self._timeout_s:g} s from {self._http_url}"
                ) from None
            try:
                envelope = msgspec.json.decode(raw, type=Envelope)
                if envelope.op == "error":
                    if envelope.id in (None, request_id):
                        error = msgspec.json.decode(raw, type=ErrorMessage)
                        raise error_of(
                            error.code,
                            error.message,
                            fatal=error.fatal,
                            retry_after_s=error.retry_after_s,
                        )
                elif envelope.op == reply_op and envelope.id == request_id:
                    return msgspec.json.decode(raw, type=kind)
                elif envelope.op == "warning":
                    warning = msgspec.json.decode(raw, type=SessionWarning)
                    LOG.warning("%.0f s of the session are left", warning.session_left_s)
                # Anything else is news of a later version, or the reply to a request given up.
            except msgspec.MsgspecError as unreadable:
                raise ProtocolError(f"cannot read the server's reply to `{op}`: {unreadable}") from unreadable

    # --- connecting ---

    def _open_socket(self) -> ClientConnection:
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else None
        try:
            connection = connect(
                self._ws_url,
                subprotocols=[SUBPROTOCOL],
                additional_headers=headers,
                compression=None,
                max_size=LARGEST_MESSAGE,
                open_timeout=10,
                proxy=None if rest.is_loopback(self._ws_url) else True,
            )
            # As a context, because websockets is moving towards connecting only on entry.
            return self._open.enter_context(connection)
        except InvalidStatus as refused:
            raise rest.error_of_response(
                refused.response.status_code, refused.response.body or b"", self._http_url
            ) from None
        except (InvalidHandshake, InvalidURI) as odd:
            raise NoServerError(
                f"{self._http_url} does not speak {SUBPROTOCOL}: {odd}. Is it a Palmares server?"
            ) from odd
        except OSError as unreachable:
            raise NoServerError(
                f"no server at {self._http_url} ({unreachable}); is `palmares serve` running?"
            ) from None

    def _greet(self) -> Welcome:
        fields: dict[str, Any] = {"client": {"name": self._team, "version": VERSION}}
        if self._resume_token is not None:
            fields["resume_token"] = self._resume_token
        elif self._session_s is not None:
            fields["session_s"] = self._session_s
        try:
            welcome = self._exchange("hello", fields, "welcome", Welcome)
        except ConnectionClosed as closed:
            _raise_if_fatal(closed)
            raise ConnectionLostError(
                f"the server closed the connection during the greeting: {closed}"
            ) from closed
        self._resume_token = welcome.resume_token
        return welcome

    def _resume(self, lost: ConnectionClosed) -> Welcome:
        """Take the session up again on a new socket, or raise `ConnectionLostError`."""
        last: Exception = lost
        for delay_s in RESUME_DELAYS_S:
            time.sleep(delay_s)
            try:
                self._open.close()
                self._socket = self._open_socket()
                return self._greet()
            except (NoServerError, ConnectionLostError, SessionTakenError) as not_yet:
                last = not_yet
        raise ConnectionLostError(f"the connection broke and did not come back: {last}") from last


def _addresses(url: str) -> tuple[str, str]:
    parts = urlsplit(url if "://" in url else f"http://{url}")
    schemes = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}
    if parts.scheme not in schemes or not parts.netloc:
        raise ValueError(f"{url!r} is not the address of a server; try http://127.0.0.1:8080")
    ws = schemes[parts.scheme]
    http = "https" if ws == "wss" else "http"
    path = parts.path.rstrip("/")
    return f"{http}://{parts.netloc}{path}", f"{ws}://{parts.netloc}{path}/v1/control"


def _raise_if_fatal(closed: ConnectionClosed) -> None:
    """Raise the error a close frame names; codes 4400 to 4599 say that the session is over."""
    frame = closed.rcvd
    if frame is not None and 4400 <= frame.code < 4600:
        raise error_of(frame.reason, "the server closed the session", fatal=True) from closed
