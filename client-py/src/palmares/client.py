"""The client: one session with the server, one request at a time."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Iterator, Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from msgspec import structs
from numpy.typing import ArrayLike

from palmares import own_task
from palmares.arguments import MAX_SEED, Noise, Sensing
from palmares.clipping import Clipping
from palmares.errors import WrongStateError
from palmares.messages import Observation, Result, Welcome
from palmares.net.address import addresses
from palmares.net.codec import Encoding
from palmares.net.link import CLOSED, Link
from palmares.net.requests import names, whole_of
from palmares.net.session import Session
from palmares.scene import Scene
from palmares.targets import Base, Hand, Numbers, action_of, vector
from palmares.training import Training, checked
from palmares.version import VERSION
from palmares.wire import (
    Ack,
    ActRequest,
    Competition,
    HelloRequest,
    LeaderboardRow,
    Opened,
    PerturbRequest,
    PushWrench,
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
LOCKSTEP = (
    "wrong_state: this run waits for `step`, which returns the observation; `observations` is for runs in "
    "mode `realtime`: reset(…, mode='realtime')"
)
NO_TRAINING = "training: servers do not offer it; use url='local'"


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
        self.clipping = Clipping()
        self._session = Session(timeout_s)
        if url == LOCAL:
            from palmares.sim.local import LocalLink

            checked(training)
            self._session.link = LocalLink(team, training)
            return
        if training is not None:
            raise ValueError(NO_TRAINING)
        server = addresses(url)
        self._session.link = Link(
            server.http,
            server.control,
            HelloRequest(client={"name": team, "version": VERSION}, session_s=session_s),
            token=token if token is not None else os.environ.get("PALMARES_TOKEN") or None,
            encoding=encoding,
            timeout_s=timeout_s,
            reconnect_s=reconnect_s,
            on_message=self._session.receive,
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
        sensing: Sensing = "truth",
        noise: Noise | None = None,
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
        interrupted = self._session.finish()
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
        if interrupted is not None and isinstance(interrupted[0], ResetRequest):
            opened, first = interrupted
            if isinstance(first, Observation) and opened == structs.replace(request, id=opened.id):
                self.clipping.begin()
                return first
            self._session.ask(StopRequest(), Result)  # Nobody has seen this run.
        obs = self._session.ask(request, Observation)
        self.clipping.begin()
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
        interrupted = self._session.finish()
        if self._session.tick is None:
            raise self._no_run()
        action = action_of(base, hand, self._session.motors, effort)
        repeat = whole_of("repeat", repeat, 1, self.welcome.limits.repeat)
        if interrupted is not None and isinstance(interrupted[1], Observation) and interrupted[1].done:
            return interrupted[1]  # The run ended with the step that was interrupted.
        request = StepRequest(tick=self._session.tick, action=action, repeat=repeat, cameras=names(cameras))
        obs = self._session.ask(request, Observation)
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
        if self._session.tick is None:
            raise self._no_run()
        try:
            action = action_of(base, hand, self._session.motors, effort)
            tick = self._session.ask(ActRequest(action=action, cameras=names(cameras)), Ack).tick
            self.clipping.request(action, tick, self.welcome.limits.hold_ticks)
            return tick
        except WrongStateError:
            # The run ended meanwhile; its last observation is not read yet.
            if self._session.stream.over:
                return self._session.tick
            raise

    def observations(self) -> Iterator[Observation]:
        """Yield the observations of a real-time run until it is over.

        Each is the newest one. A controller that is slower than real time does not fall behind: it misses
        observations, which `skipped` counts; their events come with the next one. When the world fails, the
        last observation is truncated with the reason ``world_fault``; `Result.fault` of `stop` is the cause.

        """
        if self._session.tick is None:
            raise self._no_run()
        if not self._session.realtime:
            raise WrongStateError(LOCKSTEP)
        return self._streamed()

    def _streamed(self) -> Iterator[Observation]:
        while self._session.run_id is not None:
            self._session.finish()
            self._session.check_caller()
            obs = self._session.next_streamed()
            self.clipping.compare(obs.applied_action, obs.tick, stacklevel=2)
            yield obs
            if obs.done:
                return

    def latest(self) -> Observation:
        """Return the newest observation at once; the last one again if none came since.

        In lockstep this is the observation of the last step. If Ctrl-C interrupted that step, it is made to
        its end first.
        """
        self._session.finish()
        self._session.check_caller()
        if self._session.newest is None:
            raise self._no_run()
        if not self._session.realtime:
            return self._session.newest
        return self._session.listen(0.0) or self._session.newest

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
        return self._session.ask(PerturbRequest(link=link, wrench=wrench, duration_s=duration_s), Ack).tick

    def stop(self) -> Result:
        """Close the run; the objects settle and are counted. Return the result."""
        interrupted = self._session.finish()
        if interrupted is not None and isinstance(interrupted[1], Result):
            return interrupted[1]
        return self._session.ask(StopRequest(), Result)

    def abandon(self) -> None:
        """Close the run without a result; in this process nothing settles and nothing is counted."""
        if self.is_local:
            self._session.check_caller()
            self._session.drop_unread()
            self._link.abandon()
            self._session.forget_run()
        else:
            self.stop()

    def time(self) -> Time:
        """Return the session's clock."""
        return self._session.ask(TimeRequest(), Time)

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
        if self.result is None:
            raise WrongStateError("wrong_state: no run was stopped yet; call stop() first")
        self._link.save_replay(self.result.run_id, path)

    @property
    def result(self) -> Result | None:
        """Result of the last `stop`."""
        return self._session.result

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
        if self._session.run is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._session.run

    @property
    def scene(self) -> Scene:
        """The scene of the current or last run."""
        if self._session.scene is None:
            raise WrongStateError("wrong_state: no run was opened yet; call reset(…) first")
        return self._session.scene

    @property
    def tick(self) -> int | None:
        """Ticks since reset, as of the last observation; ``None`` when no run is open."""
        return self._session.tick

    @property
    def skipped(self) -> int:
        """Observations of the last real-time run that newer ones replaced before they were read."""
        return self._session.stream.skipped

    def close(self) -> None:
        """End the session. The server stops and scores an open run. A closed client stays closed.

        In a forked process this does nothing: the session is its parent's.
        """
        if self._session.forked:
            return
        self._session.drop_unread()
        self._link.close()
        self._session.forget_run()

    def __repr__(self) -> str:
        opened = self._session.run
        run = "no run" if opened is None else f"{opened.task} with {opened.hand}, tick {self.tick}"
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

    @property
    def _link(self) -> Link:
        return self._session.link

    def _stop_earlier_run(self) -> None:
        """Stop a run that an earlier program of this team left open in the resumed session."""
        left = self.welcome.run
        if left is None or self._session.run_id is not None:
            return
        LOG.warning(
            "an earlier program left run %s open at tick %d; it is stopped now", left.run_id, left.tick
        )
        self._session.ask(StopRequest(), Result)
        self.welcome.run = None

    def _no_run(self) -> WrongStateError:
        return WrongStateError(CLOSED if self._link.closed else NO_RUN)
