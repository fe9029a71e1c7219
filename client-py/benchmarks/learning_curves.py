"""Train the examples that learn, and draw their learning curves.

    pip install 'palmares[learn]'
    python learning_curves.py --train all --folder ../../docs/training --output ../../docs/pictures
    python learning_curves.py --train cem --folder ../../docs/training --output learning_cem.svg

A training is a file in the folder. It is made anew unless it is of the present engine, models and examples.
A drawing has a line for each training, or for each kind of training its mean, least and most. README.md in
the folder has the scores; those of an earlier engine are in a section of their own.

With `--train sample`, a sample is trained if the examples are those of the folder's trainings, and everything
otherwise: an engine that learns otherwise shows in the sample.
"""

from __future__ import annotations

import argparse
import importlib
import json
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from itertools import chain
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
SAMPLE, SAMPLE_SEEDS = ("cem", "lift", "sac"), range(1, 4)
"""Kinds and seeds of a sample"""
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


def spread(values: Sequence[float], digits: int = 2) -> str:
    """Return mean, least and most of a few values."""
    least, most = min(values), max(values)
    return f"{np.mean(values):.{digits}f} ({least:.{digits}f} … {most:.{digits}f})"


def shares(training: dict[str, Any]) -> tuple[float, float]:
    """Return the shares of the test scenes in which the object was lifted, and kept, in percent."""
    scores = np.array(training["scores"])
    return 100.0 * float(np.mean(scores >= 1.0)), 100.0 * float(np.mean(scores > 7.0))


Trainings = dict[str, list[dict[str, Any]]]
"""Trainings by their kind"""


def mean_rows(trainings: Trainings) -> str:
    """Return the rows of the kinds: means over the seeds."""
    out = []
    for kind, found in trainings.items():
        coarse = spread([mean(t["coarse"]) for t in found]) if found[0].get("coarse") else "–"
        lifted, kept = zip(*(shares(training) for training in found), strict=True)
        runs, cpu_s = mean([t["curve"][-1]["episodes"] for t in found]), mean([t["cpu_s"] for t in found])
        out.append(
            f"| {KINDS[kind].title} | {len(found)} | {spread([t['curve'][-1]['train'] for t in found])} "
            f"| {spread([mean(t['scores']) for t in found])} | {coarse} "
            f"| {spread(lifted, 0)} | {spread(kept, 0)} | {runs:.0f} | {cpu_s:.0f} |"
        )
    return "\n".join(out)


def seed_rows(trainings: Trainings) -> str:
    """Return the rows of the trainings."""
    out = []
    for kind, found in trainings.items():
        for training in found:
            lifted, kept = shares(training)
            out.append(
                f"| {KINDS[kind].title} | {training['seed']} | {mean(training['scores']):.2f} | {lifted:.0f} "
                f"| {kept:.0f} | {training['curve'][-1]['episodes']} | {training['cpu_s']:.0f} |"
            )
    return "\n".join(out)


def hand_rows(trainings: Trainings) -> str:
    """Return the rows of trainings with and without drawn hands."""
    out = []
    for kind in GROUPS["spread"]:
        found = [training for training in trainings.get(kind, []) if "hands" in training]
        if found:
            means = [
                spread([mean(scores) for scores in column])
                for column in (
                    [t["scores"] for t in found],
                    [t["hands"]["strong"] for t in found],
                    [t["hands"]["drawn"] for t in found],
                )
            ]
            out.append(f"| {KINDS[kind].title} | {' | '.join(means)} |")
    return "\n".join(out)


def page(folder: Path) -> str:
    """Return the page of all trainings in a folder, with a section for those of an earlier engine."""
    plans = [json.loads(path.read_text()) for path in folder.glob("mppi_*.json")]
    plans.sort(key=lambda plan: int(plan["seed"]))
    sections = []
    for now, title in ((True, "Learning curves"), (False, "Trainings of an earlier engine")):
        of_engine = {
            kind: [t for t in of_kind(kind, folder) if is_current(t, KINDS[kind].module) == now]
            for kind in KINDS
        }
        trainings = {kind: found for kind, found in of_engine.items() if found}
        planning = [plan for plan in plans if is_current(plan, "mppi_grasp") == now]
        if trainings or planning:
            # Of several earlier engines, the oldest training has a name.
            records = [*chain.from_iterable(trainings.values()), *planning]
            record = fields(PART) if now else min(records, key=lambda made: made["date"])
            sections.append(section(title, line(record), trainings, planning))
    return "\n".join(sections)


