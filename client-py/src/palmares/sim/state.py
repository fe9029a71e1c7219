"""State, mechanics and contacts of worlds as arrays."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palmares._native import Snapshot
from palmares.arguments import table, whole
from palmares.arrays import Array
from palmares.views import Brief

Arrays: TypeAlias = dict[str, Array]

MECHANICS = (
    "links",
    "link_velocities",
    "jacobians",
    "fingertips",
    "fingertip_jacobians",
    "mass_matrix",
    "bias",
    "moment_arms",
)
"""The quantities of ``mechanics``, in the order in which they are documented there"""

MOST_CONTACTS = 4096
"""Most rows of ``contacts``"""


@dataclass(frozen=True, repr=False)
class State(Brief):
    """The state of a world, or with a first axis (N, …) of the worlds of a `Batch`.

    Its arrays are yours to change: ``set_state`` puts what you changed elsewhere, and continues the rest, bit
    for bit. ``memory`` has what no array shows: the memory of contacts and of the integrator, the referee,
    the sensors and the tick.
    """

    base: Array
    """(13,): position (m), quaternion x y z w, linear (m/s) and angular (rad/s) velocity of the base"""
    q: Array
    """(joints,): joint coordinates, rad or m"""
    joint_velocity: Array
    """(joints,)"""
    motors: Array
    """(motors, 2): σ and dσ/dt (1/s)"""
    objects: Array
    """(objects, 13): as ``base``, for each free object"""
    tension: Array
    """(tendons,): tensions of the last step, N, or the unit of the tendon; ``set_state`` does not read
    them"""
    memory: Snapshot | None = None
    """Everything else; ``None`` in a state of a batch"""

    def replace(self, **arrays: ArrayLike) -> State:
        """Return a copy with other arrays."""
        changed: dict[str, Any] = {name: np.asarray(it, dtype=np.float64) for name, it in arrays.items()}
        return replace(self, **changed)

    def copy(self) -> State:
        """Return a copy whose arrays are its own."""
        return self.replace(**{name: getattr(self, name).copy() for name in STATE})


STATE = tuple(field.name for field in fields(State) if field.name != "memory")
"""Names of the arrays of a `State`"""


@dataclass(frozen=True)
class Placed:
    """New poses and velocities."""

    base: Array | None
    q: Array | None
    joint_velocity: Array | None
    motors: Array | None
    objects: Array | None


def placed(
    state: State | None, parts: dict[str, ArrayLike | None], shapes: dict[str, tuple[int, ...]]
) -> Placed:
    """Return what is put elsewhere: the parts, and those of the state that are not among them.

    Raises:
        ValueError: A wrong shape, or a number that is not finite.

    """
    chosen: dict[str, Any] = {}
    for name in ("base", "q", "joint_velocity", "motors", "objects"):
        part = parts.get(name)
        given = part if part is not None or state is None else getattr(state, name)
        chosen[name] = None if given is None else np.ascontiguousarray(table(name, given, *shapes[name]))
    return Placed(**chosen)


def named(names: tuple[str, ...]) -> list[str]:
    """Return the names of mechanics, all if none are given.

    Raises:
        ValueError: There is no such quantity.

    """
    for name in names:
        if name not in MECHANICS:
            raise ValueError(f"found {name!r}; wanted one of {', '.join(MECHANICS)}")
    return list(names or MECHANICS)


def rows_of_contacts(most: int) -> int:
    """Return the number of rows of contacts."""
    return whole("most", most, 1, MOST_CONTACTS)


def state_of(arrays: dict[str, NDArray[np.float64]], memory: Snapshot | None) -> State:
    """Return a state of native arrays."""
    return State(**arrays, memory=memory)
