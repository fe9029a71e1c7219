"""One world in this process."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palmares._native import Snapshot, welcome
from palmares._native import World as NativeWorld
from palmares.arguments import MAX_COUNT, MAX_SEED, Noise, Sensing, check_sensing, one_name, short, whole
from palmares.clipping import Clipping
from palmares.errors import InUseError, PalmaresError, ProtocolError, WrongStateError, error_of
from palmares.messages import Observation, Result, Welcome
from palmares.net.codec import CODECS, with_channels
from palmares.net.requests import names, whole_of
from palmares.png import png
from palmares.scene import Scene
from palmares.sim.in_use import in_use
from palmares.sim.parameters import given_rows, same_rows
from palmares.sim.pictures import FILM, Kind, View, kinds_of, picture_request
from palmares.sim.progress import progress
from palmares.sim.state import STATE, Arrays, State, named, placed, rows_of_contacts, state_of
from palmares.targets import Base, Hand, Numbers, action_of, vector
from palmares.training import Training, checked
from palmares.wire import (
    Ack,
    ErrorMessage,
    Opened,
    PerturbRequest,
    PushWrench,
    Reply,
    Request,
    StepRequest,
    StopRequest,
)

Answer = TypeVar("Answer", bound=Reply)

CODEC = CODECS["msgpack"]
_GREETING = CODEC.message(welcome("", [], []))
if isinstance(_GREETING, Welcome):
    CODEC = with_channels(CODEC, _GREETING.specs)


class World:
    """One run of a task, stepped in this process with the interpreter's lock released.

    Observations, actions and scores are those of a lockstep run of `palmares.Client`, with the same types.
    Use it from one thread at a time. Ctrl-C ends a long call of `step` between two ticks; the next call of
    `step` or `result` first makes the rest of that step, so that no tick is lost. `unfinished` counts these
    ticks, `drop_step` drops them.

    Args:
        task: Name of the task, one of `palmares.sim.TASKS`, or the path of your own: a folder with a
            ``task.toml``.
        hand: Name of a hand, one of `palmares.sim.HANDS`, or the path of your own: a folder, an archive or a
            URDF.
        seed: Selects the scene, 0 to 2**53 - 1; the same scene as on a practice server.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` for sensors without errors, ``real`` for the errors of real ones.
        cameras: Cameras that return an image of tick 0, as in `step`.
        training: For learners: shaped rewards, and runs that differ from the task's.

    Raises:
        ValueError: The task, hand or camera does not exist, the task does not declare an option of
            `training`, or the hand does not fit at its start.

    """

    _native: NativeWorld
    _unread: tuple[Request, type[Reply]] | None
    """The request whose reply was not read"""

    def __init__(
        self,
        task: str,
        hand: str,
        seed: int = 0,
        *,
        sensing: Sensing = "truth",
        noise: Noise = "none",
        cameras: Iterable[str] = (),
        training: Training | None = None,
    ) -> None:
        check_sensing(sensing, noise)
        self._task, self._hand = one_name("task", task), one_name("hand", hand)
        checked(training, self._task)
        self._sensing: Sensing = sensing
        self._noise: Noise = noise
        self._training = training
        self._clipping = Clipping()
        if training is not None and training.changes_actions:
            self._clipping.mute()  # What arrives differs from what was sent.
        self._seed = whole("seed", seed, 0, MAX_SEED)
        self._requests = 0
        self.reset(cameras=cameras)

    def reset(
        self,
        seed: int | None = None,
        cameras: Iterable[str] = (),
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> Observation:
        """Open another run, in another scene if `seed` is given; return the observation of tick 0.

        Args:
            seed: Left out, the seed stays.
            cameras: As for the world.
            parameters: Numbers given for this run rather than drawn, by their names in `World.parameters`: of
                objects (objects,) and of links (links,), or one number for all, gravity (3,), of the hand a
                number. Such a run is for learning, as one with `Training.randomise`.

        Raises:
            ValueError: `seed` is no seed, or a parameter has no such name, shape or value; nothing has
                changed.
            UnknownCameraError: A camera does not exist; nothing has changed.

        """
        seed = self._seed if seed is None else whole("seed", seed, 0, MAX_SEED)
        rows = {name: np.asarray(given)[np.newaxis] for name, given in (parameters or {}).items()}
        given = given_rows(rows, 1, self._native.objects, self._native.links) if rows else None
        native = NativeWorld(self._task, self._hand, seed, self._sensing, self._noise, self._training, given)
        obs = read(native.opened(names(cameras)), Observation)
        if obs.run is None or obs.scene is None:
            raise ProtocolError("the first observation has no scene")
        self._native, self._seed, self._given, self._unread = native, seed, given, None
        self._clipping.begin()
        self._run, self._scene, self._run_id = obs.run, obs.scene, obs.run_id
        self._names = [body.name for body in obs.scene.free]
        self._motors = len(obs.hand.actuators)
        return self._named(obs)

    def step(
        self,
        base: Base | None = None,
        hand: Hand | None = None,
        repeat: int = 1,
        cameras: Iterable[str] = (),
        effort: Hand | None = None,
    ) -> Observation:
        """Advance the world by `repeat` ticks under one action; return the observation after them.

        The arguments are those of `palmares.Client.step`; `repeat` may be any number, where a server
        and `Client("local")` take up to `Limits.repeat`.

        Raises:
            BadActionError: `base`, `hand` or `effort` has a wrong shape or is not finite; nothing changed.
            WrongStateError: The run is over.
            WorldFaultError: The world failed; `fault` is the cause.

        """
        interrupted = self.finish()
        if interrupted is not None and interrupted.done:
            return interrupted
        request = StepRequest(
            tick=self.tick,
            action=action_of(base, hand, self._motors, effort),
            repeat=whole_of("repeat", repeat, 1, MAX_COUNT),
            cameras=names(cameras),
        )
        try:
            obs = self._named(self.ask(request, Observation))
        except WrongStateError as over:
            raise WrongStateError(f"{over}; result() returns its count, reset() opens another run") from None
        self._clipping.request(request.action)
        self._clipping.compare(obs.applied_action, obs.tick, stacklevel=2)
        return obs

    def observe(self, sensing: Sensing | None = None, cameras: Iterable[str] = ()) -> Observation:
        """Return the observation of this tick, with the world's sensing or another; nothing changes."""
        raw = self._native.observe(sensing or self._sensing, names(cameras))
        return self._named(read(raw, Observation))

    def finish(self) -> Observation | None:
        """Make the rest of a step that Ctrl-C interrupted; return its observation.

        ``None`` if no step was interrupted.
        """
        if self._unread is None:
            return None
        reply = self.ask(*self._unread)
        return self._named(reply) if isinstance(reply, Observation) else None

    @property
    def unfinished(self) -> int | None:
        """Ticks that an interrupted step still has to make; ``None`` when no step was interrupted."""
        return self._native.unfinished

    def drop_step(self) -> None:
        """Drop the rest of an interrupted step."""
        self._unread = None
        self._native.drop_step()

    @property
    def parameters(self) -> Arrays:
        """The numbers in effect, as `Batch.parameters`, without their first axis."""
        return {name: row[0] for name, row in self._native.parameters().items()}

    def perturb(
        self,
        link: str,
        force: Numbers = (0.0, 0.0, 0.0),
        torque: Numbers = (0.0, 0.0, 0.0),
        duration_s: float = 0.1,
    ) -> int:
        """Push a link of the hand; return the tick of its begin. See `palmares.Client.perturb`."""
        wrench = PushWrench(force=vector("force", force), torque=vector("torque", torque))
        self.finish()
        return self.ask(PerturbRequest(link=link, wrench=wrench, duration_s=duration_s), Ack).tick

    def push_object(
        self,
        index: int,
        force: Numbers = (0.0, 0.0, 0.0),
        torque: Numbers = (0.0, 0.0, 0.0),
        duration_s: float = 0.1,
    ) -> None:
        """Push an object from the next tick on; as `Batch.push_object`. The run has no replay from then on.

        Raises:
            ValueError: There is no such object, or a number is out of bounds.

        """
        index = whole("index", index, 0, max(0, self._native.objects - 1))
        self.finish()
        self._native.push_object(index, vector("force", force), vector("torque", torque), float(duration_s))

    def result(self) -> Result:
        """End the run: the objects settle and are counted. Later calls return the same result."""
        self.finish()
        return self.ask(StopRequest(), Result)

    def snapshot(self) -> Snapshot:
        """Return the state of the world after this tick; this takes microseconds.

        ``bytes(snapshot)``, some kilobytes, is for another process or machine with the same version of this
        package. `palmares.sim.Snapshot` reads it. It detects damage, but not forgery: take snapshots only
        from sources that you trust.
        """
        return self._native.snapshot()

    def restore(self, snapshot: Snapshot | bytes) -> Observation:
        """Go back to a snapshot of this world, or of another of the same task, hand and noise.

        The world then continues bit for bit as the original did; with a snapshot of another seed, in that
        seed's scene. A world with `Training.step_ms` also takes a snapshot of the same run with the task's
        own steps, and continues with its longer ones. Return the observation of that tick.

        Raises:
            ValueError: The snapshot is of another task or hand, or of another version of the package.
            TypeError: It is something else.

        """
        if isinstance(snapshot, bytes | bytearray | memoryview):
            snapshot = Snapshot(bytes(snapshot))
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"snapshot: found {short(snapshot)}; wanted a Snapshot or its bytes")
        if snapshot.seed != self._seed or not same_rows(snapshot.parameters, self._given):
            rows = snapshot.parameters or {}
            self.reset(snapshot.seed, parameters={name: row[0] for name, row in rows.items()})
        self._unread = None
        self._native.restore(snapshot)
        return self.observe()

    def state(self) -> State:
        """Return poses, velocities and tensions as arrays, with everything else in `State.memory`."""
        return state_of(self._native.arrays(list(STATE)), self.snapshot())

    def set_state(
        self,
        state: State | None = None,
        *,
        base: ArrayLike | None = None,
        q: ArrayLike | None = None,
        joint_velocity: ArrayLike | None = None,
        motors: ArrayLike | None = None,
        objects: ArrayLike | None = None,
    ) -> Observation:
        """Continue from a state of this world or another, and put parts elsewhere; return the observation.

        A state that `state` returned continues bit for bit. What differs from its ``memory``, or is given by
        name, is put elsewhere: every object wakes, and the target of a moved base is where it is. Bodies may
        overlap; the next steps push them apart. Such a run is for learning: it has no replay, and its result
        has the status ``training``.

        Args:
            state: Of the same task, hand and noise; left out, the present one.
            base: (13,), as `State.base`.
            q: (joints,)
            joint_velocity: (joints,)
            motors: (motors, 2)
            objects: (objects, 13)

        Raises:
            ValueError: A wrong shape, a number that is not finite or out of bounds, a quaternion of length 0,
                or a state of another task or hand.

        """
        if state is not None and state.memory is not None:
            self.restore(state.memory)
        parts = {
            "base": base,
            "q": q,
            "joint_velocity": joint_velocity,
            "motors": motors,
            "objects": objects,
        }
        self.drop_step()
        self._native.place(placed(state, parts, self._shapes()))
        return self.observe()

    def mechanics(self, *names: str) -> Arrays:
        """Return what follows from the state, in world axes; all of it, or the named quantities.

        A velocity of the hand is the linear velocity of the base's origin, its angular velocity, q̇: n = 6 +
        joints numbers. It obeys ``M v̇ + c = Jᵀ f + …``.

        - ``links`` (links, 7): position (m) and quaternion x y z w of each link, in the order of
          `palmares.analysis.Hand.links`
        - ``link_velocities`` (links, 6): linear (m/s), of the link's origin, and angular (rad/s)
        - ``jacobians`` (links, 6, n): of the link's origin: ``link_velocities = jacobians @ v``
        - ``fingertips`` (fingers, 7), ``fingertip_jacobians`` (fingers, 6, n): the same of each finger's last
          link
        - ``mass_matrix`` (n, n): M
        - ``bias`` (n,): c, Coriolis and centrifugal forces, and gravity if the hand does not compensate its
          own weight
        - ``moment_arms`` (tendons, joints): R(q)

        Raises:
            ValueError: There is no such quantity.

        """
        return self._native.arrays(named(names))

    def contacts(self, most: int = 64) -> dict[str, NDArray[Any]]:
        """Return the contacts of the last step in arrays of `most` rows.

        - ``count`` (): their number; where it is larger than `most`, those with the largest forces are kept
        - ``mask`` (most,): which rows are contacts
        - ``bodies`` (most, 2): −1 furniture; the hand's links from 0 on, then the free objects
        - ``position`` (most, 3), m; ``normal`` (most, 3) from the first body to the second
        - ``force``, ``torque`` (most, 3): on the second body, N and N·m, the torque about the normal
        - ``gap`` (most,): m at the step's begin, negative where they overlap

        """
        return self._native.contacts(rows_of_contacts(most))

    def pictures(
        self,
        camera: str | View,
        size: tuple[int, int] | None = None,
        kinds: Sequence[Kind] | Kind = "depth",
    ) -> dict[str, NDArray[Any]]:
        """Draw the present world: an array (height, width) of each kind, of colours (height, width, 3).

        Args:
            camera: Name of a camera of task or hand, whose field of view stays; ``film``, a place from which
                fingers and objects are seen, the same at every tick; or a `View` of your own. It has no
                errors and no latency; `observe` and ``gymnasium.make`` give the images of real cameras.
            size: Width and height; those of the named camera, 640 × 480 of ``film``, 320 × 240 of a `View`.
            kinds: What is wanted: ``depth`` float32, m, 0 where there is none; ``depth_mm`` uint16, mm;
                ``rgb`` uint8, lit from the camera; ``bodies`` uint16, ids of the scene's bodies, then the
                hand's links, 65535 for none; ``film`` uint8, colours for people, with shadows and smooth
                edges, which takes about ten times as long.

        Raises:
            ValueError: There is no such camera or kind, or a size is out of bounds.

        """
        return self._native.pictures(picture_request(camera, size), kinds_of(kinds))

    def _shapes(self) -> dict[str, tuple[int, ...]]:
        return {name: array.shape for name, array in self._native.arrays(list(STATE)).items()}

    def fork(self) -> Self:
        """Return a copy of the world that continues on its own."""
        fork = type(self).__new__(type(self))
        fork.__dict__.update(self.__dict__)
        fork._native = self._native.fork()
        return fork

    def __copy__(self) -> Self:
        """Return a `fork`."""
        return self.fork()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return a `fork`."""
        return self.fork()

    def __getstate__(self) -> dict[str, Any]:
        """Return the world for pickle: it continues in another process, without the ticks of its replay."""
        self.finish()
        return self.__dict__ | {"_native": bytes(self.snapshot())}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue a pickled world."""
        self.__dict__.update(state)
        kept = Snapshot(state["_native"])
        self._native = NativeWorld(
            self._task, self._hand, kept.seed, self._sensing, self._noise, self._training, kept.parameters
        )
        self._native.restore(kept)

    def held(self, object: str) -> dict[str, Any]:  # noqa: A002
        """Return the contacts of the hand with an object in the last step, for `palmares.analysis.held`.

        Raises:
            ValueError: There is no such object.

        """
        if object not in self._names:
            raise ValueError(f"object: found {object!r}; wanted one of {', '.join(self._names)}")
        return self._native.held(self._names.index(object))

    def state_hash(self) -> str:
        """Return the digest of the state, 16 hexadecimal digits: equal if and only if the bits are."""
        return self._native.state_hash()

    def save_replay(self, path: str | os.PathLike[str], team: str = "palmares-py") -> None:
        """Write the run up to this tick as a replay, for ``palmares verify`` and the pages.

        A new key signs it: this proves that the file is unchanged, but not its author. The run is played once
        more to record it; an open run counts as stopped here.

        Raises:
            ValueError: The world was restored from bytes, which lack the ticks before; or the files of your
                own hand have changed since, or `training` made the run differ from the task's.
            OSError: The file cannot be written.

        """
        with progress(self.tick, "tick", "replay") as report:
            self._native.save_replay(os.fspath(path), team, self._hand, report)

    @property
    def tick(self) -> int:
        """Ticks since reset."""
        return self._native.tick

    @property
    def score(self) -> float:
        """Score if the run ended now; the final score after `result`."""
        return self._native.score

    @property
    def shaping(self) -> float | None:
        """The shaped part F of the last step's reward; ``None`` without `Training.shaping`."""
        return self._native.shaping

    @property
    def potential(self) -> dict[str, float] | None:
        """The terms of the potential Φ, their sum, in points. ``None`` without `Training.shaping`.

        ``distance``, ``contact``, ``lift`` and ``transport`` are terms of the most advanced object,
        ``brought`` is the term of the objects in the goal.
        """
        return self._native.potential

    @property
    def hand_drawn(self) -> dict[str, float]:
        """The hand's uncertain numbers that `training` drew for this run, by name; see `Batch.hand_drawn`."""
        return dict(self._native.hand_drawn)

    @property
    def varied(self) -> bool:
        """Whether `training` made the run differ from the task's; then it has no replay."""
        return self._native.varied

    @property
    def hand(self) -> str:
        """Name of the hand, or the path of your own."""
        return self._hand

    @property
    def run_id(self) -> str:
        """Name of the run, also in its replay."""
        return self._run_id

    @property
    def run(self) -> Opened:
        """Parameters of the run: task, hand, seed, length of a tick, time limit."""
        return self._run

    @property
    def scene(self) -> Scene:
        """The bodies and regions at tick 0."""
        return self._scene

    def _repr_png_(self) -> bytes:
        """Return a picture of the present world for a notebook."""
        return png(self.pictures(FILM, (480, 360), "film")["film"])

    def __repr__(self) -> str:
        varied = ", randomised" if self.varied else ""
        return f"<World {self._run.task} with {self._run.hand}, seed {self._seed}{varied}, tick {self.tick}>"

    def ask(self, request: Request, kind: type[Answer]) -> Answer:
        """Handle a request of the protocol (``step``, ``perturb`` or ``stop``); return the reply."""
        if request.id == 0:  # A repeated one keeps its id, and gets the same reply.
            self._requests += 1
            request.id = self._requests
        ticks = request.repeat if isinstance(request, StepRequest) else 0
        raw, self._unread = CODEC.encode(request), (request, kind)
        try:
            with progress(ticks, "tick", "step") as report:
                answer = read(self._native.answer(raw, report), kind)
        except PalmaresError:
            self._unread = None
            raise
        except RuntimeError as error:
            refused = in_use(error, "world")
            if isinstance(refused, InUseError):
                self._unread = None
            raise refused from None
        self._unread = None
        return answer

    def _named(self, obs: Observation) -> Observation:
        if obs.has_truth:
            obs.truth.name_objects(self._names)
        return obs


def read(raw: bytes, kind: type[Answer]) -> Answer:
    """Decode a message of the compiled part; raise the error if it is one."""
    message = CODEC.message(raw)
    if isinstance(message, ErrorMessage):
        raise error_of(message.code, message.message, fatal=message.fatal, fault=message.fault)
    if not isinstance(message, kind):
        raise ProtocolError(f"expected {kind.__name__}, not {message}")
    return message
