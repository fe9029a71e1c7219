"""Train the examples that learn, and draw their learning curves.

    pip install 'palmares[learn]'
    python learning_curves.py --train all --folder ../../docs/training --output ../../docs/pictures
    python learning_curves.py --train cem --folder ../../docs/training --output learning_cem.svg

A training is a file in the folder. It is made anew unless it is of the present engine, models and examples.
A drawing has a line for each training, or for each kind of training its mean and 95 % interval. README.md in
the folder has the scores.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import fmean as mean
from typing import Any

import figures
import numpy as np
from record import ROOT, controllers, fields, line

from palmares import Training
from palmares.arrays import Array
from palmares.examples import mppi_grasp, train_grasp_cem
from palmares.examples._grasp_runs import HAND, TASK, test_scenes
from palmares.outputs import output_file, output_folder
from palmares.program.evaluate import seeds
from palmares.sim import Batch

PART = "training"
STRONG = "softhand_strong"
HAND_TESTS = 40
"""Test scenes with each other hand"""
PLANS, HORIZON, LIMIT_S = 16, 5, 20.0
"""Plans of `mppi_grasp`, their actions, and time of a run"""
T_95 = {2: 12.71, 3: 4.30, 4: 3.18, 5: 2.78, 6: 2.57, 7: 2.45, 8: 2.36, 9: 2.31, 10: 2.26}
"""Student's t of a two-sided 95 % interval, by the number of values"""


@dataclass(frozen=True)
class Kind:
    """A kind of training."""

    title: str
    module: str
    options: dict[str, Any] = field(default_factory=dict)


KINDS = {
    "cem": Kind("one grasp by cross-entropy", "train_grasp_cem"),
    "lift": Kind("a policy from sensors, by PPO", "train_lift_sb3"),
    "sac": Kind("SAC, shaped", "train_lift_shaped", {"learner": "sac"}),
    "sac_score": Kind("SAC, score alone", "train_lift_shaped", {"learner": "sac", "shaping": False}),
    "ppo": Kind("PPO, shaped", "train_lift_shaped", {"learner": "ppo"}),
    "ppo_score": Kind("PPO, score alone", "train_lift_shaped", {"learner": "ppo", "shaping": False}),
    "sac_curriculum": Kind(
        "SAC, score alone, curriculum",
        "train_lift_shaped",
        {"learner": "sac", "shaping": False, "curriculum": True},
    ),
    "ppo_curriculum": Kind(
        "PPO, score alone, curriculum",
        "train_lift_shaped",
        {"learner": "ppo", "shaping": False, "curriculum": True},
    ),
    "cem_spread": Kind("one grasp by cross-entropy, drawn hands", "train_grasp_cem", {"randomise": True}),
}
"""By the names of their files"""
GROUPS = {
    "cem": ["cem"],
    "lift": ["lift"],
    "shaped": ["sac", "sac_score", "ppo", "ppo_score"],
    "curriculum": ["sac_score", "sac_curriculum", "ppo_score", "ppo_curriculum"],
    "spread": ["cem", "cem_spread"],
    "mppi": [],
}
"""Kinds of a drawing; planning learns nothing and has none"""
TITLES = {
    "cem": "One grasp by cross-entropy",
    "lift": "A policy from sensors, by PPO",
    "shaped": "Shaped rewards and the score alone",
    "curriculum": "A curriculum of starts, score alone",
    "spread": "Drawn hands",
}


def fields_of(module: str) -> dict[str, Any]:
    """Return the fields of a record; its controllers are this example and what it imports."""
    record = fields(PART)
    names = ["_grasp_runs", "_training", "train_grasp_cem", module]
    files = [f"client-py/src/palmares/examples/{name}.py" for name in dict.fromkeys(names)]
    record["models"]["controllers"] = controllers(ROOT, files)
    return record


def is_current(known: dict[str, Any], module: str) -> bool:
    """Whether a record is of the present engine and models."""
    record = fields_of(module)
    return all(known.get(key) == record[key] for key in ("engine", "models"))


def current(file: Path, module: str) -> dict[str, Any] | None:
    """Return a file's record if it is of the present engine and models."""
    known: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    return known if is_current(known, module) else None


def trained(kind: str, seed: int, updates: int | None, folder: Path) -> dict[str, Any]:
    """Return a training, which is made if the folder has none of the present engine."""
    file = folder / f"{kind}_{seed}.json"
    if known := current(file, KINDS[kind].module):
        return known
    module = importlib.import_module(f"palmares.examples.{KINDS[kind].module}")
    options = KINDS[kind].options | ({} if updates is None else {"updates": updates})
    with tempfile.TemporaryDirectory() as scratch:
        policy, begun_s = Path(scratch) / "policy", time.process_time()
        learned = module.train(seed, threads=1, policy=policy, **options)
        made = asdict(learned) | {"cpu_s": round(time.process_time() - begun_s, 1)}
        made |= fields_of(KINDS[kind].module)
        if kind in GROUPS["spread"]:
            made["grasp"] = list(json.loads(policy.read_text()).values())
            made["hands"] = with_hands(np.array(made["grasp"]))
    file.write_text(json.dumps(made) + "\n")
    print(f"{file.name}: {np.mean(made['scores']):.2f} in {made['cpu_s']:.0f} s of CPU time", flush=True)
    return made


