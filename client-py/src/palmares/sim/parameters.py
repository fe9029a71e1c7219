"""Numbers of runs that are given rather than drawn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from palmares.arguments import short, table
from palmares.arrays import Array

FACTORS = ("mass", "friction", "size")
"""Factors of the objects' masses, friction coefficients and lengths"""


def given_rows(
    parameters: Mapping[str, ArrayLike] | None, count: int, objects: int
) -> dict[str, Array] | None:
    """Return the parameters of `count` runs: of the objects arrays (count, objects), of the hand (count,).

    Raises:
        ValueError: A wrong name or shape, or a number that is not finite.

    """
    if not parameters:
        return None
    given = {}
    for name, value in parameters.items():
        if name not in FACTORS and not (isinstance(name, str) and name.startswith("hand_")):
            known = ", ".join(FACTORS)
            raise ValueError(f"parameters: found {short(name)}; wanted some of {known}, hand_NAME")
        numbers = np.asarray(value)
        if name in FACTORS and numbers.shape == (count,):
            numbers = np.repeat(numbers[:, np.newaxis], objects, axis=1)
        shape = (count, objects) if name in FACTORS else (count,)
        given[name] = np.ascontiguousarray(table(f"parameters[{name!r}]", numbers, *shape))
    return given


def same_rows(one: dict[str, Array] | None, other: dict[str, Array] | None) -> bool:
    """Whether both have the same numbers."""
    one, other = one or {}, other or {}
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
