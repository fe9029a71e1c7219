"""The link of a `palmares.Client` without a server: runs in this process."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn, TypeVar

from numpy.typing import ArrayLike

from palmares import sim
from palmares.errors import BadRequestError, UnknownHandError, UnknownTaskError, WrongStateError
from palmares.messages import Result, Welcome
from palmares.net.codec import Encoding
from palmares.net.link import CLOSED, Link
from palmares.wire import (
    LeaderboardRow,
    PerturbRequest,
    Reply,
    Request,
    ResetRequest,
    RunInfo,
    StepRequest,
    StopRequest,
    Time,
    TimeRequest,
)

Answer = TypeVar("Answer", bound=Reply)

# The limit of servers, so that a controller plays on both.
REPEAT = 100


@dataclass(frozen=True)
class _Now:
    """The state of the link. It changes in one moment, so that Ctrl-C finds the one before or the one after.

    `request` and `reply` are those of the last `reset` or `stop`.
    """

    world: sim.World | None = None
    open: bool = False
    simulated_s: float = 0.0
    request: Request | None = None
    reply: Reply | None = None


class LocalLink(Link):
    """Handles the requests of a client in this process, as `palmares.net.link.Link` does over a connection.

    Attributes:
        welcome: The greeting of a practice server.
        resumed: Always ``None``: no connection can break.
        training: Options for learners in later runs.
        parameters: Numbers given for later runs, as of `palmares.sim.World.reset`.

    """

    copied_by_fork = True

    # No connection is made, so `Link.__init__` is not called.
    def __init__(self, team: str, training: sim.Training | None = None) -> None:
        self._team = team
        self.training = training
        self.parameters: Mapping[str, ArrayLike] | None = None
        self._own_hands: list[str] = []
        self._own_tasks: list[str] = []
        self._closed = False
        self._now = _Now()
        self._greet()
        self.resumed = None

    @property
    def world(self) -> sim.World | None:
        """The world of the current or last run."""
        return self._now.world

    def __getstate__(self) -> dict[str, Any]:
        """Return everything, for pickle: there is no connection."""
        return self.__dict__

    def exchange(self, request: Request, kind: type[Answer]) -> Answer:
        """Handle a request and return the reply.

        Raises:
            PalmaresError: The request was refused.

        """
        if self._closed:
            raise WrongStateError(CLOSED)
        reply: Reply
        if self._now.reply is not None and self._now.request is request:
            reply = self._now.reply  # Ctrl-C came before the client had it.
        elif isinstance(request, ResetRequest):
            reply = self._reset(request)
        elif isinstance(request, StepRequest | PerturbRequest):
            reply = self._in_the_run(request, kind)
        elif isinstance(request, StopRequest):
            reply = self._stop(request)
        elif isinstance(request, TimeRequest):
            reply = self._time()
        else:
            raise BadRequestError(f"bad_request: `{request.__struct_config__.tag}` needs a server")
        assert isinstance(reply, kind)
        return reply

    def _in_the_run(self, request: StepRequest | PerturbRequest, kind: type[Answer]) -> Answer:
        try:
            return self._opened().ask(request, kind)
        except WrongStateError as refused:
            if self._now.open:
                raise WrongStateError(f"{refused}; stop() returns its result") from None
            raise

    def _reset(self, request: ResetRequest) -> Reply:
        if self._now.open:
            raise WrongStateError("wrong_state: a run is open; stop it first")
        if request.mode != "lockstep":
            raise BadRequestError(
                f"bad_request: mode {request.mode!r} needs a server; in this process worlds run in lockstep"
            )
        self._meet_task(request.task)
        self._meet_hand(request.hand)
        try:
            world = sim.World(
                request.task,
                request.hand,
                secrets.randbelow(2**53) if request.seed is None else request.seed,
                sensing=request.sensing,
                noise=request.noise or "none",
                training=self.training,
            )
            if self.parameters:
                world.reset(parameters=self.parameters)
        except ValueError as refused:
            raise BadRequestError(f"bad_request: {refused}") from None
        obs = world.observe(cameras=request.cameras)
        obs.run, obs.scene = world.run, world.scene
        self._now = _Now(world, True, self._now.simulated_s, request, obs)
        return obs

    def _meet_task(self, task: str) -> None:
        """Add a task given by its path to the greeting."""
        if task in self._own_tasks or task in sim.TASKS:
            return
        try:
            self._greet(own_task=[task])
        except ValueError as unreadable:
            raise UnknownTaskError(f"unknown_task: {unreadable}") from None

    def _meet_hand(self, hand: str) -> None:
        """Add a hand given by its path to the greeting."""
        if hand in self._own_hands or any(known.name == hand for known in self.welcome.hands):
            return
        try:
            self._greet(own_hand=[hand])
        except ValueError as unreadable:
            raise UnknownHandError(f"unknown_hand: {unreadable}") from None

    def _greet(self, own_hand: Sequence[str] = (), own_task: Sequence[str] = ()) -> None:
        """Set the greeting, with one more hand or task given by its path."""
        hands, tasks = [*self._own_hands, *own_hand], [*self._own_tasks, *own_task]
        self.welcome = sim.welcome(self._team, hands, tasks)
        self.welcome.limits.repeat = REPEAT
        self._own_hands, self._own_tasks = hands, tasks

    def _opened(self) -> sim.World:
        if self._now.world is None or not self._now.open:
            raise WrongStateError("wrong_state: no run is open; call reset(…) first")
        return self._now.world

    def _stop(self, request: StopRequest) -> Result:
        world = self._opened()
        result = world.result()
        self._now = _Now(world, False, self._now.simulated_s + result.sim_time_s, request, result)
        return result

    def _time(self) -> Time:
        run, simulated_s = None, self._now.simulated_s
        if self.world is not None and self._now.open:
            played = self.world.run
            simulated_s += self.world.tick * played.tick_s
            run = RunInfo(
                run_id=self.world.run_id,
                task=played.task,
                hand=played.hand,
                mode="lockstep",
                tick=self.world.tick,
                open=True,
            )
        return Time(
            session_left_s=None,
            session_s=None,
            elapsed_s=simulated_s,
            wall_s=0.0,
            simulated_s=simulated_s,
            refunded_s=0.0,
            paused=False,
            run=run,
            server_unix_ms=time.time_ns() // 1_000_000,
        )

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed

    @property
    def where(self) -> str:
        """No address."""
        return "local"

    @property
    def encoding(self) -> Encoding:
        """The encoding between this package and its compiled part."""
        return "msgpack"

    # --- requests that a server answers over HTTP ---

    def describe_hand(self, name: str) -> dict[str, Any]:
        """Return the description of a hand, by name or path."""
        try:
            return sim.describe_hand(name)
        except ValueError as unknown:
            raise UnknownHandError(f"unknown_hand: {unknown}") from None

    def save_replay(self, run_id: str, path: str | os.PathLike[str]) -> None:
        """Write the replay of the current or last run."""
        if self.world is None or self.world.run_id != run_id:
            raise WrongStateError(f"wrong_state: run {run_id} is not the last one")
        self.world.save_replay(path, self._team)

    def leaderboard(self) -> list[LeaderboardRow]:
        """Refuse: there is no leaderboard."""
        raise WrongStateError("wrong_state: runs in this process have no leaderboard")

    def result_of(self, run_id: str) -> Result | None:  # noqa: ARG002 - as `Link` has it
        """Return ``None``: no result is stored."""
        return None

    # --- parts of a connection, without effect here ---

    def listen(self, wait_s: float) -> NoReturn:  # noqa: ARG002 - as `Link` has it
        """Refuse: a lockstep world sends replies only."""
        raise WrongStateError("wrong_state: in this process worlds run in lockstep; call step(…)")

    def resume(self, lost: Exception) -> None:
        """Do nothing."""

    def take_resumed(self, welcome: Welcome) -> None:
        """Do nothing."""

    def interrupted(self) -> None:
        """Do nothing: a world keeps its requests."""

    def silence_s(self) -> float:
        """Return zero."""
        return 0.0

    def set_realtime(self, realtime: bool) -> None:
        """Do nothing."""

    def abort(self) -> None:
        """Do nothing."""

    def beat(self) -> None:
        """Do nothing."""

    def abandon(self) -> None:
        """Drop the world."""
        self._now = _Now(simulated_s=self._now.simulated_s)

    def close(self) -> None:
        """Drop the world; further requests are refused."""
        self.abandon()
        self._closed = True