def section(title: str, record: str, trainings: Trainings, planning: list[dict[str, Any]]) -> str:
    """Return a section of the page."""
    text = f"""\
# {title}

{record}
"""
    if trainings:
        text += f"""
Trainings of the examples in [training.md](../training.md#examples-that-learn), one file each.
`client-py/benchmarks/learning_curves.py --train all` trains, draws and writes this page.

## Means over the seeds

Each cell has the mean over the trainings, and in brackets the least and the most. *At the end*: score of
the last update's runs, with exploration. *Score*: 100 test scenes with unseen objects, without
exploration, with the task's own steps of 1 ms. *5 ms*: the first 25 of them with the long steps of the
training. *Lifted*: share of the 100 scenes in which the hand lifted the object. *Kept*: through the
shake, too. CPU time includes the tests.

| training | seeds | at the end | score | 5 ms | lifted, % | kept, % | runs | CPU time, s |
|---|---|---|---|---|---|---|---|---|
{mean_rows(trainings)}
"""
    if hands := hand_rows(trainings):
        text += f"""
## Drawn hands

Scores of the grasps found by cross-entropy: with the hand of the training (100 scenes), with the stronger
motor (`{STRONG}`, {HAND_TESTS} scenes), and with hands drawn from the ranges of the `hand.toml`
({HAND_TESTS} scenes).

| training | `{HAND}` | `{STRONG}` | drawn hands |
|---|---|---|---|
{hands}
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
    if trainings:
        text += f"""
## Each training

| training | seed | score | lifted | kept | runs | CPU time, s |
|---|---|---|---|---|---|---|
{seed_rows(trainings)}
"""
    return text


def is_drawn(group: str, folder: Path) -> bool:
    """Whether the folder has trainings of the present engine alone for a drawing."""
    return all(
        (found := of_kind(kind, folder)) and all(is_current(t, KINDS[kind].module) for t in found)
        for kind in GROUPS[group]
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
        beyond = [[means.mean() - means.min()], [means.max() - means.mean()]]
        right.errorbar(place + 0.15, means.mean(), beyond, fmt="o", color=colour, capsize=3)
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


def controllers_are_known(folder: Path) -> bool:
    """Whether the folder has a training of each kind with the present examples, of whatever engine."""
    return all(
        any(
            training["models"]["controllers"] == fields_of(kind.module)["models"]["controllers"]
            for training in of_kind(name, folder)
        )
        for name, kind in KINDS.items()
    )


def wanted(train: str, text: str, folder: Path) -> list[tuple[str, int]]:
    """Return kinds and seeds of what is to be trained."""
    if train == "sample" and controllers_are_known(folder):
        return [(kind, seed) for kind in SAMPLE for seed in SAMPLE_SEEDS]
    kinds = list(KINDS) if train in ("all", "sample") else GROUPS[train]
    return [(kind, seed) for kind in kinds for seed in seeds(text)]


def main() -> None:
    """Train what is missing, draw, and write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    several = ("all", "sample")
    parser.add_argument("--train", choices=[*GROUPS, *several], required=True, help="what to train")
    parser.add_argument("--seeds", default="1-5", help="a range (default 1-5)")
    parser.add_argument("--updates", type=int, help="updates of a training (default: that of the example)")
    parser.add_argument("--folder", type=output_folder, required=True, help="folder of the trainings")
    parser.add_argument(
        "--output", type=Path, required=True, help="file for the drawing, SVG; a folder for several drawings"
    )
    args = parser.parse_args()
    (output_folder if args.train in several else output_file)(args.output)
    with ProcessPoolExecutor() as pool:
        made = [
            pool.submit(trained, kind, seed, args.updates, args.folder)
            for kind, seed in wanted(args.train, args.seeds, args.folder)
        ]
        for training in made:
            training.result()
    for group in GROUPS if args.train in several else [args.train]:
        if group == "mppi":
            planned(args.folder)
        elif is_drawn(group, args.folder):
            out = args.output / f"learning_{group}.svg" if args.train in several else args.output
            draw(group, args.folder, out)
        else:
            print(f"{TITLES[group]}: not drawn anew, trainings of an earlier engine are among its own")
    (args.folder / "README.md").write_text(page(args.folder))


if __name__ == "__main__":
    main()
