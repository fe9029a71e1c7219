"""Likeness of runs, as `palmares admin run similar` measures it: false alarms and misses.

    python benchmarks/likeness.py                      # everything
    python benchmarks/likeness.py --only grasp peg     # these tasks

Plays the example controllers in this process, and copies of their runs in disguise; compares the replays
with `palmares replay A --like B`; prints the two tables of docs/organizers.md.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import io
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import palmares

# The example controllers of each task; two of them in one scene are runs of two honest teams.
EXAMPLES = {
    "grasp": ("grasp_softhand", "grasp_sensors"),
    "peg": ("peg_softhand",),
    "balls": ("balls_softhand", "balls_sensors", "balls_reflex"),
    "shelf": ("shelf_softhand", "shelf_sensors", "shelf_reflex"),
}
SCENES = {"grasp": range(1, 9), "peg": range(1, 3), "balls": range(1, 3), "shelf": range(1, 3)}
# These runs are copied, in scene 1.
COPIED = ("grasp_softhand", "peg_softhand", "balls_reflex", "shelf_reflex")
# Pairs from here are listed: `LISTED_SHARE` of server/store/src/similar_runs.rs.
LISTED = 55


class Command(NamedTuple):
    """The action of a controller in a tick."""

    base: palmares.Base | None
    hand: list[float] | None


class Played(NamedTuple):
    """A run: its replay, its score, and its commands tick by tick."""

    replay: Path
    score: float
    commands: list[Command]
    task: str
    hand: str


class Found(NamedTuple):
    """How alike two replays are."""

    share: int
    distance_mm: float


def played(example: str, scene: int, replay: Path) -> Played:
    """Play an example in a scene."""
    commands: list[Command] = []
    with palmares.Client("local") as client:
        step = client.step
        opened: dict[str, str] = {}

        def logged(*arguments: Any, **options: Any) -> palmares.Observation:
            observation = step(*arguments, **options)
            action = observation.applied_action
            hand = None if action.hand is None else [float(x) for x in action.hand]
            commands.extend([Command(action.base, hand)] * (observation.tick - len(commands)))
            return observation

        reset = client.reset

        def remembered(task: str, hand: str, **options: Any) -> palmares.Observation:
            opened.update(task=task, hand=hand)
            return reset(task, hand, **options)

        client.step, client.reset = logged, remembered  # type: ignore[method-assign]
        with contextlib.redirect_stdout(io.StringIO()):
            importlib.import_module(f"palmares.examples.{example}").run(client, scene)
        result = client.stop() if client.result is None else client.result
        client.save_replay(replay)
    return Played(replay, result.score, commands, opened["task"], opened["hand"])


def copied(run: Played, scene: int, commands: list[Command], repeat: int, replay: Path) -> float:
    """Play commands, each for some ticks; return the score."""
    with palmares.Client("local") as client:
        client.reset(run.task, run.hand, seed=scene)
        for base, hand in commands:
            observation = client.step(base=base, hand=hand, repeat=repeat)
            if observation.done:
                break
        result = client.stop() if client.result is None else client.result
        client.save_replay(replay)
    return result.score


def with_noise(commands: list[Command], noise_mm: float) -> list[Command]:
    """Add noise to positions (mm), velocities (cm/s) and σ (%), in every tick."""
    chance = random.Random(1)

    def noise(scale: float) -> float:
        return scale * chance.uniform(-noise_mm, noise_mm)

    def noisy(command: Command) -> Command:
        base = moved(command.base, lambda: noise(1e-3), lambda: noise(1e-2))
        hand = None if command.hand is None else [min(1.0, max(0.0, x + noise(1e-2))) for x in command.hand]
        return Command(base, hand)

    return [noisy(command) for command in commands]


def moved(
    base: palmares.Base | None, by_m: Callable[[], float], by_m_s: Callable[[], float]
) -> palmares.Base | None:
    """Return a target of the base with other positions, or other velocities."""
    if base is None:
        return None
    if getattr(base, "position", None) is not None:
        return palmares.pose([x + by_m() for x in base.position], base.quat_xyzw)
    if getattr(base, "linear", None) is not None:
        return palmares.twist([x + by_m_s() for x in base.linear], base.angular)
    return base


def aside(commands: list[Command], offset_mm: float) -> list[Command]:
    """Move all positions by a constant; velocities have none."""

    def shifted(base: palmares.Base | None) -> palmares.Base | None:
        axes = iter((0.6e-3, -0.64e-3, 0.48e-3))
        return moved(base, lambda: offset_mm * next(axes), lambda: 0.0)

    return [Command(shifted(base), hand) for base, hand in commands]


def disguises(commands: list[Command]) -> Iterator[tuple[str, list[Command], int]]:
    """Yield name, commands and ticks for each command of every disguise."""
    for noise_mm in (0.0, 0.1, 0.3, 1.0, 3.0, 10.0):
        yield f"noise {noise_mm:g} mm", with_noise(commands, noise_mm), 1
    for n in (2, 5):
        yield f"every {n} ticks", commands[::n], n
    for ticks in (1, 10, 50):
        yield f"{ticks} ticks later", [commands[0]] * ticks + commands, 1
    for offset_mm in (1.0, 3.0, 10.0):
        yield f"{offset_mm:g} mm aside", aside(commands, offset_mm), 1
    yield "half the pace", commands, 2
    yield (
        "3 mm aside, 10 ticks later, noise 1 mm, every 2 ticks",
        with_noise([commands[0]] * 10 + aside(commands, 3.0), 1.0)[::2],
        2,
    )


def likeness(one: Path, other: Path) -> Found:
    """Compare two replays with the program."""
    command = [sys.executable, "-m", "palmares", "replay", str(one), "--like", str(other)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    share, distance = (re.search(rf"^{name} +([\d.]+)", done.stdout, re.M) for name in ("alike", "distance"))
    assert share is not None, done.stdout
    return Found(int(share[1]), float(distance[1]) if distance is not None else 0.0)


def honest(task: str, folder: Path) -> list[tuple[str, str, Found]]:
    """Compare every two examples in each scene of a task."""
    found = []
    for scene in SCENES[task]:
        runs = {name: played(name, scene, folder / f"{name}-{scene}.mcap") for name in EXAMPLES[task]}
        for one, other in combinations(runs, 2):
            pair = f"{one}, {other}, scene {scene}"
            found.append((task, pair, likeness(runs[one].replay, runs[other].replay)))
    return found


def copies(example: str, folder: Path) -> list[tuple[str, str, float, Found]]:
    """Compare a run with copies of it."""
    run = played(example, 1, folder / f"{example}.mcap")
    found = []
    for number, (name, commands, repeat) in enumerate(disguises(run.commands)):
        replay = folder / f"{example}-copy-{number}.mcap"
        score = copied(run, 1, commands, repeat, replay)
        found.append((example, name, score, likeness(run.replay, replay)))
    return found


def main() -> None:
    """Print the two tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", default=list(EXAMPLES), choices=list(EXAMPLES), metavar="TASK")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary, ProcessPoolExecutor(options.jobs) as pool:
        folder = Path(temporary)
        chosen = [name for name in COPIED if name.split("_")[0] in options.only]
        own = [pool.submit(honest, task, folder) for task in options.only]
        disguised = [pool.submit(copies, name, folder) for name in chosen]
        print("| runs of two examples in one scene | alike, % | distance, mm | listed |\n|---|---|---|---|")
        for task in own:
            for _, pair, found in task.result():
                print(row(pair, found), flush=True)
        print("\n| copy | score | alike, % | distance, mm | listed |\n|---|---|---|---|---|")
        for run in disguised:
            for example, name, score, found in run.result():
                print(row(f"{example}: {name} | {score:g}", found), flush=True)


def row(name: str, found: Found) -> str:
    """Return a row of a table."""
    listed = "yes" if found.share >= LISTED else "no"
    return f"| {name} | {found.share} | {found.distance_mm:.1f} | {listed} |"


if __name__ == "__main__":
    main()
