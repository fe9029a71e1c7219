"""A WebSocket over a plain blocking socket, read and written in the caller's thread.

The Sans-I/O layer of the websockets library does the handshake and all frames. This module reads and writes
the bytes, in the shortest possible time; `benchmarks/round_trip.py` measures it.
"""

from __future__ import annotations

import contextlib
import logging
import os
import select
import socket
import ssl
import struct
import sys
import time
from collections.abc import Callable
from http.client import HTTPException
from typing import Self

from websockets.client import ClientProtocol
from websockets.exceptions import InvalidProxy, InvalidURI, WebSocketException
from websockets.frames import DATA_OPCODES, Frame
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from palmares.net.dial import NoWebSocket, dial, handshake

# Timeout of reads and writes while a connection is being closed.
CLOSE_TIMEOUT_S = 0.5
READ_BYTES = 64 * 1024
# Largest accepted message; a scene with many hulls is smaller.
MAX_MESSAGE_BYTES = 64 * 1024 * 1024
# Busy polling needs these functions, and a second core for the server.
CAN_BUSY_POLL = hasattr(os, "sched_yield") and hasattr(select, "poll") and (os.cpu_count() or 1) > 1
# Longest busy poll for one reply.
BUSY_POLL_S = 1e-3
# Made once: making one takes a lock of the logging module, which an interrupted thread may have kept.
PROTOCOL_LOG = logging.getLogger("websockets.client")
INTERRUPTED = "a call on this connection was interrupted"


class Closed(Exception):  # noqa: N818
    """The connection is closed or broken.

    Attributes:
        code: Code of the close frame; ``None`` when there was none.
        reason: Reason in the close frame, or the error that broke the connection.

    """

    def __init__(self, code: int | None, reason: str) -> None:
        super().__init__(reason if code is None else f"close code {code} {reason}".rstrip())
        self.code = code
        self.reason = reason


