"""The client: one session with the server, one request at a time."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

from msgspec import structs
from numpy.typing import ArrayLike

from palmares import own_task
from palmares.arguments import MAX_SEED
from palmares.clipping import Clipping
from palmares.errors import (
    CapacityError,
    ConnectionLostError,
    RateLimitedError,
    RunLostError,
    SessionOverError,
    WrongStateError,
)
from palmares.messages import Observation, Result, Welcome
from palmares.net.address import addresses
from palmares.net.codec import Encoding, Message
from palmares.net.link import CLOSED, Link, Resumed, raise_if_fatal
from palmares.net.replayed import StepHistory
from palmares.net.requests import names, whole_of
from palmares.net.stream import Stream
from palmares.net.transport import Closed
from palmares.scene import Scene
from palmares.targets import Base, Hand, Numbers, action_of, vector
from palmares.training import Training, checked
from palmares.version import VERSION
from palmares.wire import (
    Ack,
    Action,
    ActRequest,
    Competition,
    HelloRequest,
    LeaderboardRow,
    Opened,
    PerturbRequest,
    PushWrench,
    Reply,
    Request,
    ResetRequest,
    StepRequest,
    StopRequest,
    Time,
    TimeRequest,
)

if TYPE_CHECKING:
    from palmares.sim import World

LOG = logging.getLogger("palmares")
NO_RUN = "wrong_state: no run is open; call reset(…) first"
# The address of runs in this process.
LOCAL = "local"
NO_TRAINING = "training: servers do not offer it; use url='local'"
# Most repetitions of one request after the rate limit or a broken connection.
MAX_RETRIES = 20
# Longest wait for an observation before a check that the server is alive.
LISTEN_S = 1.0

Answer = TypeVar("Answer", bound=Reply)


class Client:
    """A session with a Palmares server. Use it from one thread.

    Args:
        url: Address of the server: ``http://host:port`` (or https, ws, wss). ``local`` needs no server:
            lockstep runs are played in this process by `palmares.sim`, and the `hand` of a `reset` may be a
            path.
        team: The name on a practice server's leaderboard, 1 to 64 characters. In a competition the token
            identifies the team.
        token: The team's token; the environment variable ``PALMARES_TOKEN`` when left out. A
            practice server needs none.
        session_s: Practice only: length of the session; no limit when left out.
        encoding: ``json`` or ``msgpack``; left out, the fastest that the server supports.
        timeout_s: Longest wait for a reply.
        reconnect_s: Longest time to reconnect after the connection breaks or the server restarts.
        training: Only with ``local``: shaped rewards and varied runs, a `palmares.sim.Training`.

    Attributes:
        clipping: Warns when a field of an action is clipped, once in each run.

    Raises:
        NoServerError: There is no server at `url`.
        NotAuthorizedError: The token is missing or wrong.
        PalmaresError: The server refused the session.

    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        *,
        team: str = "palmares-py",
        token: str | None = None,
        session_s: float | None = None,
        encoding: Encoding | None = None,
        timeout_s: float = 60.0,
        reconnect_s: float = 60.0,
        training: Training | None = None,
    ) -> None:
        if not isinstance(team, str):
            raise ValueError(f"team: found {team!r}; wanted a text of 1 to 64 characters")
        self._timeout_s = timeout_s
        self._tick: int | None = None
        self._run_id: str | None = None
        self._result: Result | None = None
        self._run: Opened | None = None
        self._scene: Scene | None = None
        self._names: list[str] = []
        self._motors = 0
        self._newest: Observation | None = None
        self._stream = Stream()
        self._steps = StepHistory()
        self.clipping = Clipping()
        self._unrequested: Result | None = None
        self._link: Link
        if url == LOCAL:
            from palmares.sim.local import LocalLink

            checked(training)
            self._link = LocalLink(team, training)
            return
        if training is not None:
            raise ValueError(NO_TRAINING)
        server = addresses(url)
        self._link = Link(
            server.http,
            server.control,
            HelloRequest(client={"name": team, "version": VERSION}, session_s=session_s),
            token=token if token is not None else os.environ.get("PALMARES_TOKEN") or None,
            encoding=encoding,
            timeout_s=timeout_s,
            reconnect_s=reconnect_s,
            on_message=self._receive,
        )
        if self.welcome.note is not None:
            LOG.warning("%s", self.welcome.note)

    # --- for controllers ---

    def reset(
        self,
        task: str,
        hand: str,
        *,
        mode: Literal["lockstep", "realtime"] = "lockstep",
        sensing: Literal["sensors", "truth"] = "truth",
        noise: Literal["none", "real"] | None = None,
        seed: int | None = None,
        cameras: Iterable[str] = (),
    ) -> Observation:
        """Open a run and return its first observation, of tick 0.

        Args:
            task: Name of the task, such as ``balls``, or the folder of your own; a server must have been
                started with that folder.
            hand: Name of the hand, such as ``softhand``.
            mode: ``lockstep``: the world waits for every `step`. ``realtime``: it runs by the clock;
                `act` sets targets, `observations` and `latest` return observations.
            sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
            noise: ``none`` for sensors without errors, ``real`` for the noise, bias, latency and drop-outs of
                real ones. Left out, the server decides (`Competition.noise`); a competition allows no other.
            seed: Practice only: selects the scene. Left out, the server draws one; `run` has it.
            cameras: Cameras that return an image of tick 0, as in `step`.

        An open run must be stopped first. While the server of a competition is full, this waits for a place;
        the session's clock is stopped meanwhile.

        Raises:
            CapacityError: A practice server is full.

        """
        seed = None if seed is None else whole_of("seed", seed, 0, MAX_SEED)
        self._stop_earlier_run()
        if not self.is_local:
            task = own_task.name_of(task, [known.name for known in self.welcome.tasks])
        request = ResetRequest(
            task=task,
            hand=hand,
            mode=mode,
            sensing=sensing,
            noise=noise,
            seed=seed,
            cameras=names(cameras),
        )
        obs = self._ask(request, Observation)
        self._tick, self._run_id = obs.tick, obs.run_id
        self.clipping.begin()
        self._run, self._scene = obs.run, obs.scene
        self._names = [body.name for body in obs.scene.free] if obs.scene is not None else []
        self._motors = len(obs.hand.actuators)
        self._newest = self._named(obs)
        self._stream.open(obs.run_id)
        self._steps.clear()
        self._link.set_realtime(mode == "realtime")
        return obs

    def step(
        self,
        base: Base | None = None,
        hand: Hand | None = None,
        repeat: int = 1,
        cameras: Iterable[str] = (),
        effort: Hand | None = None,
    ) -> Observation:
        """Advance the world by `repeat` ticks under one action; return the observation after them.

        Args:
            base: `palmares.pose(…)` or `palmares.twist(…)`, or a pose as ``(position, quat_xyzw)`` or seven
                numbers; left out, the last target holds.
            hand: σ of every motor in [0, 1], for a single motor also a number; left out, the last command
                holds.
            repeat: Number of ticks, at most `Limits.repeat`; fewer when the run ends before.
            cameras: Images to return in `Observation.cameras`: ``"wrist"`` for depth, ``"wrist.rgb"`` for
                colours, ``"wrist.bodies"`` for the body in each pixel (only with ``sensing="truth"``).
                `TaskInfo.cameras` and `HandInfo.cameras` list the cameras.
            effort: Part of its largest force that each motor may use, in [0, 1], in the form of `hand`; left
                out, the last one holds, and 1 before the first.

        Raises:
            BadActionError: `base`, `hand` or `effort` has a wrong shape or is not finite; nothing was sent.
            BadRequestError: `repeat` is out of range; nothing was sent.
            WorldFaultError: The world failed; `fault` is the cause. `stop` returns the void result.

        """
        if self._tick is None:
            raise self._no_run()
        action = action_of(base, hand, self._motors, effort)
        repeat = whole_of("repeat", repeat, 1, self.welcome.limits.repeat)
        request = StepRequest(tick=self._tick, action=action, repeat=repeat, cameras=names(cameras))
        try:
            obs = self._ask(request, Observation)
        except (WrongStateError, SessionOverError):
            # The run ended with the step before this one, whose observation was lost with the connection.
            last = self._take()
            if last is None:
                raise
            return last
        self._steps.made(request.tick, obs.tick, action)
        self._tick, self._newest = obs.tick, self._named(obs)
        self.clipping.request(action)
        self.clipping.compare(obs.applied_action, obs.tick, stacklevel=2)
        return obs

    def act(
        self,
        base: Base | None = None,
        hand: Hand | None = None,
        cameras: Iterable[str] = (),
        effort: Hand | None = None,
    ) -> int:
        """Set the targets of a real-time run from the next tick on; return that tick.

        Args:
            base: As in `step`; left out, the last target holds.
            hand: As in `step`; left out, the last command holds.
            cameras: Images that the next observation has, as in `step`.
            effort: As in `step`; left out, the last one holds.

        """
        if self._tick is None:
            raise self._no_run()
        try:
            action = action_of(base, hand, self._motors, effort)
            tick = self._ask(ActRequest(action=action, cameras=names(cameras)), Ack).tick
            self.clipping.request(action, tick)
            return tick
        except WrongStateError:
            # The run ended meanwhile; its last observation is not read yet.
            if self._stream.over:
                return self._tick
            raise

    def observations(self) -> Iterator[Observation]:
        """Yield the observations of a real-time run until it is over.

        Each is the newest one. A controller that is slower than real time does not fall behind: it misses
        observations, which `skipped` counts; their events come with the next one. When the world fails, the
        last observation is truncated with the reason ``world_fault``; `Result.fault` of `stop` is the cause.

        """
        while self._run_id is not None:
            obs = self._next()
            self.clipping.compare(obs.applied_action, obs.tick, stacklevel=2)
            yield obs
            if obs.done:
                return

    def latest(self) -> Observation:
        """Return the newest observation of a real-time run at once; the last one again if none came."""
        if self._newest is None:
            raise self._no_run()
        try:
            self._check_resumed(StopRequest())
            self._link.listen(0.0)
        except Closed as lost:
            raise_if_fatal(lost)
            self._link.resume(lost)
            self._check_resumed(StopRequest())
        return self._take() or self._newest

    def perturb(
        self,
        link: str,
        force: Numbers = (0.0, 0.0, 0.0),
        torque: Numbers = (0.0, 0.0, 0.0),
        duration_s: float = 0.1,
    ) -> int:
        """Apply a wrench to a link of the hand, in practice; return the tick at which it begins.

        Args:
            link: Name of the link, as in `describe_hand`.
            force: (3,), N, world frame, at the link's origin.
            torque: (3,), N·m, world frame.
            duration_s: Duration, simulated time.

        """
        wrench = PushWrench(force=vector("force", force), torque=vector("torque", torque))
        return self._ask(PerturbRequest(link=link, wrench=wrench, duration_s=duration_s), Ack).tick

    def stop(self) -> Result:
        """Close the run; the objects settle and are counted. Return the result."""
        run_id = self._run_id
        try:
            result = self._ask(StopRequest(), Result)
        except RunLostError as lost:
            if lost.result is None or lost.result.run_id != run_id:
                raise
            result = lost.result
        self._forget_run()
        self._result = result
        self.welcome.run = None
        return result

    def abandon(self) -> None:
        """Close the run without a result; in this process nothing settles and nothing is counted."""
        if self.is_local:
            self._link.abandon()
            self._forget_run()
        else:
            self.stop()

    def time(self) -> Time:
        """Return the session's clock."""
        return self._ask(TimeRequest(), Time)

    def leaderboard(self) -> list[LeaderboardRow]:
        """Return the rows of the leaderboard, best first."""
        return self._link.leaderboard()

    def describe_hand(self, name: str) -> dict[str, Any]:
        """Return the server's description of a hand: links, joints, motors, tendons, shapes, masses."""
        return self._link.describe_hand(name)

    def save_replay(self, path: str | os.PathLike[str]) -> None:
        """Write the replay of the last stopped run to a file, for ``palmares verify`` and the pages.

        Raises:
            WrongStateError: No run was stopped yet.
            NotFoundError: The server does not record.

        """
        if self._result is None:
            raise WrongStateError("wrong_state: no run was stopped yet; call stop() first")
        self._link.save_replay(self._result.run_id, path)

    @property
    def result(self) -> Result | None:
        """Result of the last `stop`."""
        return self._result

    @property
    def is_local(self) -> bool:
        """True with ``url="local"``: runs are played in this process."""
        return self._link.where == LOCAL

    @property
    def world(self) -> World | None:
        """With ``url="local"`` the world of the current or last run; ``None`` on a server."""
        return getattr(self._link, "world", None)

    @property
    def training(self) -> Training | None:
        """Only with ``url="local"``: options for learners in later runs; can be set."""
        return self._link.training

    @training.setter
    def training(self, training: Training | None) -> None:
        if not self.is_local:
            raise ValueError(NO_TRAINING)
        checked(training)
        self._link.training = training

    @property
    def parameters(self) -> Mapping[str, ArrayLike] | None:
        """Numbers given for the next runs rather than drawn, as of `palmares.sim.World.reset`.

        Only in this process.

        Raises:
            ValueError: Set for a server.

        """
        return self._link.parameters

    @parameters.setter
    def parameters(self, parameters: Mapping[str, ArrayLike] | None) -> None:
        if not self.is_local:
            raise ValueError("parameters: servers do not offer them; use url='local'")
        self._link.parameters = parameters

    @property
    def welcome(self) -> Welcome:
        """The server's greeting: tasks, hands, limits and the specs of actions and observations."""
        return self._link.welcome

    @property
    def competition(self) -> Competition:
        """The competition: its name, mode, the length of a session, the cost of a reset."""
        return self._link.welcome.competition

    @property
    def encoding(self) -> Encoding:
        """Encoding of the messages: ``json`` or ``msgpack``."""
        return self._link.encoding

    @property
    def run(self) -> Opened:
        """Parameters of the current or last run: its seed, length of a tick, time limit, mode."""
        if self._run is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._run

    @property
    def scene(self) -> Scene:
        """The scene of the current or last run."""
        if self._scene is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._scene

    @property
    def tick(self) -> int | None:
        """Ticks since reset, as of the last observation; ``None`` when no run is open."""
        return self._tick

    @property
    def skipped(self) -> int:
        """Observations of the last real-time run that newer ones replaced before they were read."""
        return self._stream.skipped

    def close(self) -> None:
        """End the session. The server stops and scores an open run. A closed client stays closed."""
        self._link.close()
        self._forget_run()

    def __repr__(self) -> str:
        run = "no run" if self._run is None else f"{self._run.task} with {self._run.hand}, tick {self._tick}"
        return f"<Client of {self.welcome.team} at {self._link.where}, {run}>"

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
        """Repeat a request until a reply comes; wait as the server demands, resume a broken session."""
        last: Exception | None = None
        retries = 0
        wanted = request
        while retries < MAX_RETRIES:
            try:
                if self._link.resumed is not None:
                    request = self._check_resumed(wanted)
                if self._steps.behind is not None:
                    self._catch_up()
                return self._link.exchange(request, kind)
            except Resumed:
                continue  # The heartbeat resumed after the check above: check again.
            except RateLimitedError as slower:
                # A refused request has changed nothing: send it again.
                time.sleep(0.1 if slower.retry_after_s is None else slower.retry_after_s)
                last = slower
            except WrongStateError as paused:
                # Only the refusals of a paused session have a time to retry.
                if paused.retry_after_s is None:
                    raise
                LOG.log(logging.DEBUG if last else logging.WARNING, "waiting: %s", paused)
                time.sleep(paused.retry_after_s)
                last = paused
                continue  # The session's clock is stopped, too: wait until the pause ends.
            except CapacityError as full:
                # In a competition the session keeps its place in the queue, and its clock is stopped.
                official = self.competition.mode == "official"
                if full.retry_after_s is None or not (official and isinstance(request, ResetRequest)):
                    raise
                LOG.log(logging.DEBUG if last else logging.WARNING, "waiting: %s", full)
                time.sleep(full.retry_after_s)
                last = full
                continue
            except Closed as lost:
                raise_if_fatal(lost)
                self._link.resume(lost)
                last = lost
            retries += 1
        if isinstance(last, RateLimitedError):
            raise last
        raise ConnectionLostError(f"the connection broke {MAX_RETRIES} times during one request") from last

    def _check_resumed(self, request: Request) -> Request:
        """Return the request to send after a reconnection; the server may have processed `request`."""
        welcome = self._link.take_resumed()
        if welcome is None:
            return request
        run = welcome.run
        if self._run_id is None:
            if run is not None and isinstance(request, ResetRequest):
                # The run was opened, but the reply with its scene was lost: close it and open another.
                self._link.exchange(StopRequest(), Result)
        elif run is None or run.run_id != self._run_id:
            raise self._run_lost()
        elif not run.open and self._newest is not None:
            # The run's last observation was lost: make one.
            closed = structs.replace(self._newest, tick=run.tick, truncated=True, reason="closed", events=[])
            self._stream.put(closed)
        elif run.mode == "lockstep" and self._tick is not None and run.tick != self._tick:
            return self._continued(request, run.tick)
        return request

    def _continued(self, request: Request, tick: int) -> Request:
        """Return the request to send when the run goes on at another tick than the last observation's."""
        if self._tick is not None and tick < self._tick and self._steps.rewind(tick):
            # Another host has continued the run from an earlier tick: the steps since then are sent again.
            return request
        if not isinstance(request, StepRequest):
            return request
        end = request.tick + request.repeat
        if request.tick < tick < end:
            # Another host has continued the run within this step.
            return structs.replace(request, tick=tick, repeat=end - tick)
        # The step was made, but its observation was lost: make one more tick with the same targets.
        return StepRequest(tick=tick, action=Action())

    def _catch_up(self) -> None:
        """Send steps again; drop the observations, which the controller has."""
        while (step := self._steps.next(self.welcome.limits.repeat)) is not None:
            obs = self._link.exchange(step, Observation)
            self._steps.behind = obs.tick
            if obs.done:
                # Only a limit of the session ends the run earlier than before.
                self._steps.behind = None
                self._stream.put(self._named(obs))

    def _run_lost(self) -> RunLostError:
        """Forget a run that the server has closed; return the error with its outcome."""
        run_id = self._run_id or ""
        result = self._unrequested
        if result is None or result.run_id != run_id:
            result = self._link.result_of(run_id)
        self._forget_run()
        return RunLostError.of(run_id, result)

    def _stop_earlier_run(self) -> None:
        """Stop a run that an earlier program of this team left open in the resumed session."""
        left = self.welcome.run
        if left is None or self._run_id is not None:
            return
        LOG.warning(
            "an earlier program left run %s open at tick %d; it is stopped now", left.run_id, left.tick
        )
        self._ask(StopRequest(), Result)
        self.welcome.run = None

    def _named(self, obs: Observation) -> Observation:
        """Set the names of an observation's objects; return it."""
        if obs.truth is not None:
            obs.truth.name_objects(self._names)
        return obs

    def _no_run(self) -> WrongStateError:
        return WrongStateError(CLOSED if self._link.closed else NO_RUN)

    def _forget_run(self) -> None:
        self._tick = self._run_id = self._newest = None
        self._steps.clear()
        self._stream.close()
        self._link.set_realtime(False)

    # --- messages that answer no request ---

    def _receive(self, message: Message) -> None:
        if isinstance(message, Observation):
            self._stream.put(self._named(message))
        elif isinstance(message, Result):
            self._unrequested = message

    def _take(self) -> Observation | None:
        obs = self._stream.take()
        if obs is not None:
            self._newest, self._tick = obs, obs.tick
        return obs

    def _next(self) -> Observation:
        """Wait for an observation newer than the last one."""
        while True:
            try:
                if self._link.resumed is not None:
                    self._check_resumed(StopRequest())
                self._link.listen(LISTEN_S)
            except Closed as lost:
                raise_if_fatal(lost)
                self._link.resume(lost)
            obs = self._take()
            if obs is not None:
                return obs
            if self._link.silence_s() > self._timeout_s:
                raise ConnectionLostError(f"{self._link.where} has been silent for {self._timeout_s:g} s")
