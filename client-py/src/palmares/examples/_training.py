"""What the two learners of the grasp task share: learning curves, and training from the command line."""

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
    """A point of a learning curve: what an update learned from, and what it came to."""

    update: int
    episodes: int
    """Runs played in training so far"""
    train: float | None
    """Mean score of the runs the update learned from, with exploration; ``None`` before the first"""
    test: float | None
    """Mean score in the test scenes, without exploration, if it was tested after this update"""


@dataclass(frozen=True)
class Learned:
    """What a training came to."""

    seed: int
    curve: list[Point]
    scores: list[float]
    """In the test scenes, after the last update"""


Tell = Callable[[Point], None]
"""Called with every point of a curve"""


def learn(
    improve: Callable[[], float],
    test: Callable[[], float],
    *,
    updates: int,
    episodes: int,
    test_every: int,
    tell: Tell,
) -> list[Point]:
    """Improve and test by turns; return the curve.

    Args:
        improve: Plays, and improves what is learned by that; returns the mean score of the runs.
        test: Plays the test scenes; returns their mean score.
        updates: How often to improve.
        episodes: Runs that an update plays.
        test_every: It is tested before the first update, after every so many, and after the last.
        tell: Called with every point.

    """
    curve: list[Point] = []
    for update in range(updates + 1):
        explored = improve() if update > 0 else None
        tested = test() if update % test_every == 0 or update == updates else None
        curve.append(Point(update, update * episodes, explored, tested))
        tell(curve[-1])
    return curve


class Train(Protocol):
    """Train; keep what was learned in a file, if one is named."""

    def __call__(
        self, seed: int, *, updates: int, threads: int | None, tell: Tell, policy: Path | None
    ) -> Learned: ...


def main(train: Train, doc: str | None, updates: int) -> None:
    """Train as the command line says; `updates` is the default."""
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="of the training")
    parser.add_argument("--updates", type=int, default=updates, help=f"how long to train; {updates}")
    parser.add_argument("--threads", type=int, help="one for each core when left out")
    parser.add_argument("--curve", type=Path, help="file for the learning curve, JSON")
    parser.add_argument("--policy", type=Path, help="file for what was learned")
    args = parser.parse_args()
    began = time.monotonic()

    def tell(point: Point) -> None:
        train = "" if point.train is None else f", training {point.train:.2f}"
        test = "" if point.test is None else f", unseen objects {point.test:.2f}"
        print(f"{time.monotonic() - began:5.0f} s, update {point.update}{train}{test}", flush=True)

    learned = train(args.seed, updates=args.updates, threads=args.threads, tell=tell, policy=args.policy)
    if args.curve:
        args.curve.write_text(json.dumps(asdict(learned)) + "\n")
