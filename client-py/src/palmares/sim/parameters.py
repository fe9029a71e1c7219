"""Numbers of runs that are given rather than drawn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from palmares.arguments import short, table
from palmares.arrays import Array


def given_rows(
    parameters: Mapping[str, ArrayLike] | None, count: int, objects: int, links: int
) -> dict[str, Array] | None:
    """Return the parameters of `count` runs: a row for each object, link or axis of gravity, or one number.

    Factors (count,) are repeated for all objects or links.

    Raises:
        ValueError: A wrong name or shape, or a number that is not finite.

    """
    if not parameters:
        return None
    factors = {"mass": objects, "friction": objects, "size": objects, "link_mass": links}
    columns = {**factors, "gravity": 3}
    given = {}
    for name, value in parameters.items():
        if name not in columns and not (isinstance(name, str) and name.startswith("hand_")):
            known = ", ".join(columns)
            raise ValueError(f"parameters: found {short(name)}; wanted some of {known}, hand_NAME")
        numbers = np.asarray(value)
        if name in factors and numbers.shape == (count,):
            numbers = np.repeat(numbers[:, np.newaxis], factors[name], axis=1)
        shape = (count, columns[name]) if name in columns else (count,)
        given[name] = np.ascontiguousarray(table(f"parameters[{name!r}]", numbers, *shape))
    return given


def same_rows(one: dict[str, Array] | None, other: dict[str, Array] | None) -> bool:
    """Whether both have the same numbers."""
    one, other = one or {}, other or {}
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
