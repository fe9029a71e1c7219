"""A search without derivatives in the unit cube: Halton's points, then evolution from the best of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from palmares.arrays import Array, array
from palmares.reproducible import dot, exp, log, matmul, normal

Key: TypeAlias = tuple[float, float]
"""Key of comparison, the smaller the better: the part by which limits are missed, then minus the score"""

PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71)
"""Bases of Halton's sequence; so many unknowns at most"""
SPREAD = 0.5
"""Part of the evaluations that is spread over the cube"""
LARGEST_STEP, LAST_STEP = 0.4, 2e-5
"""Standard deviation of the evolution's steps, in parts of the range: the largest, and the one below which it
begins anew at another of Halton's points"""
SUCCESS, SLOW, OFTEN = 2.0 / 11.0, 1.0 / 12.0, 0.44
"""Of Igel, Suttorp and Hansen: aimed share of successes, rate of its mean, and share above which the
distribution keeps its shape"""


def search(
    evaluate: Callable[[Array], Key], start: Array, evaluations: int, generator: np.random.Generator
) -> None:
    """Call a function at `evaluations` points (n,) of the unit cube, the first of them `start`.

    Halton's sequence (1960) is spread over the cube. Then, from the best point, the (1+1) evolution strategy
    whose covariance adapts by its Cholesky factor: Igel, Suttorp and Hansen (2006). A point that is as good
    is a success, so that the search crosses plateaus, as those of a part of objects that are held.
    """
    spread = max(min(2, evaluations - 1), math.ceil(SPREAD * evaluations) - 1)
    points = [start, *(halton(number, len(start)) for number in range(1, spread + 1))][:evaluations]
    first = [(evaluate(point), row) for row, point in enumerate(points)]
    left = evaluations - len(points)
    # Half of the distance between neighbours of so many points.
    step = 0.5 * exp(-log(float(len(points))) / len(start))
    for key, row in sorted(first):
        if left <= 0:
            return
        left -= _evolve(evaluate, points[row], key, step, left, generator)
    while left > 0:
        point = array(generator.random(len(start)))
        left -= 1 + _evolve(evaluate, point, evaluate(point), step, left - 1, generator)


def halton(number: int, n: int) -> Array:
    """Return a point (n,) of Halton's sequence, the first of which has the number 1."""
    found = []
    for base in PRIMES[:n]:
        rest, digit, value = number, 1.0, 0.0
        while rest:
            digit /= base
            value += digit * (rest % base)
            rest //= base
        found.append(value)
    return array(found)


def _evolve(
    evaluate: Callable[[Array], Key],
    point: Array,
    key: Key,
    step: float,
    most: int,
    generator: np.random.Generator,
) -> int:
    """Improve a point, from this step, with at most `most` evaluations; return how many they were."""
    n = len(point)
    keep = 1.0 - 2.0 / (n * n + 6.0)
    factor, succeeded = np.eye(n), SUCCESS
    for used in range(most):
        if step < LAST_STEP:
            return used
        drawn = normal(generator, n)
        move = matmul(factor, drawn)
        tried = folded(point + step * move)
        found = evaluate(tried)
        success = found <= key
        succeeded = (1.0 - SLOW) * succeeded + (SLOW if success else 0.0)
        growth = (succeeded - SUCCESS) / ((1.0 - SUCCESS) * (1.0 + n / 2.0))
        step = min(LARGEST_STEP, step * exp(growth))
        if success:
            point, key = tried, found
            if succeeded < OFTEN:
                length = dot(drawn, drawn)
                along = (math.sqrt(1.0 + (1.0 - keep) * length / keep) - 1.0) / length
                factor = math.sqrt(keep) * (factor + along * np.outer(move, drawn))
    return most


def folded(point: Array) -> Array:
    """Return a point reflected at the faces of the unit cube until it is inside."""
    twice = np.abs(point) % 2.0
    return array(np.where(twice > 1.0, 2.0 - twice, twice))
