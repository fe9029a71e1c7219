"""The effect of each drawn number of the hand on the score, with intervals by bootstrap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palmares.arrays import Array
from palmares.evaluate.play import Played
from palmares.reproducible import matmul
from palmares.views import Brief

# Seed of the random numbers below.
SEED = 20161010
DRAWS = 4_000
# Number of draws for many scenes, where more would take minutes.
FEWEST_DRAWS = 1_000
FEWEST_RUNS = 12
"""Fewer runs have no effects: their intervals would be too narrow"""
# Numbers of a bootstrap that are in memory at once.
AT_ONCE = 4_000_000


@dataclass(frozen=True, repr=False)
class Effect(Brief):
    """Effect of one uncertain number of the hand on the score.

    The intervals of all effects of a row together contain the truth with 95 % (Bonferroni), by bootstrap over
    the scenes.

    Attributes:
        name: Its name in ``[uncertain]`` of ``hand.toml``.
        least: Its smallest drawn value.
        most: Its largest.
        low: Mean score over the third of the runs in which it is smallest.
        high: Mean score over the third in which it is largest.
        difference: `high` minus `low`.
        interval: Interval of `difference`.
        correlation: Rank correlation with the score (Spearman); 0 if all scores are equal.
        correlation_interval: Its interval.

    """

    name: str
    least: float
    most: float
    low: float
    high: float
    difference: float
    interval: tuple[float, float]
    correlation: float
    correlation_interval: tuple[float, float]

    @property
    def matters(self) -> bool:
        """Whether the interval of the difference excludes 0."""
        return not self.interval[0] <= 0.0 <= self.interval[1]


def effects(runs: Sequence[Played]) -> tuple[Effect, ...]:
    """Return the effects of the drawn numbers of these runs, the largest first; none of too few runs."""
    drawn = [run for run in runs if run.hand_drawn]
    if len(drawn) < FEWEST_RUNS:
        return ()
    names = sorted(drawn[0].hand_drawn)
    scores = np.array([run.score for run in drawn])
    scenes = np.unique([run.seed for run in drawn], return_inverse=True)[1]
    numbers = np.array([[run.hand_drawn[name] for run in drawn] for name in names])
    # (numbers, scenes, 10)
    sums = np.stack([_sums(values, scores, scenes) for values in numbers])
    whole = matmul(np.ones(sums.shape[1]), _scenes_first(sums)).reshape(len(names), -1)
    difference, correlation = _statistics(whole)
    tail = 2.5 / len(names)
    # (2, ends, numbers)
    ends = np.nanpercentile(_bootstrap(sums), [tail, 100.0 - tail], axis=1).swapaxes(0, 1)
    found = [
        Effect(
            name,
            float(numbers[k].min()),
            float(numbers[k].max()),
            *_thirds(whole[k]),
            float(difference[k]),
            (float(ends[0, 0, k]), float(ends[0, 1, k])),
            float(correlation[k]),
            (float(ends[1, 0, k]), float(ends[1, 1, k])),
        )
        for k, name in enumerate(names)
    ]
    return tuple(sorted(found, key=lambda effect: (-abs(effect.difference), effect.name)))


def _sums(values: Array, scores: Array, scenes: NDArray[np.integer]) -> Array:
    """Return sums over the runs of each scene, (scenes, 10): those of drawn scenes are sums of these."""
    order, third = np.argsort(values, kind="stable"), len(values) // 3
    low, high = np.zeros(len(values)), np.zeros(len(values))
    low[order[:third]] = 1.0
    high[order[-third:]] = 1.0
    x, y = _ranks(values), _ranks(scores)
    columns = [low, low * scores, high, high * scores, np.ones(len(x)), x, y, x * x, y * y, x * y]
    return np.array([np.bincount(scenes, column) for column in columns]).T


def _bootstrap(sums: Array) -> Array:
    """Return the statistics of draws of as many scenes as there are: (2, draws, numbers)."""
    generator, (_, count, _) = np.random.default_rng(SEED), sums.shape
    draws, found = min(DRAWS, max(FEWEST_DRAWS, 10 * AT_ONCE // count)), []
    for begin in range(0, draws, step := max(1, AT_ONCE // count)):
        drawn = min(step, draws - begin)
        places = generator.integers(count, size=(drawn, count)) + count * np.arange(drawn)[:, None]
        times = np.bincount(places.ravel(), minlength=drawn * count).reshape(drawn, count)
        drawn_sums = matmul(times, _scenes_first(sums)).reshape(drawn, len(sums), -1)
        found.append(np.array(_statistics(drawn_sums)))
    return np.concatenate(found, axis=1)


def _scenes_first(sums: Array) -> Array:
    """Return sums (numbers, scenes, 10) as (scenes, numbers · 10)."""
    return np.moveaxis(sums, 1, 0).reshape(sums.shape[1], -1)


def _statistics(sums: Array) -> tuple[Array, Array]:
    """Return difference of the thirds and rank correlation; not a number where a third was not drawn."""
    low, low_scores, high, high_scores, n, x, y, xx, yy, xy = np.moveaxis(sums, -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        difference = high_scores / high - low_scores / low
    spread = (n * xx - x * x) * (n * yy - y * y)
    varies = spread > 1e-9 * n * n * n * n
    correlation = np.where(varies, (n * xy - x * y) / np.sqrt(np.where(varies, spread, 1.0)), 0.0)
    return difference, correlation


def _ranks(values: Array) -> Array:
    """Return ranks around 0, as parts of the number of values; equal values share their mean rank."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    mean = last - 0.5 * (count - 1)
    return (mean[place] - 0.5 * (len(values) + 1)) / len(values)


def _thirds(sums: Array) -> tuple[float, float]:
    """Return the mean scores of the low and the high third."""
    return float(sums[1] / sums[0]), float(sums[3] / sums[2])
