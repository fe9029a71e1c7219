"""The connection of a session: requests and replies, a heartbeat, and resumption after a break."""

from __future__ import annotations

import contextlib
import logging
import os
import ssl
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

import msgspec
from numpy.typing import ArrayLike

from palmares.errors import (
    CapacityError,
    ConnectionLostError,
    InternalError,
    NoServerError,
    PalmaresError,
    ProtocolError,
    SessionOverError,
    SessionTakenError,
    WrongStateError,
    error_of,
)
from palmares.messages import Result, Welcome
from palmares.net import http
from palmares.net.codec import CODECS, SUBPROTOCOLS, Codec, Encoding, Message, with_channels
from palmares.net.dial import NoWebSocket, Refused
from palmares.net.patience import Patience
from palmares.net.transport import INTERRUPTED, Closed, Transport
from palmares.training import Training
from palmares.views import Described
from palmares.wire import (
    ByeRequest,
    ErrorMessage,
    HelloRequest,
    LeaderboardRow,
    Reply,
    Request,
    SessionWarning,
)

# Delays between attempts to reconnect; the last one repeats. A server of version 0.2.0 refuses a new
# connection until it has noticed that the old one is dead, which takes up to `Limits.ping_timeout_s`.
RESUME_DELAYS_S = (0.0, 0.2, 0.5, 1.0, 2.0)
# Period of the heartbeat, the thread that answers pings while the controller computes: well below
# `Limits.ping_timeout_s`.
HEARTBEAT_S = 2.0
# Period in a real-time run: observations must not pile up in the socket.
HEARTBEAT_REALTIME_S = 0.05

LOG = logging.getLogger("palmares")
CLOSED = "wrong_state: the client is closed; make another one"
Answer = TypeVar("Answer", bound=Reply)


class Resumed(Exception):  # noqa: N818 - the caller acts on it
    """The heartbeat has resumed the session on another connection."""


