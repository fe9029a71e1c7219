"""A WebSocket over a plain blocking socket, read and written in the caller's thread.

The Sans-I/O layer of the websockets library does the handshake, control frames and fragments. Whole data
frames, of which a controller exchanges thousands per second, are built and parsed here in a tenth of the
library's time; `benchmarks/round_trip.py` measures it.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import ssl
import struct
import sys
import time
from collections.abc import Callable, Iterator
from http.client import HTTPException
from typing import Self

from websockets.client import ClientProtocol
from websockets.exceptions import InvalidProxy, InvalidURI, WebSocketException
from websockets.frames import Frame, Opcode
from websockets.typing import Subprotocol
from websockets.uri import WebSocketURI, parse_uri

from palmares.dial import NoWebSocket, Refused, dial, dial_local, handshake
from palmares.rest import is_loopback

try:
    from websockets.speedups import apply_mask
except ImportError:  # The library was installed without its C part.
    from websockets.utils import apply_mask

# Timeout of reads and writes while a connection is being closed.
CLOSE_TIMEOUT_S = 0.5
READ_BYTES = 64 * 1024
# Random bytes fetched at once; a frame takes four.
MASKS_BYTES = 4096
# Largest message that is accepted: a scene with many hulls is smaller.
MAX_MESSAGE_BYTES = 64 * 1024 * 1024
# Busy polling needs these functions, and a second core for the server.
CAN_BUSY_POLL = hasattr(os, "sched_yield") and hasattr(select, "poll") and (os.cpu_count() or 1) > 1
# Longest busy poll for one reply.
BUSY_POLL_S = 1e-3
# First bytes of unfragmented messages: text and binary.
UNFRAGMENTED = (0x81, 0x82)


class Closed(Exception):  # noqa: N818
    """The connection is closed or broken.

    Attributes:
        code: Code of the close frame; ``None`` when there was none.
        reason: Reason in the close frame, or what broke the connection.

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
        self._fragments: list[bytes] = []
        self.unread: list[bytes] = []
        """Messages that had come, unread, when the connection broke."""
        self._buffer = bytearray(max(READ_BYTES, len(received)))
        self._buffer[: len(received)] = received
        self._view = memoryview(self._buffer)
        self._start, self._end = 0, len(received)
        self.received_s = time.monotonic()
        """When bytes came last, monotonic clock."""
        self._masks = _masks()
        self._quick = False
        """Whether the last read took less than `BUSY_POLL_S`, so that the next one is worth a busy poll."""
        # With TLS, bytes may be in a buffer of the library, where `poll` does not see them.
        self._poll = _poller(sock) if CAN_BUSY_POLL and not isinstance(sock, ssl.SSLSocket) else None
        self._timeout_s = timeout_s
        _set_timeout(sock, timeout_s)

    @classmethod
    def connect(
        cls,
        url: str,
        subprotocols: list[str],
        headers: dict[str, str],
        timeout_s: float,
        *,
        local: bool = True,
    ) -> Self:
        """Connect to `url` (ws or wss) and do the handshake.

        A server on this machine may name a Unix socket in its answer, through which messages take less time
        than through the loopback interface; with `local` it is used.

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
        first, name = cls._open(sock, uri, subprotocols, headers, timeout_s)
        if not local or name is None or uri.secure or not is_loopback(url):
            return first
        try:
            second, _ = cls._open(dial_local(name), uri, subprotocols, headers, timeout_s)
        except (OSError, Refused, NoWebSocket):
            return first  # It cannot be reached, for example from within a container.
        first.close()
        return second

    @classmethod
    def _open(
        cls,
        sock: socket.socket,
        uri: WebSocketURI,
        subprotocols: list[str],
        headers: dict[str, str],
        timeout_s: float,
    ) -> tuple[Self, str | None]:
        """Do the handshake over `sock`; return the connection and the name of the server's Unix socket."""
        try:
            names = [Subprotocol(name) for name in subprotocols]
            # No compression: it costs more time than sending the bytes it saves.
            protocol = ClientProtocol(uri, subprotocols=names, max_size=MAX_MESSAGE_BYTES)
            received, name = handshake(sock, protocol, headers)
            return cls(sock, protocol, received, timeout_s), name
        except BaseException:
            sock.close()
            raise

    @property
    def subprotocol(self) -> str | None:
        """The subprotocol that the server chose."""
        return self._protocol.subprotocol

    def send(self, message: bytes, *, binary: bool) -> None:
        """Send one message; raise `Closed` when the connection is closed or broken."""
        if self._closed is not None:
            raise self._closed
        size = len(message)
        first = 0x82 if binary else 0x81
        if size < 126:
            header = bytes((first, 0x80 | size))
        elif size < 65536:
            header = bytes((first, 0xFE)) + size.to_bytes(2, "big")
        else:
            header = bytes((first, 0xFF)) + size.to_bytes(8, "big")
        mask = next(self._masks)
        try:
            self._socket.sendall(header + mask + apply_mask(message, mask))
        except (TimeoutError, BlockingIOError):
            # Part of a frame may have been sent: the connection cannot be used any more.
            raise self._lost("the server does not read") from None
        except OSError as broken:
            # A close frame that says why may have come before.
            self._read_rest()
            raise self._lost(str(broken)) from broken

    def recv(self) -> bytes | memoryview:
        """Wait for the next message and return it; a view into the buffer is valid until the next call.

        Raises:
            TimeoutError: No message came within the timeout.
            Closed: The connection is closed or broken.

        """
        if self._start == self._end:
            self._read()
        message = self._parse()
        if message is not None:
            return message
        # A message in parts, or pings, which do not prolong the timeout.
        deadline = time.monotonic() + self._timeout_s
        while message is None:
            if time.monotonic() > deadline:
                raise TimeoutError
            self._read()
            message = self._parse()
        return message

    def recv_within(self, wait_s: float) -> bytes | memoryview | None:
        """Return the next message, or ``None`` when none came within `wait_s`; answer pings meanwhile."""
        deadline = time.monotonic() + wait_s
        while True:
            message = self._parse()
            if message is not None:
                return message
            if not self._readable(max(0.0, deadline - time.monotonic())):
                return None
            self._read()

    def abort(self) -> None:
        """Break the connection without a close frame, as a pulled cable does."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Send a close frame, if the connection is open, and close the socket."""
        if self._closed is None:
            self._closed = Closed(None, "closed by this client")
            with contextlib.suppress(OSError, WebSocketException):
                self._protocol.send_close(1000)
                _set_timeout(self._socket, CLOSE_TIMEOUT_S)
                self._socket.sendall(b"".join(self._protocol.data_to_send()))
        self._socket.close()

    # --- bytes ---

    def _read(self) -> None:
        """Read bytes into the buffer, with a busy poll if the last read was quick.

        Blocking costs a thread switch, which takes about as long as the physics of a tick, longest on an idle
        machine. `sched_yield` leaves the core to the server or any other program that needs it.
        """
        if self._closed is not None:
            raise self._closed
        room = self._view
        if self._start == self._end:
            self._start = self._end = 0
        else:
            if self._end == len(self._buffer):
                self._make_room(READ_BYTES)
            room = self._view[self._end :]
        began_s = time.monotonic()
        try:
            if self._quick and (poll := self._poll) is not None:
                while not poll(0):
                    os.sched_yield()
                    if time.monotonic() - began_s > BUSY_POLL_S:
                        break
            count = self._socket.recv_into(room)
        except (TimeoutError, BlockingIOError):
            raise TimeoutError from None  # A subclass of OSError, but the connection is intact.
        except OSError as broken:
            raise self._lost(str(broken)) from broken
        self.received_s = time.monotonic()
        self._quick = self._poll is not None and self.received_s - began_s < BUSY_POLL_S
        if count == 0:
            raise self._lost("the server closed the connection")
        self._end += count

    def _readable(self, wait_s: float) -> bool:
        if self._closed is not None:
            raise self._closed
        if isinstance(self._socket, ssl.SSLSocket) and self._socket.pending():
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
        """Read all that came before the connection broke, which may end with a close frame."""
        with contextlib.suppress(Closed, OSError):
            _set_timeout(self._socket, CLOSE_TIMEOUT_S)
            while True:
                message = self._parse()
                if message is None:
                    self._read()
                else:
                    self.unread.append(bytes(message))

    def _make_room(self, size: int) -> None:
        """Move to a new buffer with room for `size` more bytes; messages still in use keep the old one."""
        unparsed = self._view[self._start : self._end]
        buffer = bytearray(max(READ_BYTES, len(unparsed) + size))
        buffer[: len(unparsed)] = unparsed
        self._buffer, self._view = buffer, memoryview(buffer)
        self._start, self._end = 0, len(unparsed)

    def _lost(self, why: str) -> Closed:
        if self._closed is None:
            self._closed = Closed(None, why)
        self._socket.close()
        return self._closed

    # --- frames ---

    def _parse(self) -> bytes | memoryview | None:
        """Return the next message in the buffer; ``None`` when it is not complete yet."""
        while True:
            buffer, start = self._buffer, self._start
            have = self._end - start
            if have < 2:
                return None
            size, at = buffer[start + 1] & 0x7F, start + 2
            if size == 126:
                at += 2
            elif size == 127:
                at += 8
            if at > self._end:
                return None
            if size > 125:
                size = int.from_bytes(buffer[start + 2 : at], "big")
            if size > MAX_MESSAGE_BYTES:
                raise self._lost(f"a message of {size} bytes")
            masked = buffer[start + 1] & 0x80
            end = at + size + (4 if masked else 0)
            if end > self._end:
                if end > len(buffer):
                    self._make_room(end - self._end)
                return None
            self._start = end
            if buffer[start] in UNFRAGMENTED and not masked:
                return self._view[at:end]
            message = self._parse_with_library(bytes(self._view[start:end]))
            if message is not None:
                return message

    def _parse_with_library(self, frame: bytes) -> bytes | None:
        """Handle a control frame, a fragment or an invalid frame; return the message if one is complete."""
        protocol = self._protocol
        protocol.receive_data(frame)
        answer = b"".join(protocol.data_to_send())
        if answer:
            with contextlib.suppress(OSError):  # The next read raises it.
                self._socket.sendall(answer)
        message = None
        for event in protocol.events_received():
            if isinstance(event, Frame) and event.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
                self._fragments.append(bytes(event.data))
                if event.fin:
                    message = b"".join(self._fragments)
                    self._fragments.clear()
        received = protocol.close_rcvd
        if received is not None:
            self._closed = Closed(received.code, received.reason)
            self._socket.close()
            raise self._closed
        if protocol.parser_exc is not None:
            raise self._lost(str(protocol.parser_exc))
        return message


def _masks() -> Iterator[bytes]:
    """Yield random masks for frames."""
    while True:
        random = os.urandom(MASKS_BYTES)
        for at in range(0, MASKS_BYTES, 4):
            yield random[at : at + 4]


def _poller(sock: socket.socket) -> Callable[[int], list[tuple[int, int]]]:
    """Return a function that polls whether `sock` can be read, without the cost of an exception."""
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
