"""A WebSocket over a plain blocking socket, read and written in the caller's thread.

The handshake, control frames and fragments are the business of the websockets library's Sans-I/O layer. Data
frames, of which a controller exchanges thousands per second, are written and cut out here, which takes a
tenth of the library's time; `benchmarks/round_trip.py` measures it.
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

from palmares.dial import NoWebSocket, Refused, dial, dial_local, shake_hands
from palmares.rest import is_loopback

try:
    from websockets.speedups import apply_mask
except ImportError:  # The library was installed without its C part.
    from websockets.utils import apply_mask

# How long a connection that ends may take over its last words.
FAREWELL_S = 0.5
READ_BYTES = 64 * 1024
# Random bytes fetched at once, four for every frame.
MASKS_BYTES = 4096
# A scene with hulls is large; what is larger than this is no scene.
LARGEST_MESSAGE = 64 * 1024 * 1024
# Waiting awake needs these, and a core for the server beside.
AWAKE = hasattr(os, "sched_yield") and hasattr(select, "poll") and (os.cpu_count() or 1) > 1
# Longest time to wait awake for an answer, s.
AWAKE_S = 1e-3
# First bytes of whole messages: text and binary.
WHOLE = (0x81, 0x82)


class Closed(Exception):  # noqa: N818
    """The connection is gone.

    Attributes:
        code: Of the close frame; ``None`` when there was none.
        reason: Of the close frame.

    """

    def __init__(self, code: int | None, reason: str) -> None:
        super().__init__(reason if code is None else f"close code {code} {reason}".rstrip())
        self.code = code
        self.reason = reason


class Transport:
    """One open connection. Messages are bytes; what they mean is for others to know."""

    def __init__(
        self, sock: socket.socket, protocol: ClientProtocol, received: bytes, timeout_s: float
    ) -> None:
        self._socket = sock
        self._protocol = protocol
        self._closed: Closed | None = None
        self._fragments: list[bytes] = []
        self.last_words: list[bytes] = []
        """Messages that were found when the connection turned out to be broken."""
        self._buffer = bytearray(max(READ_BYTES, len(received)))
        self._buffer[: len(received)] = received
        self._view = memoryview(self._buffer)
        self._start, self._end = 0, len(received)
        self.heard = time.monotonic()
        """When anything came last."""
        self._masks = _masks()
        self._quick = False
        """Whether the last answer came within `AWAKE_S`, and can be looked for."""
        # With TLS, bytes may wait where nobody sees them.
        self._poll = _looking_at(sock) if AWAKE and not isinstance(sock, ssl.SSLSocket) else None
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
        """Connect to `url` (ws or wss) and shake hands.

        A server on this machine may tell of a socket for its neighbours, through which messages take less
        time than through the loopback interface; with `local` it is used.

        Raises:
            OSError: Nobody answers.
            Refused: The server answered with an HTTP status.
            NoWebSocket: It is no such server.

        """
        try:
            uri = parse_uri(url)
            sock = dial(uri, url)
        except (InvalidURI, InvalidProxy, HTTPException) as odd:
            raise NoWebSocket(str(odd)) from odd
        first, name = cls._open(sock, uri, subprotocols, headers, timeout_s)
        if not local or name is None or uri.secure or not is_loopback(url):
            return first
        try:
            second, _ = cls._open(dial_local(name), uri, subprotocols, headers, timeout_s)
        except (OSError, Refused, NoWebSocket):
            return first  # Out of reach, as from within a container.
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
        """Shake hands over `sock`; return the connection and the name of the server's local socket."""
        try:
            names = [Subprotocol(name) for name in subprotocols]
            # No compression: it costs more time than the bytes it saves.
            protocol = ClientProtocol(uri, subprotocols=names, max_size=LARGEST_MESSAGE)
            received, name = shake_hands(sock, protocol, headers)
            return cls(sock, protocol, received, timeout_s), name
        except BaseException:
            sock.close()
            raise

    @property
    def subprotocol(self) -> str | None:
        """What the server chose of the subprotocols offered."""
        return self._protocol.subprotocol

    def send(self, message: bytes, *, binary: bool) -> None:
        """Send one message; `Closed` when the connection is gone."""
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
            # Half a frame may be out: this connection is of no more use.
            raise self._lost("the server does not take what is sent") from None
        except OSError as broken:
            # The close frame that tells why may have arrived before.
            self._read_farewell()
            raise self._lost(str(broken)) from broken

    def recv(self) -> bytes | memoryview:
        """Return the next message, which holds until the next call; wait for it for as long as allowed.

        Raises:
            TimeoutError: Nothing came.
            Closed: The connection is gone.

        """
        if self._start == self._end:
            self._read()
        message = self._cut()
        if message is not None:
            return message
        # A large message, or pings: they do not count as an answer.
        deadline = time.monotonic() + self._timeout_s
        while message is None:
            if time.monotonic() > deadline:
                raise TimeoutError
            self._read()
            message = self._cut()
        return message

    def recv_within(self, wait_s: float) -> bytes | memoryview | None:
        """Return the next message, or ``None`` when none came within `wait_s`; answers pings meanwhile."""
        deadline = time.monotonic() + wait_s
        while True:
            message = self._cut()
            if message is not None:
                return message
            if not self._readable(max(0.0, deadline - time.monotonic())):
                return None
            self._read()

    def abort(self) -> None:
        """Leave without a word, as a pulled cable does."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Say goodbye, if anybody listens, and close the socket."""
        if self._closed is None:
            self._closed = Closed(None, "closed by this client")
            with contextlib.suppress(OSError, WebSocketException):
                self._protocol.send_close(1000)
                _set_timeout(self._socket, FAREWELL_S)
                self._socket.sendall(b"".join(self._protocol.data_to_send()))
        self._socket.close()

    # --- bytes ---

    def _read(self) -> None:
        """Read what comes next. If the last answer was quick, stay awake for this one.

        To put a thread to sleep and to wake it up again takes about as long as a tick computes, longest on a
        machine that has nothing else to do. A server or another program that wants the core gets it.
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
        asked = time.monotonic()
        try:
            if self._quick and (poll := self._poll) is not None:
                while not poll(0):
                    os.sched_yield()
                    if time.monotonic() - asked > AWAKE_S:
                        break
            count = self._socket.recv_into(room)
        except (TimeoutError, BlockingIOError):
            raise TimeoutError from None  # It is an OSError, but nothing is broken.
        except OSError as broken:
            raise self._lost(str(broken)) from broken
        self.heard = time.monotonic()
        self._quick = self._poll is not None and self.heard - asked < AWAKE_S
        if count == 0:
            raise self._lost("the server hung up")
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

    def _read_farewell(self) -> None:
        """Read what came before the connection broke, for the sake of a close frame."""
        with contextlib.suppress(Closed, OSError):
            _set_timeout(self._socket, FAREWELL_S)
            while True:
                message = self._cut()
                if message is None:
                    self._read()
                else:
                    self.last_words.append(bytes(message))

    def _make_room(self, size: int) -> None:
        """Have room for `size` more bytes. Messages given out keep the old buffer alive."""
        waiting = self._view[self._start : self._end]
        buffer = bytearray(max(READ_BYTES, len(waiting) + size))
        buffer[: len(waiting)] = waiting
        self._buffer, self._view = buffer, memoryview(buffer)
        self._start, self._end = 0, len(waiting)

    def _lost(self, why: str) -> Closed:
        if self._closed is None:
            self._closed = Closed(None, why)
        self._socket.close()
        return self._closed

    # --- frames ---

    def _cut(self) -> bytes | memoryview | None:
        """Cut the next message out of what was received; ``None`` when it is not whole yet."""
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
            if size > LARGEST_MESSAGE:
                raise self._lost(f"a message of {size} bytes")
            masked = buffer[start + 1] & 0x80
            end = at + size + (4 if masked else 0)
            if end > self._end:
                if end > len(buffer):
                    self._make_room(end - self._end)
                return None
            self._start = end
            if buffer[start] in WHOLE and not masked:
                return self._view[at:end]
            message = self._give_to_library(bytes(self._view[start:end]))
            if message is not None:
                return message

    def _give_to_library(self, frame: bytes) -> bytes | None:
        """Let the library deal with a control frame, a fragment or a fault; the message if it is complete."""
        protocol = self._protocol
        protocol.receive_data(frame)
        answer = b"".join(protocol.data_to_send())
        if answer:
            with contextlib.suppress(OSError):  # Whoever reads next will see that it is broken.
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
    """Yield the random masks of frames."""
    while True:
        random = os.urandom(MASKS_BYTES)
        for at in range(0, MASKS_BYTES, 4):
            yield random[at : at + 4]


def _looking_at(sock: socket.socket) -> Callable[[int], list[tuple[int, int]]]:
    """Return a function that looks whether anything can be read, without the cost of an exception if not."""
    poll = select.poll()
    poll.register(sock, select.POLLIN)
    return poll.poll


def _set_timeout(sock: socket.socket, timeout_s: float) -> None:
    """Let no call on `sock` wait longer than this."""
    if sys.platform == "linux" and not isinstance(sock, ssl.SSLSocket):
        # The kernel's own timeouts: Python's cost a system call more with every one.
        sock.settimeout(None)
        microseconds = max(1, round(1e6 * timeout_s))  # 0 would be no timeout at all.
        timeval = struct.pack("ll", *divmod(microseconds, 1_000_000))
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)
    else:
        sock.settimeout(timeout_s)