class Transport:
    """One open connection, which sends and receives messages as bytes."""

    def __init__(
        self, sock: socket.socket, protocol: ClientProtocol, received: bytes, timeout_s: float
    ) -> None:
        self._socket = sock
        self._protocol = protocol
        self._closed: Closed | None = None
        self._writing = self._reading = False
        """Whether a call is at it, or was interrupted at it: bytes are lost then"""
        self._received = received
        """Bytes that came after the handshake, until the first read"""
        self._fragments: list[bytes] = []
        self._messages: list[bytes] = []
        self.unread: list[bytes] = []
        """Messages that were received but not read when sending failed"""
        self.received_s = time.monotonic()
        """Time of the last received bytes, monotonic clock"""
        self._quick = False
        """Whether the last read took less than `BUSY_POLL_S`; then the next one polls busily"""
        # With TLS, `poll` misses bytes in the library's buffer.
        self._poll = _poller(sock) if CAN_BUSY_POLL and not isinstance(sock, ssl.SSLSocket) else None
        self._timeout_s = timeout_s
        _set_timeout(sock, timeout_s)

    @classmethod
    def connect(cls, url: str, subprotocols: list[str], headers: dict[str, str], timeout_s: float) -> Self:
        """Connect to `url` (ws or wss) and do the handshake.

        Raises:
            OSError: The server cannot be reached.
            Refused: The server answered with an HTTP status.
            NoWebSocket: It is not a Palmares server.

        """
        try:
            uri = parse_uri(url)
            sock = dial(uri, url)
        except (InvalidURI, InvalidProxy, HTTPException) as error:
            raise NoWebSocket(str(error)) from error
        try:
            names = [Subprotocol(name) for name in subprotocols]
            # No compression: it costs more time than sending the bytes it saves.
            protocol = ClientProtocol(
                uri, subprotocols=names, max_size=MAX_MESSAGE_BYTES, logger=PROTOCOL_LOG
            )
            received = handshake(sock, protocol, headers)
            return cls(sock, protocol, received, timeout_s)
        except BaseException:
            sock.close()
            raise

    @property
    def subprotocol(self) -> str | None:
        """The subprotocol that the server chose."""
        return self._protocol.subprotocol

    def send(self, message: bytes, *, binary: bool) -> None:
        """Send one message; raise `Closed` when the connection is closed or broken."""
        try:
            if self._closed is not None:
                raise self._closed
            if self._writing:
                raise self._lost(INTERRUPTED)
            self._writing = True
            if binary:
                self._protocol.send_binary(message)
            else:
                self._protocol.send_text(message)
            self._flush()
        except (TimeoutError, BlockingIOError):
            # Part of a frame may have been sent: the connection is unusable.
            raise self._lost("the server does not read") from None
        except OSError as broken:
            # A close frame with the reason may have come before.
            self._read_rest()
            raise self._lost(str(broken)) from broken
        finally:
            if self._closed is not None:
                self.unread, self._messages = self._messages, []

    def recv(self) -> bytes:
        """Wait for the next message and return it.

        Raises:
            TimeoutError: No message came within the timeout.
            Closed: The connection is closed or broken.

        """
        # Pings and parts of a message do not prolong the timeout.
        deadline = time.monotonic() + self._timeout_s
        while not self._messages:
            if time.monotonic() > deadline:
                raise TimeoutError
            self._read()
        return self._messages.pop(0)

    def recv_within(self, wait_s: float) -> bytes | None:
        """Return the next message, or ``None`` when none came within `wait_s`; answer pings meanwhile."""
        deadline = time.monotonic() + wait_s
        while not self._messages:
            if not self._readable(max(0.0, deadline - time.monotonic())):
                return None
            self._read()
        return self._messages.pop(0)

    def drop(self) -> None:
        """Close the connection without a close frame, since bytes of it may be lost."""
        self._lost(INTERRUPTED)

    def abort(self) -> None:
        """Break the connection without a close frame, as a pulled cable does."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Send a close frame, if the connection is open, and close the socket."""
        if self._closed is None and not self._writing:
            self._closed = Closed(None, "closed by this client")
            with contextlib.suppress(OSError, WebSocketException):
                self._protocol.send_close(1000)
                _set_timeout(self._socket, CLOSE_TIMEOUT_S)
                self._flush()
        self._socket.close()

    # --- bytes ---

    def _read(self) -> None:
        """Read bytes, with a busy poll if the last read was quick.

        Blocking costs a thread switch, which takes about as long as the physics of a tick, longest on an idle
        machine. `sched_yield` leaves the core to the server or any other program that needs it.
        """
        if self._closed is not None:
            raise self._closed
        if self._reading:
            raise self._lost(INTERRUPTED)
        self._reading = True
        if self._received:
            received, self._received = self._received, b""
            self._take(received)
            return
        began_s = time.monotonic()
        try:
            if self._quick and (poll := self._poll) is not None:
                while not poll(0):
                    os.sched_yield()
                    if time.monotonic() - began_s > BUSY_POLL_S:
                        break
            data = self._socket.recv(READ_BYTES)
        except (TimeoutError, BlockingIOError):
            raise TimeoutError from None  # A subclass of OSError, but the connection is intact.
        except OSError as broken:
            raise self._lost(str(broken)) from broken
        self.received_s = time.monotonic()
        self._quick = self._poll is not None and self.received_s - began_s < BUSY_POLL_S
        if not data:
            raise self._lost("the server closed the connection")
        self._take(data)

    def _readable(self, wait_s: float) -> bool:
        if self._closed is not None:
            raise self._closed
        if self._reading:
            raise self._lost(INTERRUPTED)
        if self._received or (isinstance(self._socket, ssl.SSLSocket) and self._socket.pending()):
            return True
        try:
            if hasattr(select, "poll"):
                poll = select.poll()
                poll.register(self._socket, select.POLLIN)
                return bool(poll.poll(1e3 * wait_s))
            return bool(select.select([self._socket], [], [], wait_s)[0])
        except (OSError, ValueError) as broken:
            raise self._lost(str(broken)) from broken

    def _read_rest(self) -> None:
        """Read the bytes that came before the connection broke; they may end with a close frame."""
        with contextlib.suppress(Closed, OSError):
            _set_timeout(self._socket, CLOSE_TIMEOUT_S)
            while True:
                self._read()

    def _take(self, data: bytes) -> None:
        """Find messages in received bytes, answer pings, detect the end of the connection."""
        protocol = self._protocol
        protocol.receive_data(data)
        try:
            self._flush()
        except OSError:
            self._writing = False  # The next read raises it.
        for event in protocol.events_received():
            if isinstance(event, Frame) and event.opcode in DATA_OPCODES:
                self._fragments.append(bytes(event.data))
                if event.fin:
                    self._messages.append(b"".join(self._fragments))
                    self._fragments.clear()
        if protocol.close_rcvd is not None:
            self._closed = Closed(protocol.close_rcvd.code, protocol.close_rcvd.reason)
            self._socket.close()
        elif protocol.parser_exc is not None:
            self._lost(str(protocol.parser_exc))
        self._reading = False

    def _flush(self) -> None:
        """Send the bytes that the library has written."""
        self._writing = True
        data = b"".join(self._protocol.data_to_send())
        if data:
            self._socket.sendall(data)
        self._writing = False

    def _lost(self, why: str) -> Closed:
        if self._closed is None:
            self._closed = Closed(None, why)
        self._socket.close()
        return self._closed


def _poller(sock: socket.socket) -> Callable[[int], list[tuple[int, int]]]:
    """Return a function that polls whether `sock` is readable, without the cost of an exception."""
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    return poll.poll


def _set_timeout(sock: socket.socket, timeout_s: float) -> None:
    """Set the timeout of all calls on `sock`."""
    if sys.platform == "linux" and not isinstance(sock, ssl.SSLSocket):
        # Timeouts of the kernel: those of Python cost one more system call per call.
        sock.settimeout(None)
        microseconds = max(1, round(1e6 * timeout_s))  # 0 would mean no timeout.
        timeval = struct.pack("ll", *divmod(microseconds, 1_000_000))
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)
    else:
        sock.settimeout(timeout_s)
