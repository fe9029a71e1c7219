"""Many worlds at once, on all cores."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palmares._native import Batch as NativeBatch
from palmares._native import Snapshot
from palmares._native import welcome as native_welcome
from palmares.arguments import (
    MAX_COUNT,
    MAX_SEED,
    Noise,
    Sensing,
    check_sensing,
    mask_of,
    one_name,
    one_of,
    table,
    whole,
)
from palmares.arrays import Array
from palmares.clipping import Clipping
from palmares.messages import Welcome
from palmares.net.requests import names
from palmares.reproducible import norm
from palmares.sim.in_use import in_use
from palmares.sim.parameters import given_rows
from palmares.sim.pictures import Kind, View, kinds_of, picture_request
from palmares.sim.progress import progress
from palmares.sim.state import STATE, State, named, placed, rows_of_contacts, state_of
from palmares.sim.world import read
from palmares.targets import BaseKind
from palmares.training import Training, checked
from palmares.views import Brief

Arrays: TypeAlias = dict[str, Array]
Mask: TypeAlias = Sequence[bool] | NDArray[np.bool_]

FIELDS = (("linear", slice(0, 3)), ("angular", slice(3, 6)), ("hand", slice(6, None)))
"""Name and columns of each part of an action"""


@dataclass(frozen=True, repr=False)
class Stepped(Brief):
    """Outcome of a step of a `Batch`; every array has one entry for each world."""

    observations: Arrays
    """As in `Batch.observe`"""
    rewards: Array
    """(N,), change of the score in this step; in the last one the objects settle and are counted"""
    terminated: NDArray[np.bool_]
    """(N,), the task is complete"""
    truncated: NDArray[np.bool_]
    """(N,), a limit ended the run, or a fault voided it"""
    shaping: Array | None = None
    """(N,), the shaped part F, which is not in `rewards`; ``None`` without `Training.shaping`"""


class Batch:
    """N worlds of one task and hand, stepped by a pool of native threads.

    A run is the same as that of a `World` with its seed and actions, for any number of threads. Call it from
    one thread at a time: it steps on threads of its own.

    An observation is a dictionary of arrays (N, …) of float64. The last six are only there with
    ``sensing="truth"``, those of sensors only if the hand has them:

    - the channels of the hand, each in its shape: ``base`` (13,), ``motors`` (motors, 4), ``wrist`` (6,),
      ``encoders`` (encoders,), ``touch`` (taxels, 3), ``acceleration`` (3,); docs/senses.md has their columns
      and units
    - ``time_left`` (1,): s until the time limit
    - ``arm`` (2, n): positions (rad or m) and velocities of the joints of the arm, where the task has one
    - ``joints`` (2, joints): position (rad), velocity (rad/s)
    - ``objects`` (objects, 13): as ``base``, for each
    - ``object_kind`` (objects,): 0 sphere, 1 capsule, 2 cylinder, 3 box, 4 hull, 5 several parts
    - ``object_half_extents`` (objects, 3): of the box around it in its own frame, m
    - ``object_mass`` (objects,): kg
    - ``hand_drawn`` (numbers,): as `Batch.hand_drawn`, where `training` draws the hand

    Args:
        task: Name of the task, or the path of your own; as for `World`.
        hand: Name of a hand, or the path of your own; as for `World`.
        count: N, the number of worlds.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``.
        threads: Threads that step; one for each core when left out.
        base: What actions say of the base: ``twist`` for its velocities, ``pose`` for the pose that it moves
            to, ``joints`` for those of the arm where the task has one.
        training: For learners: shaped rewards, and runs that differ from the task's. Rows of missing objects
            are zero, their ``object_kind`` is −1.

    Attributes:
        count: N.
        fields: Shape of each field of an observation, for one world.
        hand_numbers: Names of the hand's uncertain numbers that `training` draws for each run.
        action_len: Length of one world's action.
        tick_s: Length of a tick, s.
        clipping: Warns when the first action is clipped.

    """

    def __init__(
        self,
        task: str,
        hand: str,
        count: int,
        *,
        sensing: Sensing = "truth",
        noise: Noise = "none",
        threads: int | None = None,
        training: Training | None = None,
        base: BaseKind = "twist",
    ) -> None:
        count = whole("count", count, 1, 100_000)
        threads = 0 if threads is None else whole("threads", threads, 1, 1024)
        check_sensing(sensing, noise)
        one_of("base", base, get_args(BaseKind))
        hand = one_name("hand", hand, ": the worlds of a batch have one hand; make a Batch for each hand")
        task = one_name("task", task, ": the worlds of a batch have one task; make a Batch for each task")
        checked(training, task)
        self._made = (task, hand, count, sensing, noise, threads, base)
        self._training = training or Training()
        self._native = NativeBatch(*self._made, training)
        specs = read(native_welcome("", [], []), Welcome).specs
        limits = [specs.action_field(name).range[1] for name in ("base.linear", "base.angular")]
        self._limits = (limits[0] * (1.0 + 1e-9), limits[1] * (1.0 + 1e-9))
        self.clipping = Clipping()
        self._unread: tuple[int, Array, int, list[bool]] | None = None
        self.count = count
        self.fields = {name: tuple(shape) for name, shape in self._native.fields()}
        self.hand_numbers = tuple(self._native.hand_numbers())
        self.action_len = self._native.action_len
        self._base_len = self._native.base_len
        self.tick_s = self._native.tick_s

    def reset(
        self,
        seeds: Sequence[int] | NDArray[np.integer],
        mask: Mask | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> Arrays:
        """Open runs with these scenes, in the worlds of `mask` or in all; return the observations of all.

        Args:
            seeds: (N,), 0 to 2**53 - 1; seeds of other worlds are ignored.
            mask: (N,).
            parameters: Numbers given for these runs rather than drawn, by their names in `Batch.parameters`:
                of objects (N, objects) and of links (N, links), or (N,) for all of a world, gravity (N, 3),
                of the hand (N,). Such runs are for learning, as those with `Training.randomise`.

        Raises:
            ValueError: A seed, the mask or a parameter is invalid; nothing has changed.

        """
        chosen, seeds = self._mask(mask), list(seeds)
        if len(seeds) != self.count:
            raise ValueError(f"seeds: found {len(seeds)}; wanted one for each of {self.count} worlds")
        numbers = [
            whole(f"seeds[{k}]", seed, 0, MAX_SEED) if wanted else 0
            for k, (seed, wanted) in enumerate(zip(seeds, chosen, strict=True))
        ]
        try:
            given = given_rows(parameters, self.count, self._native.objects, self._native.links)
            self._drop_worlds(chosen)
            with progress([*chosen].count(True), "world", "reset") as report:
                self._native.reset(numbers, chosen, report, given)
            return self.observe()
        except RuntimeError as error:
            raise in_use(error, "batch") from None

    @property
    def opened(self) -> bool:
        """Whether every world has a run."""
        return self._native.opened()

    def step(
        self,
        actions: ArrayLike,
        ticks: int = 10,
        mask: Mask | None = None,
        effort: ArrayLike | None = None,
    ) -> Stepped:
        """Advance the worlds of `mask`, or all, by `ticks` under their actions.

        A world whose run is over does not move and has reward 0 until it is reset. Ctrl-C ends the call
        between two ticks; the next one first makes the rest of the step, as `finish` does.

        Args:
            actions: (N, 6 + motors): linear (m/s) and angular (rad/s) velocity of the base, world frame, and
                σ of each motor in [0, 1]; values beyond the limits are clipped. With ``base="pose"``
                (N, 7 + motors): position (m) and quaternion x y z w that the base moves to within its limits;
                with ``base="joints"`` (N, n + motors): positions of the arm's joints, rad or m.
            ticks: At least 1, each of `tick_s`.
            mask: (N,).
            effort: (N, motors): part of its largest force that each motor may use, clipped to [0, 1]; left
                out, the last one of each run holds, and 1 before the first.

        Raises:
            ValueError: A wrong shape, or a number that is not finite; nothing has changed.
            RuntimeError: Another thread is in a call of this batch.

        """
        self.finish()
        ticks = whole("ticks", ticks, 1, MAX_COUNT)
        numbers, chosen = table("actions", actions, self.count, self.action_len), self._mask(mask)
        motors = self.action_len - self._base_len
        try:
            self._warn_if_clipped(numbers)
            if effort is not None:
                numbers = np.hstack([numbers, table("effort", effort, self.count, motors)])
            self._unread = self._native.begun, numbers, ticks, chosen
            return self._complete(*self._unread)
        except RuntimeError as error:
            raise in_use(error, "batch") from None

    def finish(self) -> Stepped | None:
        """Make the rest of a step that Ctrl-C interrupted; return its outcome, ``None`` if there is none."""
        if self._unread is None:
            return None
        try:
            return self._complete(*self._unread)
        except RuntimeError as error:
            raise in_use(error, "batch") from None

    @property
    def unfinished(self) -> int | None:
        """Ticks that an interrupted step still has to make; ``None`` when no step was interrupted."""
        return self._native.unfinished

    def drop_step(self) -> None:
        """Drop the rest of an interrupted step."""
        self._unread = None
        self._native.drop_step()

    def _drop_worlds(self, chosen: list[bool]) -> None:
        """Let an interrupted step not go on in worlds whose state is set."""
        if self._unread is not None:
            before, actions, ticks, mask = self._unread
            mask = [moving and not dropped for moving, dropped in zip(mask, chosen, strict=True)]
            self._unread = before, actions, ticks, mask

    def _complete(self, before: int, actions: Array, ticks: int, mask: list[bool]) -> Stepped:
        """Make a step, or what is missing of it; `before` is the number of steps begun before it."""
        try:
            with progress(ticks, "tick", "step") as report:
                if self._native.begun == before:
                    self._native.step(actions, ticks, mask, report)
                else:
                    self._native.finish(report)
        except (ValueError, RuntimeError):
            self._unread = None  # Refused.
            raise
        rewards, _, terminated, truncated = self._native.progress()
        stepped = Stepped(self.observe(), rewards, terminated, truncated, self._native.shaping())
        self._unread = None
        return stepped

    def _warn_if_clipped(self, actions: Array) -> None:
        """Warn if this is the first action beyond the limits."""
        if self.clipping.is_muted:
            return
        clipped = self._native.clipped(actions, self._limits)
        if clipped is not None:
            world, place = clipped
            field, columns = FIELDS[place]
            if field == "hand":
                columns = slice(self._base_len, None)
            if self.clipping.has_warned(field):
                return
            wanted = actions[world, columns]
            limit = None if field == "hand" else self._limits[place]
            was = wanted.clip(0.0, 1.0) if limit is None else wanted * limit / norm(wanted)
            where = f"actions[{world}]: "
            self.clipping.warn(field, wanted.tolist(), was.tolist(), 3, where)

    def observe(self) -> Arrays:
        """Return the observations: an array (N, …) of each field."""
        return self._native.observe()

    @property
    def potential(self) -> Arrays | None:
        """The terms of the potential, each (N,); see `World.potential`."""
        return self._native.potential()

    @property
    def hand_drawn(self) -> Array:
        """(N, numbers), the drawn numbers of each world's hand, in the order of `hand_numbers`.

        Each is a factor of the hand's own number, or the number itself, as ``[uncertain]`` of its
        ``hand.toml`` says. They are for a critic: the readings of sensors do not contain them.
        """
        return self._native.hand_drawn().reshape(self.count, len(self.hand_numbers))

    @property
    def parameters(self) -> Arrays:
        """The numbers in effect in each world, drawn, given or the task's own.

        ``mass``, ``friction``, ``size`` (N, objects): factors of what the task's objects have;
        ``link_mass`` (N, links): factors of mass and inertia of the hand's links; ``gravity`` (N, 3): m/s²;
        ``sensor_noise`` (N,): factor of the sensors' errors; ``hand_NAME`` (N,) for each number in
        ``[uncertain]`` of the hand: a factor, or the number itself, NaN where it is the hand's own.
        """
        return self._native.parameters()

    def push(
        self,
        link: str,
        force: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        duration_s: float = 0.1,
        mask: Mask | None = None,
    ) -> None:
        """Push a link of the hands in the worlds of `mask`, or in all, from the next tick on.

        Args:
            link: Name of the link.
            force: (N, 3), N, at the link's origin, world frame; zero when left out.
            torque: (N, 3), N·m; zero when left out.
            duration_s: Rounded up to whole ticks, at most 60.
            mask: (N,).

        Raises:
            ValueError: There is no such link, a wrong shape, or a number out of bounds; nothing has changed.

        """
        wrenches = self._wrenches(force, torque)
        self._native.push(link, *wrenches, float(duration_s), self._mask(mask))

    def push_object(
        self,
        index: int,
        force: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        duration_s: float = 0.1,
        mask: Mask | None = None,
    ) -> None:
        """Push an object in the worlds of `mask`, or in all, from the next tick on.

        An impulse J, N·s, is the force J / `duration_s`. The runs are then for learning: their status is
        ``training``. Runs that are over stay as they are.

        Args:
            index: Row of the object in ``objects``.
            force: (N, 3), N, at the object's centre of mass, world frame; zero when left out. At most 200.
            torque: (N, 3), N·m; zero when left out. At most 20.
            duration_s: Rounded up to whole ticks, at most 60.
            mask: (N,).

        Raises:
            ValueError: A world has no such object, a wrong shape, or a number out of bounds; nothing has
                changed.

        """
        index = whole("index", index, 0, max(0, self._native.objects - 1))
        wrenches = self._wrenches(force, torque)
        self._native.push_object(index, *wrenches, float(duration_s), self._mask(mask))

    def _wrenches(self, force: ArrayLike | None, torque: ArrayLike | None) -> tuple[Array, Array]:
        """Return forces and torques (N, 3)."""
        zero = np.zeros((self.count, 3))
        forces = zero if force is None else table("force", force, self.count, 3)
        return forces, zero if torque is None else table("torque", torque, self.count, 3)

    @property
    def training(self) -> Training:
        """Options for learners."""
        return self._training

    @property
    def fraction(self) -> float:
        """Part of the task's objects in the scene; a new value holds for later resets."""
        return self._training.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self._training = replace(self._training, fraction=fraction)
        self._native.set_fraction(fraction)

    @property
    def scores(self) -> Array:
        """(N,), score of each run if it ended now; the final score of a run that is over."""
        return self._native.progress()[1]

    @property
    def done(self) -> NDArray[np.bool_]:
        """(N,), True for runs that are over."""
        _, _, terminated, truncated = self._native.progress()
        return terminated | truncated

    @property
    def seeds(self) -> list[int]:
        """Seeds of the worlds."""
        return self._native.seeds()

    @property
    def ticks(self) -> list[int]:
        """Ticks of each run since its reset."""
        return self._native.ticks()

    @property
    def threads(self) -> int:
        """Threads that step."""
        return self._native.threads

    @property
    def physics_s(self) -> float:
        """Time that all threads together have spent in physics and referee, s; for benchmarks."""
        return self._native.physics_s

    def state_hashes(self) -> list[str]:
        """Return the digest of each state, 16 hexadecimal digits."""
        return self._native.state_hashes()

    def events(self, world: int) -> list[tuple[int, str, int | None]]:
        """Return the referee's events of a world in its last step: tick, kind, object."""
        return self._native.events(self._world(world))

    def result(self, world: int) -> dict[str, Any] | None:
        """Return the final count of a world whose run is over: status, score, in_goal, outside, reason.

        Status: ``practice``, ``voided`` after a fault, ``training`` when `training` made the run differ from
        the task's. After a fault ``fault`` is its code, as in `palmares.WorldFaultError`, and ``note`` has
        its time, meaning and remedies; otherwise both are ``None``.
        """
        return self._native.result(self._world(world))

    def snapshot(self, world: int) -> Snapshot:
        """Return the state of a world; see `World.snapshot`."""
        return self._native.snapshot(self._world(world))

    def state(self) -> State:
        """Return poses, velocities and tensions as arrays (N, …); see `World.state`.

        ``memory`` is ``None``: a learner who goes back bit for bit keeps `snapshot` of its worlds.
        """
        return state_of(self._native.arrays(list(STATE)), None)

    def set_state(
        self,
        state: State | None = None,
        mask: Mask | None = None,
        *,
        base: ArrayLike | None = None,
        q: ArrayLike | None = None,
        joint_velocity: ArrayLike | None = None,
        motors: ArrayLike | None = None,
        objects: ArrayLike | None = None,
    ) -> Arrays:
        """Put parts of the worlds of `mask`, or of all, elsewhere; see `World.set_state`.

        Args:
            state: Arrays of all parts, with a first axis (N, …).
            mask: (N,).
            base: (N, 13)
            q: (N, joints)
            joint_velocity: (N, joints)
            motors: (N, motors, 2)
            objects: (N, objects, 13); rows of objects that a run lacks are ignored.

        Raises:
            ValueError: As `World.set_state`; nothing has changed.

        """
        parts = {
            "base": base,
            "q": q,
            "joint_velocity": joint_velocity,
            "motors": motors,
            "objects": objects,
        }
        self._drop_worlds(self._mask(mask))
        self._native.place(placed(state, parts, self._shapes()), self._mask(mask))
        return self.observe()

    def mechanics(self, *names: str) -> Arrays:
        """Return what follows from the states, arrays (N, …); see `World.mechanics`."""
        return self._native.arrays(named(names))

    def contacts(self, most: int = 64) -> dict[str, NDArray[Any]]:
        """Return the contacts of the last steps, arrays (N, …); see `World.contacts`."""
        return self._native.contacts(rows_of_contacts(most))

    def pictures(
        self,
        camera: str | View,
        size: tuple[int, int] | None = None,
        kinds: Sequence[Kind] | Kind = "depth",
    ) -> dict[str, NDArray[Any]]:
        """Draw all worlds on the pool: an array (N, height, width) of each kind.

        Those of ``rgb`` and ``film`` are (N, height, width, 3). The arrays are contiguous; torch and jax
        take them without a copy. The arguments are those of `World.pictures`; ``film`` is that of the first
        world.
        """
        return self._native.pictures(picture_request(camera, size), kinds_of(kinds))

    def depths(self, cameras: Iterable[str]) -> Arrays:
        """Return the newest depth images of cameras of task or hand: an array (N, height, width) of each, m.

        They are those of ``World.observe``, with the errors and the latency of real cameras where `noise` is
        ``real``; 0 where there is no reading. `pictures` draws faster, of any size.

        Raises:
            ValueError: There is no such camera.

        """
        return self._native.depths(names(cameras))

    def _shapes(self) -> dict[str, tuple[int, ...]]:
        return {name: array.shape for name, array in self._native.arrays(list(STATE)).items()}

    def restore(self, world: int, snapshot: Snapshot | bytes) -> None:
        """Set a world to a snapshot of the same task, hand and noise.

        With a snapshot of another seed the world becomes a run of that seed. A batch with `Training.step_ms`
        also takes snapshots of runs with the task's own steps, if all other options are equal, and continues
        with its longer ones.
        """
        if isinstance(snapshot, bytes | bytearray | memoryview):
            snapshot = Snapshot(bytes(snapshot))
        self._drop_worlds([k == world for k in range(self.count)])
        self._native.restore(self._world(world), snapshot)

    def __getstate__(self) -> dict[str, Any]:
        """Return the batch for pickle: its worlds continue in another process, without their `result`."""
        self.finish()
        opened = [tick > 0 or self.opened for tick in self.ticks]
        kept = [bytes(self.snapshot(k)) if there else None for k, there in enumerate(opened)]
        return self.__dict__ | {"_native": kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue a pickled batch."""
        self.__dict__.update(state)
        self._native = NativeBatch(*self._made, self._training)
        for world, kept in enumerate(state["_native"]):
            if kept is not None:
                self.restore(world, kept)

    def __repr__(self) -> str:
        return f"<Batch of {self.count} worlds on {self.threads} threads>"

    def _world(self, world: int) -> int:
        return whole("world", world, 0, self.count - 1)

    def _mask(self, mask: Mask | None) -> list[bool]:
        return [True] * self.count if mask is None else mask_of("mask", mask, self.count).tolist()
