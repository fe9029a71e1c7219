"""Arithmetic with the same bits on every machine, for whatever decides a run.

>>> turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
>>> matmul(turn, [1.0, 2.0, 3.0])
array([-2.,  1.,  3.])

NumPy's products (``@``, `dot`, `linalg`) run the kernel of BLAS that is the fastest on a processor, and these
kernels differ in the last bits. So do the sine and the power of C libraries, and the `sum` of Python 3.11 and
3.12. A controller that compares such numbers chooses another grasp on another machine. The sums here have one
order, and the functions are those of the engine.

Elements of arrays are added, multiplied, divided and compared by NumPy, as IEEE 754 has it. `math.sqrt` and
`numpy.sqrt` are rounded correctly, too. Without its compiled part the package has the C library's functions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from palmares.arrays import Array, array

try:
    from palmares._native import acos, asin, atan2, cos, exp, log, sin, tan
except ImportError:
    from math import acos, asin, atan2, cos, exp, log, sin, tan

__all__ = [
    "acos",
    "asin",
    "atan2",
    "cos",
    "dot",
    "dots",
    "exp",
    "least_squares",
    "log",
    "matmul",
    "mean",
    "norm",
    "normal",
    "norms",
    "sin",
    "tan",
    "total",
]


def total(values: ArrayLike) -> float:
    """Return the sum of all numbers of an array, rounded once."""
    return math.fsum(array(values).ravel().tolist())


def dot(a: ArrayLike, b: ArrayLike) -> float:
    """Return the scalar product of two vectors (n,): each product is rounded, then their sum."""
    return total(array(a) * array(b))


def norm(vector: ArrayLike) -> float:
    """Return the length of a vector (n,)."""
    return math.sqrt(dot(vector, vector))


def dots(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the scalar products (…) of vectors (…, n), summed from the first to the last component."""
    products = array(a) * array(b)
    found = products[..., 0]
    for k in range(1, products.shape[-1]):
        found = found + products[..., k]
    return array(found)


def norms(vectors: ArrayLike) -> Array:
    """Return the lengths (…) of vectors (…, n)."""
    return array(np.sqrt(dots(vectors, vectors)))


def mean(rows: Sequence[ArrayLike] | Array) -> Array:
    """Return the mean of rows (n, …), added from the first to the last."""
    found = array(rows[0])
    for row in rows[1:]:
        found = found + array(row)
    return array(found / len(rows))


def matmul(first: ArrayLike, *others: ArrayLike) -> Array:
    """Return the product of matrices, ``first @ second @ …``, from left to right.

    The first is a matrix (m, n), a vector (n,) or a stack of matrices (…, m, n); the others are matrices, and
    the last may be a vector.

    Raises:
        ValueError: The shapes do not fit.

    """
    found = array(first)
    for factor in map(array, others):
        if factor.ndim > 2 or found.shape[-1:] != factor.shape[:1]:
            raise ValueError(f"matmul: shapes {found.shape} and {factor.shape} do not fit")
        one = found if factor.ndim == 1 else found[..., None]
        terms = (one[..., k] if factor.ndim == 1 else one[..., k, :] for k in range(len(factor)))
        product = next(terms) * factor[0]
        for term, row in zip(terms, factor[1:], strict=True):
            product = product + term * row
        found = array(product)
    return found


def least_squares(matrix: Array, right: Array) -> Array:
    """Return the x (n,) that makes ``matrix @ x`` nearest to `right`, for a matrix (m, n) of few columns.

    It solves the normal equations by Cholesky's factorisation, so the columns must not be nearly dependent.

    Raises:
        ValueError: The columns depend on each other.

    """
    n = matrix.shape[1]
    factor = [[0.0] * n for _ in range(n)]
    x = [0.0] * n
    for i in range(n):
        for j in range(i + 1):
            known = math.fsum(factor[i][k] * factor[j][k] for k in range(j))
            rest = dot(matrix[:, i], matrix[:, j]) - known
            if i != j:
                factor[i][j] = rest / factor[j][j]
            elif rest > 0.0:
                factor[i][i] = math.sqrt(rest)
            else:
                raise ValueError("least_squares: the columns of the matrix depend on each other")
        known = math.fsum(factor[i][k] * x[k] for k in range(i))
        x[i] = (dot(matrix[:, i], right) - known) / factor[i][i]
    for i in reversed(range(n)):
        known = math.fsum(factor[k][i] * x[k] for k in range(i + 1, n))
        x[i] = (x[i] - known) / factor[i][i]
    return array(x)


def normal(generator: np.random.Generator, *shape: int) -> Array:
    """Return numbers of the standard normal distribution by the method of Box and Muller (1958).

    `Generator.normal` calls the C library for numbers far from 0.
    """
    count = math.prod(shape)
    radius, turn = 1.0 - generator.random(count), generator.random(count)
    drawn = [
        math.sqrt(-2.0 * log(r)) * cos(2.0 * math.pi * t)
        for r, t in zip(radius.tolist(), turn.tolist(), strict=True)
    ]
    return array(drawn, *shape)
