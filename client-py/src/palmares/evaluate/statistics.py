"""Statistics of scores: their distribution, and paired comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palmares.arrays import Array
from palmares.reproducible import matmul, mean, total
from palmares.views import Brief

# Seed of the random numbers below.
SEED = 20161010
DRAWS = 20_000
# Up to this number of pairs the test goes through all signs.
EXACT_UP_TO = 14


@dataclass(frozen=True, repr=False)
class Spread(Brief):
    """Distribution of scores.

    Attributes:
        interval: 95 % interval of the mean, by bootstrap over the scenes.

    """

    runs: int
    mean: float
    interval: tuple[float, float]
    least: float
    quartile_1: float
    median: float
    quartile_3: float
    most: float

    @classmethod
    def of(cls, scores: Sequence[float], scenes: Sequence[int] | None = None) -> Spread:
        """Return the distribution of one or more scores; left out, each is of a scene of its own."""
        values = np.asarray(scores, dtype=float)
        means = values
        if scenes is not None:
            which, count = np.unique(scenes, return_inverse=True, return_counts=True)[1:]
            means = np.bincount(which, values) / count
        least, first, median, third, most = np.percentile(values, [0, 25, 50, 75, 100])
        return cls(
            len(values),
            total(values) / len(values),
            _interval(means),
            float(least),
            float(first),
            float(median),
            float(third),
            float(most),
        )


@dataclass(frozen=True, repr=False)
class Comparison(Brief):
    """The first controller against the second over the same seeds.

    Attributes:
        mean: Mean difference of the scores, first minus second.
        interval: Its 95 % interval, by bootstrap over the seeds.
        p_value: Probability of a mean difference at least as large if both were the same: a paired
            permutation test, which flips the signs of the differences (Fisher, The Design of Experiments).

    """

    pairs: int
    mean: float
    interval: tuple[float, float]
    better: int
    equal: int
    worse: int
    p_value: float

    @classmethod
    def of(cls, first: Sequence[float], second: Sequence[float]) -> Comparison:
        """Return the comparison of scores at the same seeds, in the same order."""
        difference = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
        return cls(
            len(difference),
            total(difference) / len(difference),
            _interval(difference),
            int(np.count_nonzero(difference > 0)),
            int(np.count_nonzero(difference == 0)),
            int(np.count_nonzero(difference < 0)),
            _p_value(difference),
        )


def _interval(values: Array) -> tuple[float, float]:
    generator = np.random.default_rng(SEED)
    drawn = generator.integers(len(values), size=(2_000, len(values)))
    low, high = np.percentile(mean(values[drawn].T), [2.5, 97.5])
    return float(low), float(high)


def _p_value(difference: Array) -> float:
    differs = difference[difference != 0]
    count = len(differs)
    if count == 0:
        return 1.0
    exact = count <= EXACT_UP_TO
    if exact:
        signs = 1 - 2 * ((np.arange(1 << count)[:, None] >> np.arange(count)) & 1)
    else:
        signs = np.random.default_rng(SEED).choice([-1, 1], size=(DRAWS, count))
    observed = abs(total(differs))
    as_large = int(np.count_nonzero(np.abs(matmul(signs, differs)) >= observed - 1e-9))
    # The observed signs count as one draw.
    return as_large / len(signs) if exact else (as_large + 1) / (len(signs) + 1)
