"""Play every example controller with longer steps of the physics and write the mean scores into the docs.

    python longer_steps.py                            all of them, with the seeds 5001 to 5020
    python longer_steps.py --only shelf_softhand      one; the other lines stay
    python longer_steps.py --for-s 240                stops after four minutes; the next call continues

The controllers decide as with the task's own step; only the physics is coarser. Finished runs are stored in
`target/longer_steps`, under a digest of engine, task, hand and controllers.
"""

from __future__ import annotations

import hashlib
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from controllers import options_of
from record import ROOT, fields, line, models

from palmares.evaluate import Job, Played
from palmares.evaluate.play import play
from palmares.evaluate.report import short_name
from palmares.evaluate.statistics import Spread
from palmares.program.evaluate import seeds
from palmares.sim import identity

EXAMPLES = "client-py/src/palmares/examples"
KEPT = ROOT / "target/longer_steps"
DOCUMENT = ROOT / "docs/training.md"
BEGIN = "<!-- longer steps: written by client-py/benchmarks/longer_steps.py; do not edit -->"
END = "<!-- end of longer steps -->"
TASKS = ("balls", "grasp", "pan", "peg", "shelf")
HANDS = ("reflex", "softhand")
OWN_TASK = ("grasp_arm",)
"""Examples that play a task of their own"""
STEPS_MS = (1.0, 2.0, 4.0)
"""Steps; the first is the tasks' own"""
HEADER = "| controller | sensing | seeds | " + " | ".join(f"{step:g} ms" for step in STEPS_MS) + " |"
ABOUT = """\
Mean scores of the example controllers, with 95 % intervals of the mean by bootstrap over the scenes. The
controllers are those of the task's own step of 1 ms. `client-py/benchmarks/longer_steps.py` plays and writes
the table."""


def controllers() -> dict[str, Path]:
    """Return the examples that play a task of the program, by name."""
    found = [path for task in TASKS for path in sorted((ROOT / EXAMPLES).glob(f"{task}_*.py"))]
    return {path.stem: path for path in found if path.stem not in OWN_TASK}


def record() -> dict[str, Any]:
    """Return what the runs depend on, and where they are played."""
    named = [f"{EXAMPLES}/{path.name}" for path in controllers().values()]
    part = {"hands": HANDS, "tasks": TASKS, "controllers": [*named, "client-py/src/palmares/skills"]}
    return fields("controllers") | {"models": models(part, identity())}


def kept(file: Path) -> dict[int, Played]:
    """Return the stored runs, by seed."""
    rows = file.read_text().splitlines() if file.exists() else []
    return {run.seed: run for run in (Played(**json.loads(row)) for row in rows)}


def played(name: str, step_ms: float, wanted: range | list[int], file: Path, until: float) -> list[Played]:
    """Play the missing runs of a controller with a step; return those of the seeds that are there."""
    runs = kept(file)
    for seed in wanted:
        if seed in runs or time.monotonic() > until:
            continue
        job = Job(str(controllers()[name]), None, None, seed, step_ms=step_ms)
        run = play(job)
        runs[seed] = run
        with file.open("a") as out:
            print(json.dumps(asdict(run)), file=out)
        result = run.error or f"{run.score:g}"
        print(f"{name}: {step_ms:g} ms, seed {seed}: {result}, {run.wall_s:.1f} s", file=sys.stderr)
    return [runs[seed] for seed in wanted if seed in runs]


def row(name: str, which: str, by_step: list[list[Played]]) -> str:
    """Return a line of the table."""
    cells = []
    for runs in by_step:
        spread = Spread.of([run.score for run in runs])
        low, high = spread.interval
        failed = sum(run.error is not None for run in runs)
        cells.append(f"{spread.mean:.2f} ({low:.2f} … {high:.2f})" + (f", {failed} failed" if failed else ""))
    sensing = next((run.sensing for runs in by_step for run in runs if run.error is None), "?")
    return f"| {' | '.join([short_name(name), sensing, which, *cells])} |"


def outside(table: list[str]) -> str:
    """Return a sentence on the means that longer steps move out of the interval of the tasks' own step."""
    moved, means = [], 0
    for text in table:
        name, _, _, own, *longer = text.strip("| ").split(" | ")
        low, high = (float(x) for x in own.partition("(")[2].partition(")")[0].split(" … "))
        for cell, step in zip(longer, STEPS_MS[1:], strict=True):
            means += 1
            if not low <= float(cell.partition(" ")[0]) <= high:
                moved.append(f"{name} at {step:g} ms")
    tail = f": {', '.join(moved)}" if moved else ""
    return (
        f"Of {means} means with longer steps, {len(moved) or 'none'} are outside the interval of 1 ms{tail}; "
        "so few scenes\ndo not show smaller differences."
    )


def write(document: Path, lines: dict[str, str], record_line: str) -> None:
    """Write lines of the table, by controller, into the document; the other lines stay."""
    before, _, rest = document.read_text().partition(BEGIN)
    old, _, after = rest.partition(END)
    if not after:
        sys.exit(f"{document}: wanted the lines {BEGIN} and {END}")
    kept_rows = [text for text in old.splitlines() if text.startswith("| ")][1:]
    lines = {text.split(" | ")[0].removeprefix("| "): text for text in kept_rows} | lines
    table = [lines[name] for name in controllers() if name in lines]
    rule = "|" + (HEADER.count("|") - 1) * "---|"
    parts = ["", record_line, "", f"{ABOUT} {outside(table)}", "", HEADER, rule, *table, ""]
    document.write_text(before + BEGIN + "\n".join(parts) + END + after)


def main() -> None:
    """Play the missing runs and write the table."""
    known = controllers()
    options = options_of(__doc__, known, "5001-5020", DOCUMENT)
    KEPT.mkdir(parents=True, exist_ok=True)
    until = time.monotonic() + options.for_s
    about = record()
    depends = json.dumps([about["engine"], about["models"]])
    digest = hashlib.sha256(depends.encode()).hexdigest()[:12]
    lines = {}
    wanted = list(seeds(options.seeds))
    for name in options.only or known:
        by_step = [
            played(name, step, wanted, KEPT / f"{name}-{step:g}ms-{digest}.jsonl", until) for step in STEPS_MS
        ]
        if any(len(runs) < len(wanted) for runs in by_step):
            print(f"{name}: runs are missing; call again", file=sys.stderr)
            continue
        lines[short_name(name)] = row(name, options.seeds, by_step)
    if lines:
        write(options.output, lines, line(about))
    print("\n".join([HEADER, *lines.values()]))


if __name__ == "__main__":
    main()
