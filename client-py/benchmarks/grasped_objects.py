"""Grasp every object of the catalogue with an example and write the list of held objects into the docs.

    python grasped_objects.py                    all objects, three scenes of each
    python grasped_objects.py --only 029_plate   one; the other lines stay
    python grasped_objects.py --for-s 240        stops after four minutes; the next call continues

The scenes are those of the task grasp with one object, and more space for large ones, from a task in a
temporary folder. Finished runs are stored in `target/controllers`, under a digest of engine, hand, task and
controller.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import re
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from controllers import KEPT, ROOT
from record import fields, of_page

import palmares
from palmares.examples import grasp_softhand
from palmares.outputs import output_file

PART = "grasped"
FIRST_SEED = 5001
RUNS = 3
HELD = 6.0
"""From this score on, of 10 points, the object was lifted and held through the shake, or nearly"""
DOCUMENT = ROOT / "docs/grasped.md"
HEAD = """\
# Which objects the SoftHand can grasp

{record}

`client-py/benchmarks/grasped_objects.py` ran `grasp_softhand.py` with every object of the catalogue on
the table of the task grasp, in {runs} scenes each (seeds from {first} on). At most there are 10 points.
{held:g} and more mean that the hand lifted the object, held it for two seconds and kept it through the
shake.

*size* is the smallest upright box around the object at the start: longer side, shorter side, height.
*tries* is the mean number of attempts in a run.

"""


@dataclass(frozen=True)
class Grasped:
    """A run."""

    name: str
    seed: int
    size_mm: list[int]
    mass_kg: float
    score: float
    tries: int
    error: str = ""


def catalogue() -> list[str]:
    """Return the names of all objects."""
    files = [ROOT / "models/objects" / file for file in ("ycb.toml", "apc.toml")]
    return [entry["id"] for file in files for entry in tomllib.loads(file.read_text())["object"]]


def write_task(folder: Path, name: str) -> None:
    """Write a task with this object alone, and with space for large ones."""
    text = (ROOT / "tasks/grasp/task.toml").read_text()
    text, objects = re.subn(r"from = \[.*?\]", f'from = ["{name}"]', text, flags=re.DOTALL)
    text, region = re.subn(
        r"min = \[-0.12, -0.12, 0.0\]\nmax = \[0.12, 0.12, 0.4\]",
        "min = [-0.25, -0.25, 0.0]\nmax = [0.25, 0.25, 0.4]",
        text,
    )
    if (objects, region) != (1, 1):
        sys.exit("tasks/grasp/task.toml has changed: its objects and its region are looked for by their text")
    (folder / "task.toml").write_text(text.replace('name = "grasp"', 'name = "one_object"'))


def grasp(name: str, seed: int) -> Grasped:
    """Play a run."""
    with tempfile.TemporaryDirectory() as folder, palmares.Client("local") as client:
        write_task(Path(folder), name)
        try:
            summary = grasp_softhand.run(client, seed, task=folder)
        except palmares.PalmaresError as refused:
            return Grasped(name, seed, [], 0.0, 0.0, 0, str(refused))
        (body,) = client.scene.free
        return Grasped(name, seed, summary.size_mm, body.mass, summary.score, summary.tries)


def grasp_all(name: str) -> list[Grasped]:
    """Play the runs of an object."""
    return [grasp(name, seed) for seed in range(FIRST_SEED, FIRST_SEED + RUNS)]


def line(runs: list[Grasped]) -> str:
    """Return an object's line of the table."""
    first, scores = runs[0], [run.score for run in runs]
    if any(run.error for run in runs):
        return f"| {first.name} | | | not placed | {next(run.error for run in runs if run.error)} | |"
    size = " × ".join(map(str, first.size_mm))
    verdict = "held" if min(scores) >= HELD else "sometimes held" if max(scores) >= HELD else "**not held**"
    tries = np.mean([run.tries for run in runs])
    each = ", ".join(f"{score:.2f}" for score in scores)
    return f"| {first.name} | {size} | {1e3 * first.mass_kg:.0f} | {verdict} | {each} | {tries:.1f} |"


def write(document: Path, lines: dict[str, str]) -> None:
    """Write lines of objects into the document; the other lines stay."""
    record = of_page(document, PART, whole=lines.keys() >= set(catalogue()))
    if document.exists():
        old = [line for line in document.read_text().splitlines() if line.startswith("| ")]
        lines = {line.split(" | ")[0].removeprefix("| "): line for line in old[1:]} | lines
    table = [lines[name] for name in catalogue() if name in lines]
    header = ["| object | size, mm | mass, g | | points | tries |", "|---|---|---|---|---|---|"]
    head = HEAD.format(runs=RUNS, first=FIRST_SEED, held=HELD, record=record)
    document.write_text(head + "\n".join([*header, *table]) + "\n")


def main() -> None:
    """Play the missing runs and write the table."""
    known = catalogue()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", choices=known, action="append", metavar="NAME", help="an object's name")
    parser.add_argument("--output", type=output_file, default=str(DOCUMENT), help="the document")
    parser.add_argument("--for-s", type=float, default=math.inf, help="begin no object after this time, s")
    options = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    now = fields(PART)
    played_with = hashlib.sha256(json.dumps([now["engine"], now["models"]]).encode()).hexdigest()[:12]
    file = KEPT / f"objects-{played_with}.jsonl"
    runs: dict[str, list[Grasped]] = {}
    if file.exists():
        for kept in file.read_text().splitlines():
            run = Grasped(**json.loads(kept))
            runs.setdefault(run.name, []).append(run)
    with ProcessPoolExecutor() as pool:
        played = {pool.submit(grasp_all, name): name for name in options.only or known if name not in runs}
        for future in as_completed(played):
            if future.cancelled():
                continue
            found = runs[played[future]] = future.result()
            with file.open("a") as out:
                out.writelines(json.dumps(asdict(run)) + "\n" for run in found)
            print(line(found), file=sys.stderr, flush=True)
            if time.monotonic() - begun > options.for_s:
                pool.shutdown(wait=False, cancel_futures=True)
    write(options.output, {name: line(found) for name, found in runs.items()})
    scores = [run.score for found in runs.values() for run in found]
    print(f"{len(runs)} of {len(known)} objects, {len(scores)} runs: {np.mean(scores):.2f} points on average")


if __name__ == "__main__":
    main()
