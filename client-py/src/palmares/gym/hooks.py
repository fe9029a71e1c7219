"""Rewards and observations of your own, as functions of arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from palmares.arrays import Array
from palmares.gym.fields import Arrays
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Transition(Brief):
    """A step of N environments, which a reward of your own judges. A single environment has N = 1."""

    before: Arrays
    """Fields at the beginning of the step, (N, …)"""
    after: Arrays
    """Fields at its end, (N, …), before another run begins"""
    actions: Array
    """Actions in [−1, 1], (N, length)"""
    rewards: Array
    """The task's own rewards, (N,)"""
    events: Sequence[Sequence[Any]]
    """The referee's events in the step, of each environment"""
    terminated: NDArray[np.bool_]
    """Whether the task is over, (N,)"""
    truncated: NDArray[np.bool_]
    """Whether the run ends for another reason, (N,)"""


Reward: TypeAlias = Callable[[Transition], Any]
"""Takes a step, returns the rewards (N,): an array, or a tensor of PyTorch"""
Observe: TypeAlias = Callable[[Arrays], Any]
"""Takes fields (N, …), returns the observations (N, n): an array, or a tensor of PyTorch"""


def rewards_of(reward: Reward, transition: Transition) -> Array:
    """Return the rewards (N,) of a step.

    Raises:
        ValueError: The function returns another shape, or a number that is not finite.

    """
    count = len(transition.rewards)
    found = _array(reward(transition))
    if found.shape != (count,):
        raise ValueError(f"reward: found an array of shape {found.shape}; wanted ({count},)")
    return _finite("reward", found)


def observed(observe: Observe, fields: Arrays, count: int) -> NDArray[np.float32]:
    """Return the observations (N, n) of fields (N, …).

    Raises:
        ValueError: The function returns another shape, or a number that is not finite.

    """
    found = _array(observe(fields))
    if found.ndim != 2 or len(found) != count:
        raise ValueError(f"observe: found an array of shape {found.shape}; wanted ({count}, n)")
    return _finite("observe", found).astype(np.float32)


def copied(fields: Arrays) -> Arrays:
    """Return fields that later steps do not change."""
    return {name: values.copy() for name, values in fields.items()}


def _array(found: Any) -> Array:
    detach = getattr(found, "detach", None)
    plain = found if detach is None else detach().cpu().numpy()
    return np.asarray(plain, dtype=np.float64)


def _finite(name: str, found: Array) -> Array:
    flat = found.reshape(-1)
    wrong = np.flatnonzero(~np.isfinite(flat))
    if wrong.size:
        row = int(wrong[0]) * len(found) // flat.size
        raise ValueError(f"{name}: found {flat[wrong[0]]} in row {row}; wanted finite numbers")
    return found
