"""A client's session: each of its requests is carried out once, also when something interrupts it.

A connection can break, and Ctrl-C or another signal can end a call at any moment. Then the server may have
carried out a request whose reply nobody has read. The session keeps this request, and sends it again, with
the same id, before the next one. The server (or the world of this process) carries it out if it had not
come; otherwise it sends the same reply again.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from typing import Any, TypeVar

from msgspec import structs

from palmares.errors import (
    CapacityError,
    ConnectionLostError,
    InternalError,
    InUseError,
    NoServerError,
    PalmaresError,
    RateLimitedError,
    RunLostError,
    SessionOverError,
    StaleTickError,
    WrongStateError,
)
from palmares.messages import Observation, Result
from palmares.net.codec import Message
from palmares.net.link import Link, Resumed, raise_if_fatal
from palmares.net.patience import Patience
from palmares.net.replayed import StepHistory
from palmares.net.stream import Stream
from palmares.net.transport import Closed
from palmares.scene import Scene
from palmares.wire import (
    Action,
    Opened,
    PerturbRequest,
    Reply,
    Request,
    ResetRequest,
    StepRequest,
    StopRequest,
)

LOG = logging.getLogger("palmares")
# Most repetitions of one request after the rate limit or a broken connection.
MAX_RETRIES = 20
# Longest wait for an observation before a check that the server is alive.
LISTEN_S = 1.0
# Requests that change a run: they are carried out also when they were interrupted.
CHANGES = (ResetRequest, StepRequest, PerturbRequest, StopRequest)

Answer = TypeVar("Answer", bound=Reply)


class Session:
    """The requests of a client, one at a time, and what their replies say of the run.

    Attributes:
        link: The connection, or the runs of this process.
        tick: Ticks since reset, as of the last observation; ``None`` when no run is open.
        run_id: Id of the open run.
        run: Parameters of the current or last run.
        scene: Its scene.
        motors: Number of its motors.
        realtime: Whether it follows the clock.
        newest: The last observation of the open run.
        result: Result of the last `stop`.
        stream: Observations of a real-time run.

    """

    def __init__(self, timeout_s: float) -> None:
        self.link: Link
        self._timeout_s = timeout_s
        self.tick: int | None = None
        self.run_id: str | None = None
        self.run: Opened | None = None
        self.scene: Scene | None = None
        self.motors = 0
        self.realtime = False
        self.newest: Observation | None = None
        self.result: Result | None = None
        self.stream = Stream()
        self._names: list[str] = []
        self._steps = StepHistory()
        self._unrequested: Result | None = None
        self._unread: tuple[Request, type[Reply]] | None = None
        """The request whose reply is not taken yet"""
        self._closed: Observation | None = None
        """Stands for the last observation of a run that the server closed, if nobody has it any more"""
        self._left_open = self._stop_first = False
        """Whether the server has a run that a lost reply to `reset` has opened; whether to stop it"""
        self._process = os.getpid()
        self._busy = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        """Return everything but the lock, for pickle; an interrupted step is made to its end first."""
        self.finish()
        return {name: value for name, value in self.__dict__.items() if name not in ("_busy", "_process")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue in this process."""
        self.__dict__.update(state)
        self._process = os.getpid()
        self._busy = threading.Lock()

    @property
    def forked(self) -> bool:
        """Whether this process is a child of the one that has the session with the server."""
        return os.getpid() != self._process and not self.link.copied_by_fork

    def ask(self, request: Request, kind: type[Answer]) -> Answer:
        """Carry out a request, after an interrupted one; return its reply.

        Raises:
            InUseError: Another call of this client is in progress, or the process is a forked one.
            PalmaresError: The request was refused, or the server is lost.

        """
        self.check_caller()
        with self._busy:
            self._finish()
            self._unread = request, kind
            return self._answered(request, kind)

    def finish(self) -> tuple[Request, Reply] | None:
        """Take the reply of an interrupted request; return both, or ``None`` when there is none."""
        if self._unread is None:
            return None
        self.check_caller()
        with self._busy:
            return self._finish()

    def check_caller(self) -> None:
        """Check that this is the process and the only thread that uses the client.

        Raises:
            InUseError: It is not.

        """
        if self.forked:
            raise InUseError(
                f"this client belongs to process {self._process}, and this is its forked child "
                f"{os.getpid()}: make a client in each process"
            )
        if os.getpid() != self._process:
            # A copy of the worlds, with which a thread of the parent may have been busy.
            self._process, self._busy = os.getpid(), threading.Lock()
        if self._busy.locked():
            raise InUseError(
                "another call of this client is in progress, in another thread or before a signal handler: "
                "use it from one thread at a time, or make one for each thread"
            )

    def named(self, obs: Observation) -> Observation:
        """Set the names of an observation's objects; return it."""
        if obs.has_truth:
            obs.truth.name_objects(self._names)
        return obs

    def forget_run(self) -> None:
        """Forget the open run: it has ended."""
        self.tick = self.run_id = self.newest = self._closed = None
        self._steps.clear()
        self.stream.close()
        self.link.set_realtime(False)

    def drop_unread(self) -> None:
        """Drop an interrupted request: its run is dropped, too."""
        self._unread = None

    # --- requests and replies ---

    def _finish(self) -> tuple[Request, Reply] | None:
        if self._unread is None:
            return None
        request, kind = self._unread
        # A part of a message may be sent or read.
        self.link.interrupted()
        if not isinstance(request, CHANGES):
            self._unread = None
            return None
        try:
            return request, self._answered(request, kind)
        except (PalmaresError, InUseError, TypeError, ValueError) as refused:
            if self._unread is not None or isinstance(refused, RunLostError):
                raise
            LOG.warning("an interrupted `%s` was refused: %s", request.__struct_config__.tag, refused)
            return None

    def _answered(self, request: Request, kind: type[Answer]) -> Answer:
        """Carry out the unread request and take its reply."""
        try:
            reply = self._exchange(request, kind)
        except (ConnectionLostError, NoServerError):
            raise  # It stays unread.
        except (PalmaresError, InUseError, TypeError, ValueError) as refused:
            if not isinstance(refused, PalmaresError) or not refused.fatal:
                self._unread = None
            raise
        self._take_reply(request, reply)
        self._unread = None
        return reply

    def _take_reply(self, request: Request, reply: Reply) -> None:
        """Note what a reply says; doing it twice changes nothing."""
        if isinstance(request, ResetRequest) and isinstance(reply, Observation):
            self.run, self.scene = reply.run, reply.scene
            self._names = [body.name for body in reply.scene.free] if reply.scene is not None else []
            self.motors = len(reply.hand.actuators)
            self._steps.clear()
            self._closed = None
            self.stream.open(reply.run_id)
            self.realtime = request.mode == "realtime"
            self.link.set_realtime(self.realtime)
            self.tick, self.run_id, self.newest = reply.tick, reply.run_id, self.named(reply)
        elif isinstance(request, StepRequest) and isinstance(reply, Observation):
            self._steps.made(request.tick, reply.tick, request.action)
            self.tick, self.newest = reply.tick, self.named(reply)
        elif isinstance(reply, Result):
            self.result = reply
            self.forget_run()
            self.link.welcome.run = None

    def _exchange(self, request: Request, kind: type[Answer]) -> Answer:
        """Repeat a request until a reply comes; wait as the server demands, resume a broken session."""
        last: Exception | None = None
        retries = 0
        patience = Patience()
        while retries < MAX_RETRIES:
            try:
                if self.link.resumed is not None:
                    ended = self._came_back(request)
                    if isinstance(ended, kind):
                        return ended
                if self._steps.behind is not None:
                    self._catch_up()
                if self._stop_first:
                    self.link.exchange(StopRequest(), Result)
                    self._stop_first, request.id = False, 0
                return self.link.exchange(request, kind)
            except Resumed:
                continue  # The heartbeat resumed after the check above: check again.
            except RateLimitedError as slower:
                # A refused request has changed nothing: send it again.
                time.sleep(0.1 if slower.retry_after_s is None else slower.retry_after_s)
                last = slower
            except WrongStateError as refused:
                if refused.retry_after_s is None:
                    reply, request = self._after_refusal(request, refused)
                    if isinstance(reply, kind):
                        return reply
                    continue
                # Only the refusals of a paused session have a time to retry.
                LOG.log(logging.DEBUG if last else logging.WARNING, "waiting: %s", refused)
                time.sleep(refused.retry_after_s)
                last = refused
                continue  # The session's clock is stopped, too: wait until the pause ends.
            except (SessionOverError, StaleTickError) as refused:
                reply, request = self._after_refusal(request, refused)
                if isinstance(reply, kind):
                    return reply
            except CapacityError as full:
                # In a competition the session keeps its place in the queue, and its clock is stopped.
                official = self.link.welcome.competition.mode == "official"
                if full.retry_after_s is None or not (official and isinstance(request, ResetRequest)):
                    raise
                LOG.log(logging.DEBUG if last else logging.WARNING, "waiting: %s", full)
                time.sleep(full.retry_after_s)
                last = full
                continue
            except InternalError as failed:
                patience.wait(failed)
                continue
            except Closed as lost:
                raise_if_fatal(lost)
                self.link.resume(lost)
                last = lost
            retries += 1
        if isinstance(last, RateLimitedError):
            raise last
        raise ConnectionLostError(f"the connection broke {MAX_RETRIES} times during one request") from last

    # --- a session that was resumed on another connection ---

    def _came_back(self, request: Request | None) -> Result | None:
        """Compare the run with the server's; return the result if `request` is a stop that was carried out.

        Raises:
            RunLostError: The server has closed the run.

        """
        welcome = self.link.resumed
        if welcome is None:
            return None
        run, result = welcome.run, None
        self._steps.behind = self._closed = None
        self._left_open = self._stop_first = False
        if self.run_id is None:
            self._left_open = run is not None and run.open and isinstance(request, ResetRequest)
        elif run is None or run.run_id != self.run_id:
            lost = self._run_lost()
            self.link.take_resumed(welcome)
            if lost.result is None or not isinstance(request, StopRequest):
                raise lost
            result = lost.result
        elif not run.open and self.newest is not None:
            ended: dict[str, Any] = {"tick": run.tick, "truncated": True, "reason": "closed", "events": []}
            closed = structs.replace(self.newest, **ended)
            if self.realtime:
                self.stream.put(closed)
            else:
                self._closed = closed
        elif not self.realtime and self.tick is not None and run.tick < self.tick:
            # Another host has continued the run from an earlier tick: the steps since then are sent again.
            self._steps.rewind(run.tick)
        self.link.take_resumed(welcome)
        return result

    def _after_refusal(self, request: Request, refused: PalmaresError) -> tuple[Observation | None, Request]:
        """Return the reply to a request that the server cannot repeat, or the request to send instead."""
        run = self.link.welcome.run
        if isinstance(request, ResetRequest) and self._left_open:
            # Another host has the run, and nobody has its scene any more: close it and open another.
            self._left_open, self._stop_first = False, True
            return None, request
        if isinstance(request, StepRequest):
            stale = isinstance(refused, StaleTickError)
            if self._closed is not None and not stale:
                return self._closed, request
            if stale and run is not None and run.tick != request.tick:
                # A server before 0.3 does not repeat a reply; or the run went back by more than is known.
                LOG.warning("an observation was lost: the run goes on from tick %d", run.tick)
                return None, StepRequest(tick=run.tick, action=Action())
        raise refused

    def _catch_up(self) -> None:
        """Send steps again; drop the observations, which the controller has."""
        while (step := self._steps.next(self.link.welcome.limits.repeat)) is not None:
            obs = self.link.exchange(step, Observation)
            self._steps.behind = obs.tick
            if obs.done:
                # Only a limit of the session ends the run earlier than before.
                self._steps.behind = None
                self._closed = self.named(obs)

    def _run_lost(self) -> RunLostError:
        """Forget a run that the server has closed; return the error with its outcome."""
        run_id = self.run_id or ""
        result = self._unrequested
        if result is None or result.run_id != run_id:
            result = self.link.result_of(run_id)
        self.forget_run()
        return RunLostError.of(run_id, result)

    # --- messages that answer no request ---

    def receive(self, message: Message) -> None:
        """Take a message that answers no request."""
        if isinstance(message, Observation):
            self.stream.put(self.named(message))
        elif isinstance(message, Result):
            self._unrequested = message

    def take_streamed(self) -> Observation | None:
        """Return the newest observation of a real-time run, once."""
        obs = self.stream.take()
        if obs is not None:
            self.newest, self.tick = obs, obs.tick
        return obs

    def listen(self, wait_s: float) -> Observation | None:
        """Return the newest observation of a real-time run; if there is none, wait for one."""
        try:
            if self.link.resumed is not None:
                self._came_back(None)
            self.link.listen(wait_s)
        except Closed as lost:
            raise_if_fatal(lost)
            self.link.resume(lost)
            self._came_back(None)
        return self.take_streamed()

    def next_streamed(self) -> Observation:
        """Wait for an observation newer than the last one."""
        while True:
            obs = self.listen(LISTEN_S)
            if obs is not None:
                return obs
            if self.link.silence_s() > self._timeout_s:
                raise ConnectionLostError(f"{self.link.where} has been silent for {self._timeout_s:g} s")
