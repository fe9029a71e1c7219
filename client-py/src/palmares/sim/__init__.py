"""The engine that scores, in this process: no server, no socket, the same bits.

>>> from palmares.sim import World                                    # doctest: +SKIP
... world = World("balls", "softhand", seed=1)
... obs = world.step(hand=[1.0], repeat=100)
... print(world.result().score, world.state_hash())

A run with the same actions ends in the same state hash and the same score here and on a server, on any
machine. `World` is one world, with snapshots; `Batch` is many worlds on all cores. Both need the compiled
part of the package, which the wheels contain.
"""

try:
    from palmares._native import Snapshot, faults, hand_numbers, objects
    from palmares._native import describe_hand as native_describe_hand
    from palmares._native import identity as native_identity
    from palmares._native import welcome as native_welcome
except ImportError as missing:
    raise ImportError(
        "palmares.sim needs the compiled part of the package, which is missing: install a wheel "
        "(`cargo xtask wheel` makes one). `palmares.Client` works without it."
    ) from missing

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from palmares.messages import Welcome
from palmares.sim.batch import Batch, Stepped
from palmares.sim.linearise import Linear, linearise
from palmares.sim.pictures import View
from palmares.sim.recording import Recording
from palmares.sim.state import State
from palmares.sim.world import World, read
from palmares.training import Training
from palmares.views import Brief, Described


def welcome(
    team: str = "palmares-py", own_hands: Iterable[str] = (), own_tasks: Iterable[str] = ()
) -> Welcome:
    """Return the greeting of a practice server: tasks, hands, limits, fields of actions and observations.

    Args:
        team: Name of the team.
        own_hands: Paths of further hands.
        own_tasks: Paths of further tasks.

    Raises:
        ValueError: A hand or task does not exist or cannot be read.

    """
    return read(native_welcome(team, list(own_hands), list(own_tasks)), Welcome)


def describe_hand(name: str) -> dict[str, Any]:
    """Return the description of a hand: links, joints, tendons, motors, sensors.

    `World.mechanics` has the poses and Jacobians of its links, `palmares.analysis.Hand` its equilibria.

    Args:
        name: Name of the hand, or the path of your own.

    Raises:
        ValueError: It does not exist or cannot be read.

    """
    return Described(json.loads(native_describe_hand(name)))


@dataclass(frozen=True, repr=False)
class Identity(Brief):
    """The versions that a run's bits depend on, beside its actions: the same here and on a server."""

    engine: str
    """The engine's fingerprint: results of its reference runs"""
    hands: dict[str, str]
    """Content hashes of the hands that come with the program, by name"""
    tasks: dict[str, str]
    """Content hashes of the tasks that come with the program, by name"""


def identity() -> Identity:
    """Return the names of the engine, its hands and tasks."""
    return Identity(*native_identity())


_GREETING = welcome()
TASKS = tuple(task.name for task in _GREETING.tasks)
"""Names of the tasks that come with the program"""
HANDS = tuple(hand.name for hand in _GREETING.hands)
"""Names of the hands that come with the program"""
OBJECTS = tuple(objects())
"""Names of the objects of the catalogue"""
FAULTS = dict(faults())
"""Causes of a world's failure: each `fault` of a `palmares.WorldFaultError`, its meaning and remedies"""

__all__ = [
    "FAULTS",
    "HANDS",
    "OBJECTS",
    "TASKS",
    "Batch",
    "Identity",
    "Linear",
    "Recording",
    "Snapshot",
    "State",
    "Stepped",
    "Training",
    "View",
    "World",
    "describe_hand",
    "hand_numbers",
    "identity",
    "linearise",
    "welcome",
]