class Link:
    """The connection of one session. Requests are made from one thread at a time.

    Attributes:
        welcome: The latest greeting of the server.
        resumed: The greeting after a reconnection, until the client reads it with `take_resumed`.
        training: Always ``None``: servers do not offer it.
        parameters: Likewise.
        copied_by_fork: Whether a forked process has a copy of its own; a connection cannot be copied.

    """

    copied_by_fork = False

    training: Training | None = None
    parameters: Mapping[str, ArrayLike] | None = None

    def __init__(
        self,
        http_url: str,
        ws_url: str,
        hello: HelloRequest,
        *,
        token: str | None,
        encoding: Encoding | None,
        timeout_s: float,
        reconnect_s: float,
        on_message: Callable[[Message], None],
    ) -> None:
        self._http_url, self._ws_url = http_url, ws_url
        self._hello = hello
        self._token = token
        self._offers = [name for name, kind in SUBPROTOCOLS.items() if encoding in (None, kind)]
        self._timeout_s, self._reconnect_s = timeout_s, reconnect_s
        self._on_message = on_message
        self._last_id = 0
        self._greeted = False
        """Whether the present connection has the session"""
        self._lock = threading.Lock()
        self._timer = _Timer()
        self.resumed: Welcome | None = None
        self._ended: PalmaresError | None = None
        self._codec: Codec
        self._transport = self._connect()
        try:
            self.welcome = self._begin_session(hello)
            self._greeted = True
        except BaseException:
            self._transport.close()
            raise
        args = (weakref.ref(self), self._timer)
        threading.Thread(target=_heartbeat, args=args, name="palmares-heartbeat", daemon=True).start()

    def __getstate__(self) -> dict[str, Any]:
        """Refuse: a connection belongs to its process.

        Raises:
            TypeError: Always.

        """
        raise TypeError("a session with a server cannot be pickled or copied: connect again")

    @property
    def encoding(self) -> Encoding:
        """The encoding of this connection."""
        return self._codec.encoding

    def exchange(self, request: Request, kind: type[Answer]) -> Answer:
        """Send a request and wait for its reply.

        Raises:
            Resumed: The connection is a new one; call `take_resumed` first. Nothing was sent.
            PalmaresError: The server refused, or sent no reply in time.
            Closed: The connection broke; the server may have processed the request or not.

        """
        if self._timer.stopped:
            raise WrongStateError(CLOSED)
        with self._lock:
            self._raise_if_ended()
            if self.resumed is not None:
                raise Resumed
            self._raise_if_ungreeted()
            return self._exchange(request, kind)

    def listen(self, wait_s: float) -> None:
        """Read all received messages; if there is none, wait up to `wait_s` for one."""
        with self._lock:
            self._raise_if_ungreeted()
            if self._drain() == 0 and wait_s > 0.0:
                raw = self._transport.recv_within(wait_s)
                if raw is not None:
                    self._receive(raw)
                    self._drain()

    def resume(self, lost: Closed) -> None:
        """Resume the session on a new connection; `resumed` is then the server's greeting.

        Raises:
            ConnectionLostError: The server could not be reached in time.
            PalmaresError: The server refused to resume the session.

        """
        last: Exception = lost
        begun = time.monotonic()
        give_up, logged, patience = begun + self._reconnect_s, False, Patience()
        for delay_s in _resume_delays():
            if time.monotonic() + delay_s > give_up:
                break
            time.sleep(delay_s)
            try:
                with self._lock:
                    self._raise_if_ended()
                    self._reopen()
                if logged:
                    LOG.warning("connected again after %.1f s", time.monotonic() - begun)
                return
            except (NoServerError, ConnectionLostError, SessionTakenError, CapacityError) as not_yet:
                if not_yet.fatal:
                    raise
                last = not_yet
                if not logged:
                    LOG.warning("connection lost, trying again for %g s: %s", self._reconnect_s, not_yet)
                logged = True
            except InternalError as failed:
                patience.wait(failed)
                last = failed
        raise ConnectionLostError(
            f"the connection broke and did not come back within {self._reconnect_s:g} s: {last}"
        ) from last

    @property
    def closed(self) -> bool:
        """Whether `close` was called; a closed link stays closed."""
        return self._timer.stopped

    @property
    def where(self) -> str:
        """Address of the server."""
        return self._http_url

    def describe_hand(self, name: str) -> dict[str, Any]:
        """Return the server's description of a hand."""
        return Described(http.get_object(self._http_url, f"/v1/hands/{name}", self._token))

    def save_replay(self, run_id: str, path: str | os.PathLike[str]) -> None:
        """Write the replay of a run to a file."""
        replay = http.get(self._http_url, f"/v1/runs/{run_id}/replay", self._token)
        Path(path).write_bytes(replay)

    def leaderboard(self) -> list[LeaderboardRow]:
        """Return the rows of the leaderboard, best first."""
        return http.leaderboard(self._http_url, self._token)

    def result_of(self, run_id: str) -> Result | None:
        """Return the result of a run, if the server has one."""
        return http.result_of(self._http_url, run_id, self._token)

    def silence_s(self) -> float:
        """Time since the last bytes from the server, pings included."""
        return time.monotonic() - self._transport.received_s

    def take_resumed(self, welcome: Welcome) -> None:
        """Clear `resumed`, if it is still this greeting."""
        with self._lock:
            if self.resumed is welcome:
                self.resumed = None

    def interrupted(self) -> None:
        """Give up a connection that was in use when a call was interrupted; a new one has nothing to lose."""
        with self._lock:
            if self.resumed is None:
                self._transport.drop()

    def set_realtime(self, realtime: bool) -> None:
        """Shorten the heartbeat's period during a real-time run."""
        self._timer.set_period(HEARTBEAT_REALTIME_S if realtime else HEARTBEAT_S)

    def abandon(self) -> None:
        """Drop the run of this process; a server has no such request."""
        raise NotImplementedError

    def close(self) -> None:
        """End the session with `bye` and close the connection."""
        self._timer.stop()
        with self._lock:
            with contextlib.suppress(Closed):  # Already closed.
                self._send(ByeRequest())
            self._transport.close()

    def abort(self) -> None:
        """Break the connection without closing it, as a pulled cable does. The server keeps the session."""
        self._transport.abort()

    def beat(self) -> None:
        """Answer pings and resume a broken connection, while no request is in progress."""
        if not self._lock.acquire(blocking=False):
            return  # The thread that waits for a reply answers pings, too.
        try:
            self._raise_if_ungreeted()
            self._drain()
        except ProtocolError as unreadable:
            LOG.warning("%s", unreadable)
        except Closed as lost:
            if _has_error_code(lost) or self._timer.stopped or self._ended is not None:
                return  # The next request raises the error.
            try:
                self._reopen()
            except Exception as failed:
                if isinstance(failed, PalmaresError) and failed.fatal:
                    self._ended = failed  # The next request raises it.
                    return
                # The next request tries again and raises the error. Nothing is logged here: that takes a lock
                # which an interrupted thread may have kept, and this thread holds the connection's.
        finally:
            self._lock.release()

    # --- with the lock held ---

    def _raise_if_ended(self) -> None:
        """Raise the error with which the server ended the session while the heartbeat resumed it."""
        if self._ended is not None:
            raise self._ended

    def _raise_if_ungreeted(self) -> None:
        """Raise `Closed` when an interrupt has left the connection without the session."""
        if not self._greeted:
            raise Closed(None, INTERRUPTED)

    def _exchange(self, request: Request, kind: type[Answer]) -> Answer:
        self._send(request)
        transport, codec = self._transport, self._codec
        while True:
            try:
                raw = transport.recv()
                message = codec.message(raw)
            except TimeoutError:
                raise ConnectionLostError(
                    f"no reply to `{_name(request)}` within {self._timeout_s:g} s from {self._http_url}"
                ) from None
            except msgspec.MsgspecError as unreadable:
                if codec.is_fault(raw, request.id):
                    raise ProtocolError(
                        f"cannot read the server's reply to `{_name(request)}`: {unreadable}"
                    ) from unreadable
                continue
            if isinstance(message, kind) and message.reply_to == request.id:
                return message
            self._dispatch(message, request)

    def _dispatch(self, message: Message, request: Request) -> None:
        """Handle a message other than the expected reply; raise the error if it refuses `request`."""
        if isinstance(message, ErrorMessage):
            if message.reply_to is None or message.reply_to == request.id:
                raise error_of(
                    message.code,
                    message.message,
                    fatal=message.fatal,
                    retry_after_s=message.retry_after_s,
                    fault=message.fault,
                )
        elif message.reply_to is None:
            self._deliver(message)
        # Anything else is the reply to a request that timed out.

    def _send(self, request: Request) -> None:
        if request.id == 0:  # A request that is sent again keeps its id.
            self._last_id += 1
            request.id = self._last_id
        try:
            self._transport.send(self._codec.encode(request), binary=self._codec.binary)
        except Closed:
            # These messages came before the connection broke.
            unread, self._transport.unread = self._transport.unread, []
            for raw in unread:
                self._receive(raw)
            raise

    def _drain(self) -> int:
        """Read all received messages; return their number."""
        count = 0
        while (raw := self._transport.recv_within(0.0)) is not None:
            self._receive(raw)
            count += 1
        return count

    def _receive(self, raw: bytes) -> None:
        try:
            message = self._codec.message(raw)
        except msgspec.MsgspecError as unreadable:
            if self._codec.is_fault(raw, None):
                raise ProtocolError(f"cannot read the server's message: {unreadable}") from unreadable
            return
        if message.reply_to is None:
            self._deliver(message)

    def _deliver(self, message: Message) -> None:
        if isinstance(message, SessionWarning):
            LOG.warning("%.0f s of the session are left", message.session_left_s)
        else:
            self._on_message(message)

    def _reopen(self) -> None:
        self._greeted = False
        self._transport.close()
        self._transport = self._connect()
        try:
            self.welcome = self.resumed = self._resume_session()
            self._greeted = True
        except BaseException:
            self._transport.close()
            raise

    def _connect(self) -> Transport:
        """Connect with the preferred encoding, or the next one."""
        for count, offer in enumerate(self._offers, start=1):
            try:
                transport = self._connect_with(offer)
            except Refused as refused:
                # The server does not speak it. One is offered at a time: of two, the server takes JSON.
                if refused.status == 400 and count < len(self._offers):
                    continue
                if refused.status == 404:
                    start = "/".join(self._http_url.split("/")[:3])
                    raise NoServerError(
                        f"no Palmares server at {self._http_url}: nothing at {urlsplit(self._ws_url).path}; "
                        f"give the address that `palmares serve` prints, such as {start}"
                    ) from None
                raise http.error_of_response(refused.status, refused.body, self._http_url) from None
            if transport.subprotocol is not None:
                self._codec = CODECS[SUBPROTOCOLS[offer]]
                return transport
            transport.close()
        raise NoServerError(f"{self._http_url} does not speak {' or '.join(self._offers)}")

    def _connect_with(self, offer: str) -> Transport:
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            return Transport.connect(self._ws_url, [offer], headers, self._timeout_s)
        except NoWebSocket as error:
            raise NoServerError(
                f"{self._http_url} does not speak {offer}: {error}. Is it a Palmares server?"
            ) from error
        except OSError as unreachable:
            bad_certificate = isinstance(unreachable, ssl.SSLCertVerificationError)
            if isinstance(unreachable, ssl.SSLError) and not bad_certificate:
                plain = self._http_url.replace("https://", "http://", 1)
                raise NoServerError(f"{self._http_url} does not speak TLS; try {plain}") from None
            if bad_certificate:
                raise NoServerError(
                    f"the certificate of {self._http_url} is not trusted ({unreachable}); the environment "
                    "variable SSL_CERT_FILE names a file with it, or with that of its authority"
                ) from None
            raise NoServerError(
                f"no server at {self._http_url} ({unreachable}); is `palmares serve` running?"
            ) from None

    def _begin_session(self, hello: HelloRequest) -> Welcome:
        """Open the session; try again while the server says that this may help."""
        patience = Patience()
        while True:
            try:
                return self._open_session(hello)
            except InternalError as failed:
                patience.wait(failed)

    def _open_session(self, hello: HelloRequest) -> Welcome:
        try:
            welcome = self._exchange(hello, Welcome)
        except Closed as closed:
            raise_if_fatal(closed)
            raise ConnectionLostError(
                f"the server closed the connection during the greeting: {closed}"
            ) from closed
        self._codec = with_channels(self._codec, welcome.specs)
        return welcome

    def _resume_session(self) -> Welcome:
        first = self._hello
        try:
            return self._open_session(
                HelloRequest(client=first.client, resume_token=self.welcome.resume_token)
            )
        except SessionOverError:
            practice = self.welcome.competition.mode == "practice"
            if not practice or first.session_s is not None:
                raise
            # A restarted practice server has no old sessions: begin a new one.
            return self._open_session(first)


