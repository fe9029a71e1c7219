"""The array type of this package, and the function that makes such arrays."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
"""Every array of this package; each function states the shapes it takes and returns."""

Vec3: TypeAlias = tuple[float, float, float]
Quat: TypeAlias = tuple[float, float, float, float]
"""x, y, z, w"""
Table: TypeAlias = bytearray | list[Any]
"""Numbers as they come over the wire: binary in MessagePack, lists in JSON; `array` reads both."""

_LITTLE_ENDIAN = np.dtype("<f8")


def array(values: ArrayLike, *shape: int) -> Array:
    """Return numbers as a float64 array, reshaped to `shape` if given; a length of -1 fits itself.

    Takes lists, tuples, arrays and the binary tables of MessagePack (little-endian 64-bit floats). An array
    or a binary table of the right type is not copied.

    Raises:
        ValueError: There are too few or too many numbers for `shape`.

    """
    if isinstance(values, bytearray):
        found: Array = np.ndarray(len(values) // 8, _LITTLE_ENDIAN, values)
    else:
        found = np.asarray(values, np.float64)
    return found.reshape(shape) if shape else found
