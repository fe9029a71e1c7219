"""Shared by the learners of the grasp task: learning curves, and training from the command line."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palmares.arrays import Array, array
from palmares.outputs import output_file


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
    coarse: list[float] = field(default_factory=list)
    """Scores in the first of these scenes with the long steps of the training, if it had such steps"""


OnPoint = Callable[[Point], None]
"""Called with every point of a curve"""


Mask = NDArray[np.bool_]
Step = Callable[[Array], tuple[Array, Array, Array, Mask, Mask]]
"""Plays actions (N, actions) in N worlds and begins other runs where some are over; returns observations,
those before the other runs began, rewards (N,), and whether runs ended and were cut short (N,)"""


def vec_env(count: int, observations: int, actions: int, reset: Callable[[], Array], step: Step) -> Any:
    """Return worlds as an environment of stable-baselines3.

    Args:
        count: Number of worlds N.
        observations: Numbers of an observation.
        actions: Numbers of an action, each −1 to 1.
        reset: Begins a run in each world; returns observations (N, observations).
        step: See `Step`.

    """
    from gymnasium import spaces
    from stable_baselines3.common.vec_env import VecEnv

    class Worlds(VecEnv):
        def __init__(self) -> None:
            observed = spaces.Box(-np.inf, np.inf, (observations,))
            super().__init__(count, observed, spaces.Box(-1.0, 1.0, (actions,)))

        def reset(self) -> Array:
            return reset()

        def step_async(self, actions: Array) -> None:
            self._actions = array(actions)

        def step_wait(self) -> tuple[Array, Array, Mask, list[dict[str, Any]]]:
            now, last, rewards, ended, short = step(self._actions)
            infos: list[dict[str, Any]] = [{} for _ in rewards]
            for world in np.flatnonzero(ended | short):
                infos[world] = {
                    "terminal_observation": last[world],
                    "TimeLimit.truncated": bool(short[world]),
                }
            return now, rewards, ended | short, infos

        def close(self) -> None:
            pass

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            return [getattr(self, attr_name, None) for _ in self._get_indices(indices)]

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise NotImplementedError

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            raise NotImplementedError

        def env_is_wrapped(self, _: Any, indices: Any = None) -> list[bool]:
            return [False for _ in self._get_indices(indices)]

    return Worlds()


def learn(
    improve: Callable[[], float],
    test: Callable[[], float],
    *,
    updates: int,
    episodes: int | Callable[[], int],
    test_every: int | None,
    on_point: OnPoint,
) -> list[Point]:
    """Alternate updates and tests; return the curve.

    Args:
        improve: Makes an update; returns the mean score of its runs.
        test: Plays the test scenes; returns their mean score.
        updates: Number of updates.
        episodes: Runs of an update, or a function that returns the runs so far.
        test_every: Updates between two tests; there is also one before the first update and after the last.
            Without it there is only the last.
        on_point: Called with every point.

    """
    curve: list[Point] = []
    for update in range(updates + 1):
        explored = improve() if update > 0 else None
        due = update == updates or (test_every is not None and update % test_every == 0)
        runs = episodes() if callable(episodes) else update * episodes
        curve.append(Point(update, runs, explored, test() if due else None))
        on_point(curve[-1])
    return curve


def main(
    train: Callable[..., Learned],
    doc: str | None,
    updates: int | None,
    options: Callable[[argparse.ArgumentParser], None] = lambda _: None,
) -> None:
    """Read the command line and train.

    Args:
        train: Trains, with `seed` and keyword arguments as `train_grasp_cem.train`.
        doc: The module's docstring.
        updates: Default number of updates; ``None`` for that of `train`.
        options: Adds options to the command line: further arguments of `train`.

    """
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1, help="seed of the training (default 1)")
    known = "that of the learner" if updates is None else updates
    parser.add_argument(
        "--updates", type=int, default=updates, help=f"updates of the training (default {known})"
    )
    parser.add_argument("--threads", type=int, help="threads that simulate (default: one for each core)")
    parser.add_argument("--curve", type=output_file, help="file for the learning curve, JSON")
    parser.add_argument("--policy", type=output_file, help="file for the policy")
    options(parser)
    args = vars(parser.parse_args())
    curve: Path | None = args.pop("curve")
    began = time.monotonic()

    def show(point: Point) -> None:
        train = "" if point.train is None else f", training {point.train:.2f}"
        test = "" if point.test is None else f", unseen objects {point.test:.2f}"
        print(f"{time.monotonic() - began:5.0f} s, update {point.update}{train}{test}", flush=True)

    learned = train(**args, on_point=show)
    if curve:
        curve.write_text(json.dumps(asdict(learned)) + "\n")
