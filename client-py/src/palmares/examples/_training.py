"""Shared by the two learners of the grasp task: learning curves, and training from the command line."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True)
class Point:
    """A point of a learning curve: the scores of an update in training and in the test."""

    update: int
    episodes: int
    """Runs played in training up to here"""
    train: float | None
    """Mean score of the update's runs, with exploration; ``None`` before the first update"""
    test: float | None
    """Mean score in the test scenes, without exploration; ``None`` if this update was not tested"""


@dataclass(frozen=True)
class Learned:
    """Outcome of a training."""

    seed: int
    curve: list[Point]
    scores: list[float]
    """Scores in the test scenes after the last update"""


OnPoint = Callable[[Point], None]
"""Called with every point of a curve"""


def learn(
    improve: Callable[[], float],
    test: Callable[[], float],
    *,
    updates: int,
    episodes: int,
    test_every: int,
    on_point: OnPoint,
) -> list[Point]:
    """Alternate updates and tests; return the curve.

    Args:
        improve: Makes an update; returns the mean score of its runs.
        test: Plays the test scenes; returns their mean score.
        updates: Number of updates.
        episodes: Runs of an update.
        test_every: Updates between two tests; there is also one before the first update and after the last.
        on_point: Called with every point.

    """
    curve: list[Point] = []
    for update in range(updates + 1):
        explored = improve() if update > 0 else None
        tested = test() if update % test_every == 0 or update == updates else None
        curve.append(Point(update, update * episodes, explored, tested))
        on_point(curve[-1])
    return curve


class Train(Protocol):
    """Trains, and writes the policy to a file if one is given."""

    def __call__(
        self, seed: int, *, updates: int, threads: int | None, on_point: OnPoint, policy: Path | None
    ) -> Learned: ...


def main(train: Train, doc: str | None, updates: int) -> None:
    """Read the command line and train; `updates` is the default number of updates."""
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    parser.add_argument(
        "--updates", type=int, default=updates, help=f"updates of the training (default {updates})"
    )
    parser.add_argument("--threads", type=int, help="threads that simulate (default: one for each core)")
    parser.add_argument("--curve", type=Path, help="file for the learning curve, JSON")
    parser.add_argument("--policy", type=Path, help="file for the policy")
    args = parser.parse_args()
    began = time.monotonic()

    def show(point: Point) -> None:
        train = "" if point.train is None else f", training {point.train:.2f}"
        test = "" if point.test is None else f", unseen objects {point.test:.2f}"
        print(f"{time.monotonic() - began:5.0f} s, update {point.update}{train}{test}", flush=True)

    learned = train(args.seed, updates=args.updates, threads=args.threads, on_point=show, policy=args.policy)
    if args.curve:
        args.curve.write_text(json.dumps(asdict(learned)) + "\n")
