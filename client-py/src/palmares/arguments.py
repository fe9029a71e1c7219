"""Checks of arguments; an error names the argument, the value found and the values wanted."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from palmares.arrays import Array

Sensing: TypeAlias = Literal["sensors", "truth"]
"""The content of observations"""
Noise: TypeAlias = Literal["none", "real"]
"""Errors of the sensors"""
MAX_SEED = 2**53 - 1
"""The largest whole number that every JSON reader keeps exactly"""
MAX_COUNT = 2**32 - 1
"""Most ticks in one call"""


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Return a whole number as an `int`; NumPy's whole numbers are accepted.

    Raises:
        ValueError: The value is no whole number, or out of range.

    """
    if type(value) is not int and isinstance(value, int | np.integer) and not isinstance(value, bool):
        value = int(value)
    if type(value) is not int or not least <= value <= most:
        end = "2**53 - 1" if most == MAX_SEED else most
        raise ValueError(f"{name}: found {short(value)}; wanted a whole number from {least} to {end}")
    return value


def one_of(name: str, value: Any, words: Sequence[str]) -> None:
    """Check that the value is one of these words.

    Raises:
        ValueError: It is not.

    """
    if not isinstance(value, str) or value not in words:
        raise ValueError(f"{name}: found {short(value)}; wanted {' or '.join(map(repr, words))}")


def check_sensing(sensing: Any, noise: Any) -> None:
    """Check the arguments `sensing` and `noise`.

    Raises:
        ValueError: One of them is no such word.

    """
    one_of("sensing", sensing, get_args(Sensing))
    one_of("noise", noise, get_args(Noise))


def one_name(name: str, value: Any, note: str = "") -> str:
    """Return a name or a path as a text.

    Args:
        name: The argument.
        value: What was given.
        note: Remedy for several.

    Raises:
        ValueError: It is something else, such as a list of names.

    """
    if not isinstance(value, str | os.PathLike):
        raise ValueError(f"{name}: found {short(value)}; wanted one name or path{note}")
    return str(os.fspath(value))


def table(name: str, value: Any, *shape: int) -> Array:
    """Return finite numbers as an array of this shape.

    Raises:
        ValueError: The shape differs, or an entry is not a finite number.

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
    """Return a mask (count,) of worlds.

    Raises:
        ValueError: The shape differs, or the entries are not bools.

    """
    mask = np.asarray(value)
    if mask.shape != (count,) or mask.dtype != np.bool_:
        raise ValueError(f"{name}: wanted ({count},) of bool, found {mask.shape} of {mask.dtype}")
    return mask


def short(value: object) -> str:
    """Return the value on one line, at most 40 characters."""
    text = repr(value).replace("\n", " ")
    return text if len(text) <= 40 else f"{text[:39]}…"


def is_real(value: Any) -> bool:
    """Whether the value is a finite number."""
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return real and math.isfinite(value)
