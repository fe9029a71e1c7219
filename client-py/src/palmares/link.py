"""The link to the server: greets, asks, waits for answers, answers pings, comes back when it breaks."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import TypeVar

import msgspec

from palmares import rest
from palmares.codec import CODECS, SUBPROTOCOLS, Codec, Encoding, Message
from palmares.dial import NoWebSocket, Refused
from palmares.errors import (
    CapacityError,
    ConnectionLostError,
    NoServerError,
    ProtocolError,
    SessionOverError,
    SessionTakenError,
    error_of,
)
from palmares.messages import ErrorMessage, Reply, SessionWarning, Welcome
from palmares.requests import Bye, Hello, Request
from palmares.transport import Closed, Transport

# Between attempts to come back; the last one repeats. The server may need 15 s to notice a dead socket.
RESUME_DELAYS_S = (0.0, 0.2, 0.5, 1.0, 2.0)
# While the controller thinks, a thread looks after pings this often; the server drops who is silent for 15 s.
TEND_S = 2.0
# The same while a world runs in real time: its observations must not pile up in the socket.
TEND_REALTIME_S = 0.05

LOG = logging.getLogger("palmares")
Answer = TypeVar("Answer", bound=Reply)


class Returned(Exception):  # noqa: N818 - the caller acts on it
    """The heartbeat has taken the session up again on another connection."""


class Link:
    """One session's connection. Requests are made from one thread at a time.

    Attributes:
        welcome: The latest greeting of the server.
        returned: The greeting after a broken connection was taken up again, until the client looks at it.

    """

    def __init__(
        self,
        http_url: str,
        ws_url: str,
        hello: Hello,
        *,
        token: str | None,
        encoding: Encoding | None,
        local: bool,
        timeout_s: float,
        reconnect_s: float,
        news: Callable[[Message], None],
    ) -> None:
        self._http_url, self._ws_url = http_url, ws_url
        self._hello = hello
        self._token = token
        self._local = local
        self._offers = [name for name, kind in SUBPROTOCOLS.items() if encoding in (None, kind)]
        self._timeout_s, self._reconnect_s = timeout_s, reconnect_s
        self._news = news
        self._last_id = 0
        self._lock = threading.Lock()
        self._pulse = _Pulse()
        self.returned: Welcome | None = None
        self._codec: Codec
        self._transport = self._connect()
        try:
            self.welcome = self._greet(hello)
        except BaseException:
            self._transport.close()
            raise
        args = (weakref.ref(self), self._pulse)
        threading.Thread(target=_tend, args=args, name="palmares-heartbeat", daemon=True).start()

    @property
    def encoding(self) -> Encoding:
        """What client and server agreed on."""
        return self._codec.encoding

    def exchange(self, request: Request, kind: type[Answer]) -> Answer:
        """Ask and wait for the answer.

        Raises:
            Returned: The connection is a new one; look at `returned` first. Nothing was asked.
            PalmaresError: The server refused, or did not answer in time.
            Closed: The connection broke; the request may have been taken or not.

        """
        with self._lock:
            if self.returned is not None:
                raise Returned
            return self._exchange(request, kind)

    def listen(self, wait_s: float) -> None:
        """Pass on what came unasked; if nothing did, wait for it up to `wait_s`."""
        with self._lock:
            if self._hear() == 0 and wait_s > 0.0:
                raw = self._transport.recv_within(wait_s)
                if raw is not None:
                    self._hear_one(raw)
                    self._hear()

    def resume(self, lost: Closed) -> None:
        """Take the session up again on a new connection; `returned` tells what the server said.

        Raises:
            ConnectionLostError: The server did not come back in time.
            PalmaresError: It is back and refuses.

        """
        last: Exception = lost
        give_up = time.monotonic() + self._reconnect_s
        for delay_s in _resume_delays():
            if time.monotonic() + delay_s > give_up:
                break
            time.sleep(delay_s)
            try:
                with self._lock:
                    self._reopen()
                return
            except (NoServerError, ConnectionLostError, SessionTakenError, CapacityError) as not_yet:
                last = not_yet
        raise ConnectionLostError(
            f"the connection broke and did not come back within {self._reconnect_s:g} s: {last}"
        ) from last

    def silence_s(self) -> float:
        """How long nothing at all has come from the server, not even a ping, s."""
        return time.monotonic() - self._transport.heard

    def take_return(self) -> Welcome | None:
        """Return `returned`, once."""
        with self._lock:
            welcome, self.returned = self.returned, None
        return welcome

    def keep_up(self, realtime: bool) -> None:
        """Look after the connection more often while a world runs in real time."""
        self._pulse.every(TEND_REALTIME_S if realtime else TEND_S)

    def close(self) -> None:
        """Say `bye`, which ends the session, and hang up."""
        self._pulse.stop()
        with self._lock:
            with contextlib.suppress(Closed):  # That is what was wanted.
                self._send(Bye())
            self._transport.close()

    def hang_up(self) -> None:
        """Leave without a word, as by a pulled cable. The session waits for its client to come back."""
        self._transport.abort()

    def tend(self) -> None:
        """Answer pings and take the session up again while the controller is busy with other things."""
        if not self._lock.acquire(blocking=False):
            return  # A request is under way: whoever waits for its answer answers pings too.
        try:
            self._hear()
        except ProtocolError as unreadable:
            LOG.warning("%s", unreadable)
        except Closed as lost:
            if _names_an_error(lost) or self._pulse.stopped:
                return  # The next request tells.
            try:
                self._reopen()
            except Exception as not_yet:  # The next request meets it again and tells.
                LOG.debug("the connection broke and is not back yet: %s", not_yet)
        finally:
            self._lock.release()

    # --- with the lock held ---

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
                if codec.concerns(raw, request.id):
                    raise ProtocolError(
                        f"cannot read the server's reply to `{_name(request)}`: {unreadable}"
                    ) from unreadable
                continue
            if isinstance(message, kind) and message.reply_to == request.id:
                return message
            self._sort(message, request)

    def _sort(self, message: Message, request: Request) -> None:
        """Deal with a message that is not the answer to `request`; raise what the server refuses it with."""
        if isinstance(message, ErrorMessage):
            if message.reply_to is None or message.reply_to == request.id:
                raise error_of(
                    message.code,
                    message.message,
                    fatal=message.fatal,
                    retry_after_s=message.retry_after_s,
                )
        elif message.reply_to is None:
            self._pass_on(message)
        # Anything else is the reply to a request given up.

    def _send(self, request: Request) -> None:
        self._last_id += 1
        request.id = self._last_id
        try:
            self._transport.send(self._codec.encode(request), binary=self._codec.binary)
        except Closed:
            self._hear_last_words()
            raise

    def _hear(self) -> int:
        heard = 0
        while (raw := self._transport.recv_within(0.0)) is not None:
            self._hear_one(raw)
            heard += 1
        return heard

    def _hear_one(self, raw: bytes | memoryview) -> None:
        try:
            message = self._codec.message(raw)
        except msgspec.MsgspecError as unreadable:
            if self._codec.concerns(raw, None):
                raise ProtocolError(f"cannot read what the server sent: {unreadable}") from unreadable
            return
        if message.reply_to is None:
            self._pass_on(message)

    def _hear_last_words(self) -> None:
        words, self._transport.last_words = self._transport.last_words, []
        for raw in words:
            self._hear_one(raw)

    def _pass_on(self, message: Message) -> None:
        if isinstance(message, SessionWarning):
            LOG.warning("%.0f s of the session are left", message.session_left_s)
        else:
            self._news(message)

    def _reopen(self) -> None:
        self._transport.close()
        self._transport = self._connect()
        try:
            self.welcome = self.returned = self._greet_again()
        except BaseException:
            self._transport.close()
            raise

    def _connect(self) -> Transport:
        """Connect with the encoding we would rather have, or the next one."""
        for count, offer in enumerate(self._offers, start=1):
            try:
                transport = self._connect_with(offer)
            except Refused as refused:
                # So says a server that does not speak it. Offered both, it would take JSON, the slower.
                if refused.status == 400 and count < len(self._offers):
                    continue
                raise rest.error_of_response(refused.status, refused.body, self._http_url) from None
            if transport.subprotocol is not None:
                self._codec = CODECS[SUBPROTOCOLS[offer]]
                return transport
            transport.close()
        raise NoServerError(f"{self._http_url} does not speak {' or '.join(self._offers)}")

    def _connect_with(self, offer: str) -> Transport:
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            return Transport.connect(self._ws_url, [offer], headers, self._timeout_s, local=self._local)
        except NoWebSocket as odd:
            raise NoServerError(
                f"{self._http_url} does not speak {offer}: {odd}. Is it a Palmares server?"
            ) from odd
        except OSError as unreachable:
            raise NoServerError(
                f"no server at {self._http_url} ({unreachable}); is `palmares serve` running?"
            ) from None

    def _greet(self, hello: Hello) -> Welcome:
        try:
            return self._exchange(hello, Welcome)
        except Closed as closed:
            raise_if_fatal(closed)
            raise ConnectionLostError(
                f"the server closed the connection during the greeting: {closed}"
            ) from closed

    def _greet_again(self) -> Welcome:
        first = self._hello
        try:
            return self._greet(Hello(client=first.client, resume_token=self.welcome.resume_token))
        except SessionOverError:
            practice = self.welcome.competition.mode == "practice"
            if not practice or first.session_s is not None:
                raise
            # A practice server that was started anew remembers nothing; there is no time to lose either.
            return self._greet(first)


def raise_if_fatal(closed: Closed) -> None:
    """Raise the error a close frame names; codes 4400 to 4599 say that the session is over."""
    if _names_an_error(closed):
        raise error_of(closed.reason, "the server closed the session", fatal=True) from closed


def _names_an_error(closed: Closed) -> bool:
    return closed.code is not None and 4400 <= closed.code < 4600


def _name(request: Request) -> str:
    return str(request.__struct_config__.tag)


def _resume_delays() -> Iterator[float]:
    yield from RESUME_DELAYS_S
    while True:
        yield RESUME_DELAYS_S[-1]


class _Pulse:
    """When the heartbeat's thread is to look after the link."""

    def __init__(self) -> None:
        self._period_s = TEND_S
        self._changed = threading.Event()
        self.stopped = False

    def every(self, period_s: float) -> None:
        self._period_s = period_s
        self._changed.set()

    def stop(self) -> None:
        self.stopped = True
        self._changed.set()

    def wait(self) -> bool:
        """Wait for the next beat; False when there is none."""
        self._changed.wait(self._period_s)
        self._changed.clear()
        return not self.stopped


def _tend(link: weakref.ref[Link], pulse: _Pulse) -> None:
    """Look after a link as long as somebody has it."""
    while pulse.wait():
        alive = link()
        if alive is None:
            return
        alive.tend()
        del alive