def with_hands(grasp: Array) -> dict[str, list[float]]:
    """Return the scores of a grasp in test scenes with other hands."""
    scenes, drawn = test_scenes(HAND_TESTS), Training(randomise=["hand"])
    batches = {
        "strong": Batch(TASK, STRONG, HAND_TESTS, threads=1),
        "drawn": Batch(TASK, HAND, HAND_TESTS, threads=1, training=drawn),
    }
    grasps = np.tile(grasp, (HAND_TESTS, 1))
    return {name: train_grasp_cem.play(batch, scenes, grasps).tolist() for name, batch in batches.items()}


def planned(folder: Path, count: int = 5) -> list[dict[str, Any]]:
    """Return score and pace of planning in the first test scenes, played where the folder has none."""
    found = []
    for seed in test_scenes(count):
        file = folder / f"mppi_{seed}.json"
        known = current(file, "mppi_grasp")
        if known is None:
            score, pace = mppi_grasp.play(seed, PLANS, HORIZON, LIMIT_S, 2)
            known = {"seed": seed, "score": score, "pace": pace} | fields_of("mppi_grasp")
            file.write_text(json.dumps(known) + "\n")
            print(f"{file.name}: {score:.2f}", flush=True)
        found.append(known)
    return found


def of_kind(kind: str, folder: Path) -> list[dict[str, Any]]:
    """Return the trainings of a kind in a folder, by their seeds."""
    found = [json.loads(path.read_text()) for path in folder.glob(f"{kind}_[0-9]*.json")]
    return sorted(found, key=lambda training: int(training["seed"]))


def half_interval(values: Sequence[float] | Array) -> float | None:
    """Return half of the 95 % interval of a mean; ``None`` for numbers of values without a t."""
    if len(values) not in T_95:
        return None
    return T_95[len(values)] * float(np.std(values, ddof=1)) / math.sqrt(len(values))


def interval(values: Sequence[float], digits: int = 2) -> str:
    """Return the mean and half of its 95 % interval."""
    half = half_interval(values)
    return f"{np.mean(values):.{digits}f}" + ("" if half is None else f" ± {half:.{digits}f}")


def shares(training: dict[str, Any]) -> tuple[float, float]:
    """Return the shares of the test scenes in which the object was lifted, and kept, in percent."""
    scores = np.array(training["scores"])
    return 100.0 * float(np.mean(scores >= 1.0)), 100.0 * float(np.mean(scores > 7.0))


def mean_rows(folder: Path) -> str:
    """Return the rows of the kinds: means over the seeds."""
    out = []
    for kind in KINDS:
        found = of_kind(kind, folder)
        if not found:
            continue
        coarse = interval([mean(t["coarse"]) for t in found]) if found[0].get("coarse") else "–"
        lifted, kept = zip(*(shares(training) for training in found), strict=True)
        runs, cpu_s = mean([t["curve"][-1]["episodes"] for t in found]), mean([t["cpu_s"] for t in found])
        out.append(
            f"| {KINDS[kind].title} | {len(found)} | {interval([t['curve'][-1]['train'] for t in found])} "
            f"| {interval([mean(t['scores']) for t in found])} | {coarse} "
            f"| {interval(lifted, 0)} | {interval(kept, 0)} | {runs:.0f} | {cpu_s:.0f} |"
        )
    return "\n".join(out)


def seed_rows(folder: Path) -> str:
    """Return the rows of the trainings."""
    out = []
    for kind in KINDS:
        for training in of_kind(kind, folder):
            lifted, kept = shares(training)
            out.append(
                f"| {KINDS[kind].title} | {training['seed']} | {mean(training['scores']):.2f} | {lifted:.0f} "
                f"| {kept:.0f} | {training['curve'][-1]['episodes']} | {training['cpu_s']:.0f} |"
            )
    return "\n".join(out)


def hand_rows(folder: Path) -> str:
    """Return the rows of trainings with and without drawn hands."""
    out = []
    for kind in GROUPS["spread"]:
        found = [training for training in of_kind(kind, folder) if "hands" in training]
        if found:
            means = [
                interval([mean(scores) for scores in column])
                for column in (
                    [t["scores"] for t in found],
                    [t["hands"]["strong"] for t in found],
                    [t["hands"]["drawn"] for t in found],
                )
            ]
            out.append(f"| {KINDS[kind].title} | {' | '.join(means)} |")
    return "\n".join(out)


