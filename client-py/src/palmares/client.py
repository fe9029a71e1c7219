"""The client: one session with the server, one request at a time."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Any, Literal, Self, TypeVar
from urllib.parse import urlsplit

from msgspec import structs

from palmares import rest
from palmares.codec import Encoding, Message
from palmares.errors import (
    ConnectionLostError,
    RateLimitedError,
    RunLostError,
    SessionOverError,
    WrongStateError,
)
from palmares.link import Link, Returned, raise_if_fatal
from palmares.messages import (
    Ack,
    BaseTarget,
    Competition,
    LeaderboardRow,
    Observation,
    Reply,
    Result,
    Time,
    Welcome,
)
from palmares.requests import Act, Hello, Perturb, Request, Reset, Step, Stop, Wrench
from palmares.requests import Time as AskTime
from palmares.scene import Scene
from palmares.stream import Stream
from palmares.targets import action_of
from palmares.transport import Closed
from palmares.version import VERSION

LOG = logging.getLogger("palmares")
# How often a single request may be put off by the rate limit or a broken connection.
MOST_WAITS = 20
# How long to listen for an observation before looking whether anybody is still there.
LISTEN_S = 1.0

Answer = TypeVar("Answer", bound=Reply)


class Client:
    """A session with a Palmares server. Use it from one thread.

    Args:
        url: Where the server listens: ``http://host:port`` (or https, ws, wss).
        team: The name on a practice server's leaderboard, 1 to 64 characters. In a competition the token says
            who you are.
        token: The team's token; the environment variable ``PALMARES_TOKEN`` when left out. A
            practice server needs none.
        session_s: Practice only: ask for a session of this length, s. Left out, it has no limit.
        encoding: ``json`` or ``msgpack``; left out, the faster one of those that the server speaks.
        local: Use the socket for neighbours that a server on this machine offers: through it a call takes
            less time than through the loopback interface.
        timeout_s: How long to wait for any reply before giving up, s.
        reconnect_s: How long to try to come back when the connection breaks or the server restarts, s.

    Raises:
        NoServerError: Nobody answers at `url`.
        NotAuthorizedError: The server wants a token, or another one.
        PalmaresError: The server refused the greeting.

    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        *,
        team: str = "palmares-py",
        token: str | None = None,
        session_s: float | None = None,
        encoding: Encoding | None = None,
        local: bool = True,
        timeout_s: float = 60.0,
        reconnect_s: float = 60.0,
    ) -> None:
        self._http_url, ws_url = _addresses(url)
        self._token = token if token is not None else os.environ.get("PALMARES_TOKEN")
        self._timeout_s = timeout_s
        self._tick: int | None = None
        self._run_id: str | None = None
        self._scene: Scene | None = None
        self._names: list[str] = []
        self._newest: Observation | None = None
        self._stream = Stream()
        self._unasked: Result | None = None
        self._link = Link(
            self._http_url,
            ws_url,
            Hello(client={"name": team, "version": VERSION}, session_s=session_s),
            token=self._token,
            encoding=encoding,
            local=local,
            timeout_s=timeout_s,
            reconnect_s=reconnect_s,
            news=self._hear,
        )

    # --- what a controller calls ---

    def reset(
        self,
        task: str,
        hand: str,
        *,
        mode: Literal["lockstep", "realtime"] = "lockstep",
        sensing: Literal["sensors", "truth"] = "truth",
        seed: int | None = None,
    ) -> Observation:
        """Open a run and return its first observation, tick 0, with the `scene` in it.

        Args:
            task: Name of the task, such as ``balls``.
            hand: Name of the hand, such as ``softhand``.
            mode: ``lockstep``: the world waits for every `step`. ``realtime``: it runs by the clock;
                `act` sets targets, `observations` and `latest` tell what happens.
            sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
            seed: Which scene, in practice; left out, the server draws one and `obs.run.seed` tells it.

        A run of yours that is still open must be stopped first.

        """
        self._stop_what_was_left()
        obs = self._ask(Reset(task=task, hand=hand, mode=mode, sensing=sensing, seed=seed), Observation)
        self._tick, self._scene, self._run_id = obs.tick, obs.scene, obs.run_id
        self._names = [body.name for body in obs.scene.free] if obs.scene is not None else []
        self._newest = self._named(obs)
        self._stream.open(obs.run_id)
        self._link.keep_up(mode == "realtime")
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
        request = Step(tick=self._tick, action=action_of(base, hand), repeat=repeat)
        try:
            obs = self._ask(request, Observation)
        except (WrongStateError, SessionOverError):
            # The step before the connection broke was the run's last one.
            last = self._take()
            if last is None:
                raise
            return last
        self._tick, self._newest = obs.tick, self._named(obs)
        return obs

    def act(self, base: BaseTarget | None = None, hand: Iterable[float] | None = None) -> int:
        """Set the targets of a run in real time, from the next tick on; return that tick.

        Args:
            base: `palmares.pose(…)` or `palmares.twist(…)`; left out, the last target stands.
            hand: σ of every motor in [0, 1]; left out, the last command stands.

        """
        if self._tick is None:
            raise WrongStateError("wrong_state: no run is open; call reset(…) first")
        try:
            return self._ask(Act(action=action_of(base, hand)), Ack).tick
        except WrongStateError:
            # The world ran on while this was under way: the next observation tells that it is over.
            if self._stream.over:
                return self._tick
            raise

    def observations(self) -> Iterator[Observation]:
        """Yield what happens in a run in real time, until it is over.

        Every observation is the newest there is. A controller that is slower than real time does not fall
        behind: it misses observations, of which `skipped` tells the number; their events come with the next.

        """
        while self._run_id is not None:
            obs = self._next()
            yield obs
            if obs.done:
                return

    def latest(self) -> Observation:
        """Return the newest observation of a run in real time at once; the same again if none came."""
        if self._newest is None:
            raise WrongStateError("wrong_state: no run is open; call reset(…) first")
        try:
            self._check_return(Stop())
            self._link.listen(0.0)
        except Closed as lost:
            raise_if_fatal(lost)
            self._link.resume(lost)
            self._check_return(Stop())
        return self._take() or self._newest

    def perturb(
        self,
        link: str,
        force: Iterable[float] = (0.0, 0.0, 0.0),
        torque: Iterable[float] = (0.0, 0.0, 0.0),
        duration_s: float = 0.1,
    ) -> int:
        """Push a link of the hand, in practice; return the tick at which it begins.

        Args:
            link: Name of the link, as in `describe_hand`.
            force: N, world frame, at the link's origin.
            torque: N·m, world frame.
            duration_s: How long, s of simulated time.

        """
        fx, fy, fz = map(float, force)
        tx, ty, tz = map(float, torque)
        wrench = Wrench(force=(fx, fy, fz), torque=(tx, ty, tz))
        return self._ask(Perturb(link=link, wrench=wrench, duration_s=duration_s), Ack).tick

    def stop(self) -> Result:
        """Close the run: the objects settle, the referee counts."""
        run_id = self._run_id
        try:
            result = self._ask(Stop(), Result)
        except RunLostError as lost:
            if lost.result is None or lost.result.run_id != run_id:
                raise
            result = lost.result
        self._forget_run()
        self.welcome.run = None
        return result

    def time(self) -> Time:
        """Read the session's clock. Works at any moment."""
        return self._ask(AskTime(), Time)

    def leaderboard(self) -> list[LeaderboardRow]:
        """Return the rows of the leaderboard, best first."""
        return rest.leaderboard(self._http_url, self._token)

    def describe_hand(self, name: str) -> dict[str, Any]:
        """Return the description of a hand as the server gives it: links, joints, motors, shapes."""
        return rest.get_object(self._http_url, f"/v1/hands/{name}", self._token)

    @property
    def welcome(self) -> Welcome:
        """What the server said when this session began or was taken up: tasks, hands, limits, specs."""
        return self._link.welcome

    @property
    def competition(self) -> Competition:
        """What is being played: its name, mode, the length of a session, what a reset costs."""
        return self._link.welcome.competition

    @property
    def encoding(self) -> Encoding:
        """How messages are written: ``json`` or ``msgpack``."""
        return self._link.encoding

    @property
    def scene(self) -> Scene:
        """The scene of the present run."""
        if self._scene is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._scene

    @property
    def tick(self) -> int | None:
        """Ticks since reset, as of the last observation; ``None`` when no run is open."""
        return self._tick

    @property
    def skipped(self) -> int:
        """Observations of the last run in real time that newer ones replaced before you took them."""
        return self._stream.skipped

    def close(self) -> None:
        """End the session. A run still open is stopped and scored by the server."""
        self._link.close()

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

    def _ask(self, request: Request, kind: type[Answer]) -> Answer:
        """Ask until there is an answer: wait when told to, take up the session when it breaks."""
        last: Exception | None = None
        troubles = 0
        while troubles < MOST_WAITS:
            try:
                if self._link.returned is not None:
                    request = self._check_return(request)
                return self._link.exchange(request, kind)
            except Returned:
                continue  # Since the look a moment ago: look again.
            except RateLimitedError as slower:
                # A request that fails has changed nothing, so it can be sent again.
                time.sleep(0.1 if slower.retry_after_s is None else slower.retry_after_s)
                last = slower
            except WrongStateError as paused:
                # Only a session that an organizer has paused is told when to ask again.
                if paused.retry_after_s is None:
                    raise
                LOG.log(logging.DEBUG if last else logging.WARNING, "waiting: %s", paused)
                time.sleep(paused.retry_after_s)
                last = paused
                continue  # It may take as long as it takes; the clock stands still.
            except Closed as lost:
                raise_if_fatal(lost)
                self._link.resume(lost)
                last = lost
            troubles += 1
        if isinstance(last, RateLimitedError):
            raise last
        raise ConnectionLostError(f"the connection broke {MOST_WAITS} times during one request") from last

    def _check_return(self, request: Request) -> Request:
        """Return what to send now that the connection is back; the request may have been taken before."""
        welcome = self._link.take_return()
        if welcome is None:
            return request
        run = welcome.run
        if self._run_id is None:
            if run is not None and isinstance(request, Reset):
                # The run was opened but its scene is lost: close it and open another.
                self._link.exchange(Stop(), Result)
        elif run is None or run.run_id != self._run_id:
            raise self._run_lost()
        elif not run.open and self._newest is not None:
            # Nobody will say any more that it is over.
            closed = structs.replace(self._newest, tick=run.tick, truncated=True, reason="closed", events=[])
            self._stream.put(closed)
        elif isinstance(request, Step) and run.tick != request.tick:
            # The step was taken but its observation is lost: one tick more, with the same targets, shows it.
            return Step(tick=run.tick, action=action_of(None, None))
        return request

    def _run_lost(self) -> RunLostError:
        """Find out what became of the run that the server has no more, and forget it."""
        run_id = self._run_id or ""
        result = self._unasked
        if result is None or result.run_id != run_id:
            result = rest.result_of(self._http_url, run_id, self._token)
        self._forget_run()
        return RunLostError.of(run_id, result)

    def _stop_what_was_left(self) -> None:
        """Stop the run of an earlier program of this team, whose session was taken up by the team's token."""
        left = self.welcome.run
        if left is None or self._run_id is not None:
            return
        LOG.warning(
            "run %s was left open at tick %d by an earlier program: it is stopped", left.run_id, left.tick
        )
        self._ask(Stop(), Result)
        self.welcome.run = None

    def _named(self, obs: Observation) -> Observation:
        """Let an observation know what its objects are called."""
        if obs.truth is not None:
            obs.truth.name_objects(self._names)
        return obs

    def _forget_run(self) -> None:
        self._tick = self._run_id = self._newest = None
        self._stream.close()
        self._link.keep_up(False)

    # --- what comes unasked ---

    def _hear(self, message: Message) -> None:
        if isinstance(message, Observation):
            self._stream.put(self._named(message))
        elif isinstance(message, Result):
            self._unasked = message

    def _take(self) -> Observation | None:
        obs = self._stream.take()
        if obs is not None:
            self._newest, self._tick = obs, obs.tick
        return obs

    def _next(self) -> Observation:
        """Wait for an observation newer than the last one."""
        while True:
            try:
                if self._link.returned is not None:
                    self._check_return(Stop())
                self._link.listen(LISTEN_S)
            except Closed as lost:
                raise_if_fatal(lost)
                self._link.resume(lost)
            obs = self._take()
            if obs is not None:
                return obs
            if self._link.silence_s() > self._timeout_s:
                raise ConnectionLostError(f"{self._http_url} has been silent for {self._timeout_s:g} s")


def _addresses(url: str) -> tuple[str, str]:
    parts = urlsplit(url if "://" in url else f"http://{url}")
    schemes = {"http": "ws", "https": "wss", "ws": "ws", "wss": "wss"}
    if parts.scheme not in schemes or not parts.netloc:
        raise ValueError(f"{url!r} is not the address of a server; try http://127.0.0.1:8080")
    ws = schemes[parts.scheme]
    http = "https" if ws == "wss" else "http"
    path = parts.path.rstrip("/")
    return f"{http}://{parts.netloc}{path}", f"{ws}://{parts.netloc}{path}/v1/control"
