"""Play the recipe of every built-in hand in the task grasp and write models/hands/grasps.toml.

    python hand_grasps.py                    all hands
    python hand_grasps.py --hand yale_t42    one; the other results stay

Each hand grasps each of the eleven objects in the first scenes with this object from seed 5001 on.
A graspable object is held in half of its scenes or more; the mean is over these objects. The SoftHand plays
`grasp_softhand`, every other hand `grasp`. Hands are read from models/hands, not from the installed package.
"""

from __future__ import annotations

import argparse
import itertools
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from controllers import ROOT
from record import of_page

import palmares
from palmares.examples import grasp, grasp_softhand
from palmares.outputs import output_file
from palmares.sim import World
from palmares.skills.recipes import RECIPES

FIRST_SEED = 5001
HELD = 6.0
"""From this score on, of 10 points, the object was lifted and held through the shake, or nearly"""
FILE = ROOT / "models/hands/grasps.toml"
HEAD = """\
# Results of the recipes of the built-in hands in the task grasp.
# client-py/benchmarks/hand_grasps.py writes this file.
# {record}
"""


@dataclass(frozen=True)
class Job:
    """A run."""

    hand: str
    object: str
    seed: int
    url: str


def scenes(count: int) -> dict[str, list[int]]:
    """Return the seeds of the first `count` scenes of each object."""
    task = tomllib.loads((ROOT / "tasks/grasp/task.toml").read_text())
    found: dict[str, list[int]] = {name: [] for name in task["objects"]["from"]}
    for seed in itertools.count(FIRST_SEED):
        (body,) = World("grasp", "pinch", seed).scene.free
        if len(found[body.name]) < count:
            found[body.name].append(seed)
        if all(len(seeds) == count for seeds in found.values()):
            return found
    raise AssertionError


def play(job: Job) -> float:
    """Return the score of a run."""
    with palmares.Client(job.url) as client:
        if job.hand not in RECIPES:
            return grasp_softhand.run(client, job.seed, hand=job.hand).score
        hand = str(FILE.parent / job.hand) if job.url == "local" else job.hand
        return grasp.run(client, job.seed, hand, RECIPES[job.hand]).score


def section(hand: str, scores: dict[str, list[float]]) -> str:
    """Return the lines of a hand."""
    held = [name for name, found in scores.items() if np.mean(np.array(found) >= HELD) >= 0.5]
    mean = float(np.mean([scores[name] for name in held])) if held else 0.0
    lines = [f"[{hand}]", f"mean = {mean:.2f}"]
    for key, names in (("held", held), ("not_held", [name for name in scores if name not in held])):
        lines.append(f"{key} = [" + ", ".join(f'"{name}"' for name in names) + "]")
    return "\n".join([*lines, f"runs = {sum(map(len, scores.values()))}"]) + "\n"


def main() -> None:
    """Play and write."""
    hands = ["softhand", "softhand_skin", "softhand_strong", *RECIPES]
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hand", choices=hands, action="append", help="only this hand; can be repeated")
    parser.add_argument("--scenes", type=int, default=1, metavar="N", help="scenes of each object")
    parser.add_argument("--url", default="local", help="a server that has the hands, or local")
    parser.add_argument("--output", type=output_file, default=str(FILE), help="the file that is written")
    options = parser.parse_args()
    chosen, seeds = options.hand or hands, scenes(options.scenes)
    jobs = [Job(hand, name, seed, options.url) for hand in chosen for name in seeds for seed in seeds[name]]
    found: dict[str, dict[str, list[float]]] = {hand: {name: [] for name in seeds} for hand in chosen}
    with ProcessPoolExecutor() as pool:
        for job, score in zip(jobs, pool.map(play, jobs), strict=True):
            found[job.hand][job.object].append(score)
    text = options.output.read_text() if options.output.exists() else ""
    parts = {part.split("]")[0][1:]: part for part in text.split("\n\n") if part.startswith("[")}
    for hand in chosen:
        parts[hand] = section(hand, found[hand])
        print(parts[hand])
    head = HEAD.format(record=of_page(options.output, "hands", whole=set(chosen) == set(hands)))
    sections = ("\n" + parts[hand].rstrip() + "\n" for hand in hands if hand in parts)
    options.output.write_text(head + "".join(sections))


if __name__ == "__main__":
    main()
