"""Recorded states from which episodes start."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palmares.arguments import Noise, short
from palmares.arrays import Array
from palmares.sim import Batch, Snapshot, State
from palmares.training import Training

Recorded: TypeAlias = State | Snapshot
"""A state of `palmares.sim.World.state`, or a snapshot"""

_STREAM = 0x7374617274
_PLACED = ("base", "q", "joint_velocity", "motors", "objects")


@dataclass(frozen=True)
class Starts:
    """Recorded states, of which each episode has one, drawn by the seed of its scene.

    Args:
        arrays: Arrays (K, …) of a `State` for K states.

    """

    arrays: dict[str, Array]

    def drawn(self, seed: int) -> int:
        """Return the index of the state of the scene of a seed."""
        return int(np.random.default_rng([int(seed), _STREAM]).integers(len(self.arrays["base"])))

    def rows(self, indices: Any, objects: Array) -> State:
        """Return states, to be put into runs.

        Args:
            indices: Of one state, or of N.
            objects: As `State.objects`, of the runs: those that a state lacks stay where they are.

        """
        arrays: dict[str, Any] = {name: values[indices] for name, values in self.arrays.items()}
        kept = arrays["objects"][..., : objects.shape[-2], :]
        return State(**arrays | {"objects": _filled(kept, objects)})


def starts_of(
    given: Any, task: str, hand: str, noise: Noise = "none", training: Training | None = None
) -> Starts:
    """Return the states of ``options["state"]``.

    Args:
        given: A `State` or a `Snapshot`, several of them in a sequence, or a `State` with a first axis.
        task: The task of the environment.
        hand: Its hand.
        noise: Its noise.
        training: Its options for learners.

    Raises:
        ValueError: There is no state, or one of another task or hand, of another shape, or with numbers that
            no world takes.

    """
    # The first has all objects of the task, so that every row of a state is checked.
    whole = None if training is None else replace(training, fraction=1.0)
    trials = [Batch(task, hand, 1, noise=noise, threads=1, training=it) for it in (whole, training, None)]
    for trial in trials:
        trial.reset([0])
    found = [_arrays(name, one, trials, f"task {task!r} and hand {hand!r}") for name, one in _each(given)]
    if not found:
        raise ValueError("options: state: found no states; wanted at least one, or None")
    return Starts({name: np.stack([one[name] for one in found]) for name in found[0]})


def _each(given: Any) -> Iterable[tuple[str, Any]]:
    """Yield each state and its name in errors."""
    if isinstance(given, State) and np.asarray(given.base).ndim == 2:
        count = len(given.base)
        for name in _PLACED:
            if len(getattr(given, name)) != count:
                found = len(getattr(given, name))
                raise ValueError(f"options: state: {name}: found {found} rows; wanted {count}, those of base")
        for k in range(count):
            row = {name: np.asarray(getattr(given, name))[k] for name in (*_PLACED, "tension")}
            yield f"options: state[{k}]", State(**row)
    elif isinstance(given, State | Snapshot):
        yield "options: state", given
    elif isinstance(given, Sequence | np.ndarray) and not isinstance(given, str | bytes):
        for k, one in enumerate(given):
            yield f"options: state[{k}]", one
    else:
        raise ValueError(f"options: state: found {short(given)}; {_WANTED}")


_WANTED = "wanted a palmares.sim.State or Snapshot, several of them in a list, or None"


def _arrays(name: str, one: Any, trials: Sequence[Batch], of: str) -> dict[str, Array]:
    """Return the arrays of a state after a trial in a world.

    Args:
        name: Name of the state in errors.
        one: The state.
        trials: Worlds with all objects, with those of the environment, and of the task without options.
        of: Task and hand in errors.

    """
    if isinstance(one, Snapshot):
        one = _of_snapshot(name, one, trials)
    if not isinstance(one, State):
        raise ValueError(f"{name}: found {short(one)}; {_WANTED}")
    rows: dict[str, Any] = {
        part: np.asarray(getattr(one, part), dtype=np.float64)[np.newaxis] for part in _PLACED
    }
    trial, own = (it.state().objects for it in trials[:2])
    if rows["objects"].shape[1:] == (np.count_nonzero(_there(own)), 13):
        # A world has no rows of objects that a fraction leaves out.
        rows["objects"] = np.concatenate([rows["objects"], np.zeros_like(trial)], axis=1)[:, : trial.shape[1]]
    try:
        trials[0].set_state(**rows | {"objects": _filled(rows["objects"], trial)})
    except ValueError as refused:
        raise ValueError(f"{name}: {refused}, as a state of {of} has it") from None
    tension = np.zeros(trials[0].state().tension.shape[1])
    return {part: values[0] for part, values in rows.items()} | {"tension": tension}


def _there(objects: Array) -> NDArray[np.bool_]:
    """Return which objects (…, 13) are there, (…, 1): a run with fewer has rows of zeros."""
    found: NDArray[np.bool_] = np.any(objects[..., :7] != 0.0, axis=-1, keepdims=True)
    return found


def _filled(objects: Array, others: Array) -> Array:
    """Return objects (…, n, 13) as a run has them, whose own are `others`: those that are missing."""
    if objects.shape != others.shape:
        return objects  # The world says what is wrong.
    return np.where(_there(objects), objects, others)


def _of_snapshot(name: str, one: Snapshot, trials: Sequence[Batch]) -> State:
    """Return the state in a snapshot of a run with the options of the environment, or of the task's own."""
    refused = ""
    for world in trials:
        try:
            world.restore(0, one)
        except ValueError as error:
            refused = refused or str(error)
            continue
        arrays = world.state()
        return State(**{part: getattr(arrays, part)[0] for part in (*_PLACED, "tension")})
    raise ValueError(f"{name}: {refused}")
