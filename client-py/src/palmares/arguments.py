"""Arguments, checked where they are given: what is wrong is told by their name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from palmares.arrays import Array

MAX_SEED = 2**53 - 1
"""Every JSON reader holds it exactly."""
MAX_COUNT = 2**32 - 1
"""Of ticks in one call."""


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Return a whole number as Python's own, also of one of NumPy's.

    Raises:
        ValueError: It is something else, or out of range.

    """
    if type(value) is not int and isinstance(value, int | np.integer) and not isinstance(value, bool):
        value = int(value)
    if type(value) is not int or not least <= value <= most:
        end = "2**53 - 1" if most == MAX_SEED else most
        raise ValueError(f"{name}: found {short(value)}; wanted a whole number from {least} to {end}")
    return value


def one_of(name: str, value: Any, words: Sequence[str]) -> None:
    """Refuse what is none of these words.

    Raises:
        ValueError: It is none.

    """
    if not isinstance(value, str) or value not in words:
        raise ValueError(f"{name}: found {short(value)}; wanted {' or '.join(map(repr, words))}")


def table(name: str, value: Any, *shape: int) -> Array:
    """Return finite numbers as an array of this shape.

    Raises:
        ValueError: They are others.

    """
    try:
        found = np.asarray(value)
    except ValueError:
        found = np.array(None)  # Lists of different lengths.
    if found.dtype.kind not in "fiub":
        raise ValueError(f"{name}: found {short(value)}, which are not numbers; wanted shape {shape}")
    if found.shape != shape:
        raise ValueError(f"{name}: found shape {found.shape}; wanted {shape}")
    numbers: Array = found.astype(np.float64, copy=False)
    if not np.isfinite(numbers).all():
        at = tuple(int(place) for place in np.argwhere(~np.isfinite(numbers))[0])
        place = ", ".join(map(str, at))
        raise ValueError(f"{name}[{place}] is {numbers[at]}; wanted finite numbers")
    return numbers


def mask_of(name: str, value: Any, count: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return a mask of so many worlds.

    Raises:
        ValueError: It is something else.

    """
    mask = np.asarray(value)
    if mask.shape != (count,) or mask.dtype != np.bool_:
        raise ValueError(f"{name}: wanted ({count},) of bool, found {mask.shape} of {mask.dtype}")
    return mask


def short(value: object) -> str:
    """Return what was found, on one line."""
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 40 else f"{text[:39]}…"


def is_real(value: Any) -> bool:
    """Whether it is a finite number."""
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return real and math.isfinite(value)
