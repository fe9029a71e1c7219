"""Conversion of numbers to arrays."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

import palmares


@pytest.mark.parametrize(
    "values",
    [[1, 2, 3, 4, 5, 6], ((1, 2, 3), (4.0, 5.0, 6.0)), np.arange(1, 7, dtype=np.float32)],
)
def test_any_numbers_become_float64_of_the_shape(values: Any) -> None:
    found = palmares.array(values, -1, 3)
    assert found.dtype == np.float64
    assert found.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]


def test_a_binary_table_is_read_without_a_copy() -> None:
    table = bytearray(struct.pack("<4d", 1.0, 2.0, 3.0, 4.0))
    found = palmares.array(table, 2, 2)
    found[0, 0] = 9.0
    assert struct.unpack("<4d", table) == (9.0, 2.0, 3.0, 4.0)
    assert palmares.array(bytearray(), -1, 3).shape == (0, 3)


def test_a_wrong_number_of_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\(3,\)"):
        palmares.array([1.0, 2.0], 3)
