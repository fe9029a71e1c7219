"""A server of Foxglove's WebSocket protocol, `foxglove.sdk.v1`, for the channels of a bridge.

<https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>. The server of foxglove-sdk lets every web
page connect, and has no place for a check.
"""

from __future__ import annotations

import logging
import struct
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve
from websockets.typing import Subprotocol

SUBPROTOCOL = Subprotocol("foxglove.sdk.v1")
MESSAGE_DATA = 1
WARNING, ERROR = 1, 2
# Messages that wait for a slow client, as in foxglove-sdk; then the oldest are dropped.
BACKLOG = 1024
U32 = Annotated[int, msgspec.Meta(ge=0, lt=2**32)]


@dataclass(frozen=True)
class Channel:
    """A topic, with the encoding and the schema of its messages."""

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    # Base64 where the schema is in bytes.
    schema: str
    # A new subscriber gets the last message.
    keeps_last: bool = False


class Subscription(msgspec.Struct, rename="camel"):
    """A client's number for a channel."""

    id: U32
    channel_id: int


class Command(msgspec.Struct, rename="camel"):
    """A message of a client."""

    op: str
    subscriptions: list[Subscription] = []
    subscription_ids: list[int] = []


class Panel:
    """A client: its subscriptions, and the messages that wait for its network."""

    def __init__(self, socket: ServerConnection) -> None:
        self.subscriptions: dict[int, int] = {}
        self._socket = socket
        self._waiting: deque[str | bytes] = deque(maxlen=BACKLOG)
        self._changed = threading.Condition()
        self._ended = False

    def put(self, message: str | bytes) -> None:
        """Send a message, without waiting for the network."""
        with self._changed:
            self._waiting.append(message)
            self._changed.notify()

    def refuse(self, reason: str, level: int = ERROR) -> None:
        """Tell the client about an error of its own."""
        self.put(text_of(op="status", level=level, message=reason))

    def end(self) -> None:
        """Let `send_all` return."""
        with self._changed:
            self._ended = True
            self._changed.notify()

    def send_all(self) -> None:
        """Send what waits, until the end of the connection."""
        with suppress(ConnectionClosed):
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self._waiting or self._ended)
                    if self._ended:
                        return
                    message = self._waiting.popleft()
                self._socket.send(message)


class PanelServer:
    """Listens for Foxglove, and sends the messages of channels to their subscribers.

    Args:
        host: The address to listen on.
        port: The port; 0 takes a free one.
        channels: The channels, by the numbers that `publish` takes.
        allowed_origins: Sites whose pages may connect, such as `https://app.foxglove.dev`.

    """

    def __init__(
        self, host: str, port: int, channels: Sequence[Channel], allowed_origins: Sequence[str] = ()
    ) -> None:
        self._channels = channels
        self._allowed = {origin.lower() for origin in allowed_origins}
        self._refused: set[str] = set()
        self._session = str(time.time_ns() // 1_000_000)
        # For all fields below, and the subscriptions of all panels.
        self._lock = threading.Lock()
        self._panels: set[Panel] = set()
        self._last: dict[int, bytes] = {}
        self._now_ns = 0
        # Strangers' broken requests are theirs to see.
        silent = logging.getLogger(__name__)
        silent.setLevel(logging.CRITICAL + 1)
        self._server = serve(
            self._attend,
            host,
            port,
            subprotocols=[SUBPROTOCOL],
            process_request=self._check_page,
            compression=None,
            close_timeout=1.0,
            logger=silent,
        )
        self.port = int(self._server.socket.getsockname()[1])
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def publish(self, channel: int, payload: bytes, time_ns: int) -> None:
        """Send a message with its time, ns since 1970 UTC, to the subscribers of a channel."""
        with self._lock:
            self._now_ns = max(self._now_ns, time_ns)
            if self._channels[channel].keeps_last:
                self._last[channel] = payload
            for panel in self._panels:
                if channel in panel.subscriptions:
                    panel.put(data_of(panel.subscriptions[channel], time_ns, payload))

    def close(self) -> None:
        """Close all connections."""
        self._server.shutdown()

    def _check_page(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse the pages of other sites.

        A browser lets every page connect, also to this machine, and names the page. Programs name none.
        """
        for origin in request.headers.get_all("Origin"):
            if origin.lower() not in self._allowed:
                page = origin if len(origin) <= 100 and origin.isprintable() else "another site"
                refusal = f"a page of {page} may not use this server; allow it with --allowed-origin"
                if page not in self._refused and len(self._refused) < 100:
                    self._refused.add(page)
                    print(f"palmares foxglove: {refusal}", file=sys.stderr, flush=True)
                return connection.respond(403, refusal + "\n")
        return None

    def _attend(self, socket: ServerConnection) -> None:
        """Serve a client until it goes."""
        panel = Panel(socket)
        info = text_of(op="serverInfo", name="Palmares", capabilities=[], sessionId=self._session)
        panel.put(info)
        panel.put(text_of(op="advertise", channels=self._advertised()))
        sender = threading.Thread(target=panel.send_all, daemon=True)
        sender.start()
        with self._lock:
            self._panels.add(panel)
        try:
            for message in socket:
                self._answer(panel, message)
        except ConnectionClosed:
            pass
        finally:
            with self._lock:
                self._panels.discard(panel)
            panel.end()

    def _advertised(self) -> list[dict[str, Any]]:
        return [
            {
                "id": number,
                "topic": channel.topic,
                "encoding": channel.encoding,
                "schemaName": channel.schema_name,
                "schemaEncoding": channel.schema_encoding,
                "schema": channel.schema,
            }
            for number, channel in enumerate(self._channels)
        ]

    def _answer(self, panel: Panel, message: str | bytes) -> None:
        try:
            command = msgspec.json.decode(message, type=Command)
        except (msgspec.MsgspecError, UnicodeDecodeError) as unreadable:
            panel.refuse(f"invalid message: {unreadable}"[:300])
            return
        match command.op:
            case "subscribe":
                for wanted in command.subscriptions:
                    self._subscribe(panel, wanted)
            case "unsubscribe":
                with self._lock:
                    gone = set(command.subscription_ids)
                    kept = {at: number for at, number in panel.subscriptions.items() if number not in gone}
                    panel.subscriptions = kept
            case other:
                panel.refuse(f"this server takes subscribe and unsubscribe, not {other[:50]!r}")

    def _subscribe(self, panel: Panel, wanted: Subscription) -> None:
        channel = wanted.channel_id
        with self._lock:
            if not 0 <= channel < len(self._channels):
                panel.refuse(f"unknown channel {channel}")
            elif channel in panel.subscriptions:
                panel.refuse(f"channel {channel} has a subscription already", WARNING)
            elif wanted.id in panel.subscriptions.values():
                panel.refuse(f"subscription {wanted.id} is another channel's")
            else:
                panel.subscriptions[channel] = wanted.id
                if channel in self._last:
                    panel.put(data_of(wanted.id, self._now_ns, self._last[channel]))


def text_of(**message: Any) -> str:
    """Return a message as JSON."""
    return msgspec.json.encode(message).decode()


def data_of(subscription: int, time_ns: int, payload: bytes) -> bytes:
    """Return a message of a channel in bytes: opcode, subscription, time in ns, payload."""
    return struct.pack("<BIQ", MESSAGE_DATA, subscription, time_ns) + payload
