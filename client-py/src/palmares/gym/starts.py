"""Recorded states from which episodes start."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

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

    def rows(self, indices: Sequence[int] | Array) -> State:
        """Return the states of these indices as one with a first axis (N, …)."""
        chosen = np.asarray(indices, dtype=np.int64)
        arrays: dict[str, Any] = {name: values[chosen] for name, values in self.arrays.items()}
        return State(**arrays)

    def row(self, index: int) -> State:
        """Return one state."""
        arrays: dict[str, Any] = {name: values[index] for name, values in self.arrays.items()}
        return State(**arrays)


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
    # All objects of the task, so that every row of a state is checked.
    options = None if training is None else replace(training, fraction=1.0)
    trial = Batch(task, hand, 1, noise=noise, threads=1, training=options)
    trial.reset([0])
    found = [_arrays(name, one, trial, (task, hand, noise)) for name, one in _each(given)]
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


def _arrays(name: str, one: Any, trial: Batch, made_with: tuple[str, str, Noise]) -> dict[str, Array]:
    """Return the arrays of a state after a trial in a world."""
    if isinstance(one, Snapshot):
        one = _of_snapshot(name, one, trial, made_with)
    if not isinstance(one, State):
        raise ValueError(f"{name}: found {short(one)}; {_WANTED}")
    rows: dict[str, Any] = {
        part: np.asarray(getattr(one, part), dtype=np.float64)[np.newaxis] for part in _PLACED
    }
    try:
        trial.set_state(**rows)
    except ValueError as refused:
        task, hand, _ = made_with
        raise ValueError(f"{name}: {refused}, as a state of task {task!r} and hand {hand!r} has it") from None
    tension = np.zeros(trial.state().tension.shape[1])
    return {part: values[0] for part, values in rows.items()} | {"tension": tension}


def _of_snapshot(name: str, one: Snapshot, trial: Batch, made_with: tuple[str, str, Noise]) -> State:
    """Return the state in a snapshot of a run with the options of the environment, or of the task's own."""
    task, hand, noise = made_with
    refused = ""
    for world in (trial, Batch(task, hand, 1, noise=noise, threads=1)):
        try:
            world.restore(0, one)
        except ValueError as error:
            refused = refused or str(error)
            continue
        arrays = world.state()
        return State(**{part: getattr(arrays, part)[0] for part in (*_PLACED, "tension")})
    raise ValueError(f"{name}: {refused}")
