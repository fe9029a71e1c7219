"""Draw the learning curves of the examples that learn, from their files.

    pip install 'palmares[learn]'
    python learning_curves.py ../../docs/training/cem_*.json --output ../../docs/pictures/learning_cem.svg

The drawing has a line for each training; the program also prints the final scores.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np


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
    """Read the command line and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("curves", type=Path, nargs="+", help="files of trainings with --curve")
    parser.add_argument("--title", default="", help="title of the drawing")
    parser.add_argument("--output", type=Path, required=True, help="file for the drawing, SVG")
    args = parser.parse_args()
    trainings = sorted((json.loads(path.read_text()) for path in args.curves), key=lambda one: one["seed"])
    draw(trainings, args.title, args.output)
    for training in trainings:
        curve, scores = training["curve"], np.array(training["scores"])
        print(
            f"seed {training['seed']}: {curve[0]['test']:.2f} at first, {scores.mean():.2f} after "
            f"{curve[-1]['episodes']} runs; {np.mean(scores > 7.0):.0%} kept through the shake"
        )


if __name__ == "__main__":
    main()
