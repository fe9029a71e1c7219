"""Train the example with a reward of its own, and draw its learning curves.

    pip install 'palmares[learn]'
    python own_reward.py --folder ../../docs/training --output ../../docs/pictures/learning_peg.svg

A training is a file in the folder. It is made anew unless it is of the present engine, models and example.
peg.md in the folder has the outcomes.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import figures
import numpy as np
from record import fields, line

from palmares.examples import train_peg_reward as example
from palmares.outputs import output_file, output_folder
from palmares.program.evaluate import seeds

PART = "own_reward"


def is_current(training: dict[str, Any]) -> bool:
    """Whether a training is of the present engine, models and example."""
    record = fields(PART)
    return all(training.get(key) == record[key] for key in ("engine", "models"))


def trained(seed: int, updates: int, tests: int, folder: Path) -> dict[str, Any]:
    """Return a training, which is made if the folder has none of the present engine."""
    file = folder / f"peg_{seed}.json"
    known: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    if is_current(known):
        return known
    learned = example.train(seed, updates=updates, tests=tests, threads=1, on_point=show)
    made = asdict(learned) | fields(PART)
    file.write_text(json.dumps(made) + "\n")
    share = 100.0 * example.share_lifted(made["rises"])
    print(f"{file.name}: {share:.0f} % lifted in {made['cpu_s']:.0f} s of CPU time", flush=True)
    return made


def show(point: example.Point) -> None:
    """Print a point of a curve."""
    lifted = "" if point.lifted is None else f", lifted {100.0 * point.lifted:.0f} %"
    print(f"update {point.update}: reward {point.reward:.2f}{lifted}", flush=True)


def page(trainings: list[dict[str, Any]]) -> str:
    """Return the page of the trainings."""
    rows = "\n".join(
        f"| {t['seed']} | {100.0 * example.share_lifted(t['rises']):.0f} "
        f"| {1000.0 * float(np.mean(t['rises'])):.0f} | {np.mean(t['scores']):.2f} "
        f"| {t['curve'][-1]['episodes']} | {t['cpu_s']:.0f} |"
        for t in trainings
    )
    tests = len(trainings[0]["rises"])
    return f"""\
# A reward of your own

{line(fields(PART))}

Trainings of [`train_peg_reward.py`](../../client-py/src/palmares/examples/train_peg_reward.py), one file
each; [training.md](../training.md#a-reward-of-your-own) explains them. `client-py/benchmarks/own_reward.py`
trains, draws and writes this page.

All columns are of {tests} scenes that no training has seen, without exploration, with the task's own steps of
1 ms. *Lifted*: share of the episodes at whose end the peg is more than {1000 * example.LIFTED_M:.0f} mm above
its place on the table. *Rise*: mean at the end. *Score*: mean, of 10; a lifted peg is the first point.
*Episodes*: those of the training. CPU time includes the tests.

| seed | lifted, % | rise, mm | score | episodes | CPU time, s |
|---|---|---|---|---|---|
{rows}
"""


def draw(trainings: list[dict[str, Any]], out: Path) -> None:
    """Draw rewards and lifted pegs over the episodes of the trainings."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
    for place, training in enumerate(trainings):
        episodes = [point["episodes"] for point in training["curve"]]
        style: dict[str, Any] = {"color": f"C{place}", "linewidth": 1.0, "label": f"seed {training['seed']}"}
        left.plot(episodes, [point["reward"] for point in training["curve"]], **style)
        tested = [point for point in training["curve"] if point["lifted"] is not None]
        shares = [100.0 * point["lifted"] for point in tested]
        right.plot([point["episodes"] for point in tested], shares, **style)
        last = 100.0 * example.share_lifted(training["rises"])
        right.plot(episodes[-1], last, "o", color=f"C{place}")
    left.set_title("reward of an episode", fontsize="medium")
    right.set_title("lifted pegs in 20 scenes, %; dots: in the test", fontsize="medium")
    right.set_ylim(-3.0, 103.0)
    for axis in (left, right):
        axis.set_xlabel("episodes of the training")
        axis.grid(alpha=0.3)
    left.legend(fontsize="small")
    figure.suptitle("A reward of your own: lift the peg")
    figures.save(figure, out)
    plt.close(figure)


def main() -> None:
    """Train what is missing, draw, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="1-2", help="a range (default 1-2)")
    parser.add_argument("--updates", type=int, default=example.UPDATES, help="updates of a training")
    parser.add_argument("--tests", type=int, default=100, help="test scenes (default 100)")
    parser.add_argument("--folder", type=output_folder, required=True, help="folder of the trainings")
    parser.add_argument("--output", type=output_file, required=True, help="file for the drawing, SVG")
    args = parser.parse_args()
    trainings = [trained(seed, args.updates, args.tests, args.folder) for seed in seeds(args.seeds)]
    draw(trainings, args.output)
    (args.folder / "peg.md").write_text(page(trainings))


if __name__ == "__main__":
    main()
