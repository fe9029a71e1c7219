"""Train the examples that learn, and draw their learning curves.

    pip install 'palmares[learn]'
    python learning_curves.py --train cem --folder ../../docs/training --output learning_cem.svg
    python learning_curves.py --train lift --folder ../../docs/training --output learning_lift.svg

A training is a file in the folder. It is made anew unless it is of the present engine, models and examples.
The drawing has a line for each training; README.md in the folder has the scores before and after.
"""

from __future__ import annotations

import argparse
import importlib
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from record import fields, line

from palmares.program.evaluate import seeds

PART = "training"
MODULES = {"cem": "train_grasp_cem", "lift": "train_lift_sb3"}
TITLES = {"cem": "One grasp by cross-entropy", "lift": "A policy from sensors, by PPO"}


def trained(learner: str, seed: int, updates: int | None, folder: Path) -> dict[str, Any]:
    """Return a training, which is made if the folder has none of the present engine."""
    file, record = folder / f"{learner}_{seed}.json", fields(PART)
    if file.exists():
        known: dict[str, Any] = json.loads(file.read_text())
        if all(known.get(key) == record[key] for key in ("engine", "models")):
            return known
    module = importlib.import_module(f"palmares.examples.{MODULES[learner]}")
    options = {} if updates is None else {"updates": updates}
    begun_s = time.process_time()
    learned = module.train(seed, threads=1, **options)
    made = asdict(learned) | {"cpu_s": round(time.process_time() - begun_s, 1)} | record
    file.write_text(json.dumps(made) + "\n")
    print(f"{file.name}: {np.mean(made['scores']):.2f} in {made['cpu_s']:.0f} s of CPU time", flush=True)
    return made


def row(learner: str, training: dict[str, Any]) -> str:
    """Return a training's row of the table."""
    scores, curve = np.array(training["scores"]), training["curve"]
    return (
        f"| {TITLES[learner]} | {training['seed']} | {curve[0]['test']:.2f} | {scores.mean():.2f} "
        f"| {np.mean(scores > 7.0):.0%} | {curve[-1]['episodes']} | {training.get('cpu_s', '')} |"
    )


def page(folder: Path) -> str:
    """Return the page of all trainings in a folder, which must be of one engine to name it."""
    found = [
        (learner, json.loads(path.read_text()))
        for learner in MODULES
        for path in sorted(folder.glob(f"{learner}_*.json"))
    ]
    # The oldest engine is that of the page, so that a page of two is not called that of the last.
    now = fields(PART)
    old = [
        training
        for _, training in found
        if training["engine"] != now["engine"] or training["models"] != now["models"]
    ]
    record = old[0] if old else found[-1][1]
    table = "\n".join(row(learner, training) for learner, training in found)
    return f"""\
# Learning curves

{line(record)}

Trainings of the two examples in [training.md](../training.md), one file each. Scores are means of 100 test
scenes with unseen objects; *kept* is the share of scenes in which the hand kept the object through the shake.
CPU time includes the tests. `client-py/benchmarks/learning_curves.py` trains, draws and writes this page.

| learner | seed | before | after | kept | runs | CPU time, s |
|---|---|---|---|---|---|---|
{table}
"""


def draw(trainings: list[dict[str, Any]], title: str, out: Path) -> None:
    """Draw mean scores in training and in the test over the runs played."""
    import matplotlib as mpl

    mpl.use("agg")
    mpl.rcParams["svg.hashsalt"] = "palmares"
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, sharey=True, figsize=(9, 3.6), constrained_layout=True)
    for axis, kind, label in (
        (axes[0], "train", "training, with exploration"),
        (axes[1], "test", "test: 100 scenes with unseen objects"),
    ):
        for training in trainings:
            points = [point for point in training["curve"] if point[kind] is not None]
            runs = [point["episodes"] for point in points]
            values = [point[kind] for point in points]
            axis.plot(runs, values, marker=".", linewidth=1.2, label=f"seed {training['seed']}")
        axis.set_title(label, fontsize="medium")
        axis.set_xlabel("runs played in training")
        axis.set_ylim(0.0, 10.2)
        axis.axhline(9.0, color="0.6", linewidth=0.8, linestyle="--")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("mean score, of 10")
    axes[0].legend(fontsize="small")
    figure.suptitle(title)
    figure.savefig(out, metadata={"Date": None, "Creator": None})


def main() -> None:
    """Train what is missing, draw, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--train", choices=MODULES, required=True, help="the example that learns")
    parser.add_argument("--seeds", default="1-5", help="a range (default 1-5)")
    parser.add_argument("--updates", type=int, help="updates of a training (default: that of the example)")
    parser.add_argument("--folder", type=Path, required=True, help="folder of the trainings")
    parser.add_argument("--output", type=Path, required=True, help="file for the drawing, SVG")
    args = parser.parse_args()
    trainings = [trained(args.train, seed, args.updates, args.folder) for seed in seeds(args.seeds)]
    draw(trainings, TITLES[args.train], args.output)
    (args.folder / "README.md").write_text(page(args.folder))


if __name__ == "__main__":
    main()