def raise_if_fatal(closed: Closed) -> None:
    """Raise the error of a close frame; the codes 4400 to 4599 end the session.

    After ``session_taken`` another program has the session: two that resume it in turn would never end.

    """
    if _has_error_code(closed):
        raise error_of(closed.reason, "the server closed the session", fatal=True) from closed


def _has_error_code(closed: Closed) -> bool:
    return closed.code is not None and 4400 <= closed.code < 4600


def _name(request: Request) -> str:
    return str(request.__struct_config__.tag)


def _resume_delays() -> Iterator[float]:
    yield from RESUME_DELAYS_S
    while True:
        yield RESUME_DELAYS_S[-1]


class _Timer:
    """Times the beats of the heartbeat."""

    def __init__(self) -> None:
        self._period_s = HEARTBEAT_S
        self._changed = threading.Event()
        self.stopped = False

    def set_period(self, period_s: float) -> None:
        self._period_s = period_s
        self._changed.set()

    def stop(self) -> None:
        self.stopped = True
        self._changed.set()

    def wait(self) -> bool:
        """Wait for the next beat; return False when stopped."""
        self._changed.wait(self._period_s)
        self._changed.clear()
        return not self.stopped


def _heartbeat(link: weakref.ref[Link], timer: _Timer) -> None:
    """Beat until the link is closed or garbage."""
    while timer.wait():
        alive = link()
        if alive is None:
            return
        alive.beat()
        del alive