def page(folder: Path) -> str:
    """Return the page of all trainings in a folder, which must be of one engine to name it."""
    found = [(KINDS[kind].module, training) for kind in KINDS for training in of_kind(kind, folder)]
    planning = sorted(
        (json.loads(p.read_text()) for p in folder.glob("mppi_*.json")), key=lambda t: int(t["seed"])
    )
    # The oldest engine is that of the page, so that a page of two is not called that of the last.
    played = found + [("mppi_grasp", plan) for plan in planning]
    old = [record for module, record in played if not is_current(record, module)]
    record = old[0] if old else fields(PART)
    text = f"""\
# Learning curves

{line(record)}

Trainings of the examples in [training.md](../training.md#examples-that-learn), one file each.
`client-py/benchmarks/learning_curves.py --train all` trains, draws and writes this page.

## Means over the seeds

± is half of a 95 % interval of the mean over the trainings (Student's t). *At the end*: score of the last
update's runs, with exploration. *Score*: 100 test scenes with unseen objects, without exploration, with the
task's own steps of 1 ms. *5 ms*: the first 25 of them with the long steps of the training. *Lifted*: share of
the 100 scenes in which the hand lifted the object. *Kept*: through the shake, too. CPU time includes the
tests.

| training | seeds | at the end | score | 5 ms | lifted, % | kept, % | runs | CPU time, s |
|---|---|---|---|---|---|---|---|---|
{mean_rows(folder)}

## Drawn hands

Scores of the grasps found by cross-entropy: with the hand of the training (100 scenes), with the stronger
motor (`{STRONG}`, {HAND_TESTS} scenes), and with hands drawn from the ranges of the `hand.toml`
({HAND_TESTS} scenes).

| training | `{HAND}` | `{STRONG}` | drawn hands |
|---|---|---|---|
{hand_rows(folder)}
"""
    if planning:
        table = "\n".join(f"| {t['seed']} | {t['score']:.2f} | {t['pace']:.3f} |" for t in planning)
        text += f"""
## Planning

`mppi_grasp.py` with {PLANS} plans of {HORIZON * mppi_grasp.TICKS / 100:.1f} s and two threads, for at most
{LIMIT_S:.0f} s of a run. *Pace*: time of the scene over time of the planning; 1 is real time.

| scene | score | pace |
|---|---|---|
{table}
"""
    return (
        text
        + f"""
## Each training

| training | seed | score | lifted | kept | runs | CPU time, s |
|---|---|---|---|---|---|---|
{seed_rows(folder)}
"""
    )


def draw(group: str, folder: Path, out: Path) -> None:
    """Draw mean scores in training and in the test over the runs played."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(
        1, 2, sharey=True, figsize=(9, 3.6), constrained_layout=True, width_ratios=[2, 1]
    )
    for place, kind in enumerate(GROUPS[group]):
        trainings, colour = of_kind(kind, folder), f"C{place}"
        if not trainings:
            continue
        curves = [[p for p in t["curve"] if p["train"] is not None] for t in trainings]
        for curve in curves:
            runs, values = [p["episodes"] for p in curve], [p["train"] for p in curve]
            left.plot(runs, values, color=colour, linewidth=0.7, alpha=0.45)
        runs = np.mean([[p["episodes"] for p in curve] for curve in curves], axis=0)
        values = np.mean([[p["train"] for p in curve] for curve in curves], axis=0)
        left.plot(runs, values, color=colour, linewidth=2.0, label=KINDS[kind].title)
        means = np.array([np.mean(t["scores"]) for t in trainings])
        right.plot(np.full(len(means), place), means, ".", color=colour, alpha=0.6)
        right.errorbar(place + 0.15, means.mean(), half_interval(means), fmt="o", color=colour, capsize=3)
    left.set_title("training, with exploration", fontsize="medium")
    left.set_xlabel("runs played in training")
    left.set_ylabel("mean score, of 10")
    left.set_ylim(0.0, 10.2)
    left.legend(fontsize="small")
    right.set_title("test: 100 scenes, unseen objects", fontsize="medium")
    right.set_xticks(range(len(GROUPS[group])), ["" for _ in GROUPS[group]])
    right.set_xlim(-0.5, len(GROUPS[group]) - 0.3)
    for axis in (left, right):
        axis.grid(alpha=0.3)
    figure.suptitle(TITLES[group])
    figures.save(figure, out)
    plt.close(figure)


def main() -> None:
    """Train what is missing, draw, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--train", choices=[*GROUPS, "all"], required=True, help="what to train")
    parser.add_argument("--seeds", default="1-5", help="a range (default 1-5)")
    parser.add_argument("--updates", type=int, help="updates of a training (default: that of the example)")
    parser.add_argument("--folder", type=output_folder, required=True, help="folder of the trainings")
    parser.add_argument(
        "--output", type=Path, required=True, help="file for the drawing, SVG; a folder with `--train all`"
    )
    args = parser.parse_args()
    (output_folder if args.train == "all" else output_file)(args.output)
    for group in GROUPS if args.train == "all" else [args.train]:
        for kind in GROUPS[group]:
            for seed in seeds(args.seeds):
                trained(kind, seed, args.updates, args.folder)
        if group == "mppi":
            planned(args.folder)
        else:
            draw(
                group,
                args.folder,
                args.output / f"learning_{group}.svg" if args.train == "all" else args.output,
            )
    (args.folder / "README.md").write_text(page(args.folder))


if __name__ == "__main__":
    main()
