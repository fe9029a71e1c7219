"""Play every example controller in unseen scenes and write the distribution of its scores into the docs.

    python controllers.py                             all of them, with seeds from 5001 to 5100
    python controllers.py --only shelf_softhand       one; the other lines stay
    python controllers.py --for-s 240                 stops after four minutes; the next call continues

A controller plays 20 seeds at a time, on all cores, until half of the 95 % interval of its mean is at most
3 % of the task's full score, or until the seeds end.

Finished runs are stored in `target/controllers`, under a digest of the controller's source. Before their use
the worst one is played again. If it does not end in the same state, bit for bit, something else has changed
(physics, task, `palmares.skills`), and all runs are played again. A line of the table is written after all of
its runs.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from record import of_page

from palmares.evaluate import Job, Played, Report
from palmares.evaluate.report import MARKDOWN_HEADER, short_name
from palmares.evaluate.statistics import Spread
from palmares.evaluate.workers import Pool, processes
from palmares.outputs import output_file
from palmares.program.evaluate import seeds
from palmares.server import Server

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "client-py/src/palmares"
KEPT = ROOT / "target/controllers"
DOCUMENT = ROOT / "docs/controllers.md"
PART = "controllers"
FULL = {"balls": 10.0, "grasp": 10.0, "shelf": 50.0}
"""Full scores of the tasks"""
BLOCK = 20
"""Seeds that are played before the interval is looked at again"""
SHARE = 0.03
"""Half of the interval that is enough, of the full score"""
SCRIPTS = {"balls.mjs": ROOT / "docs/examples/balls.mjs"}
NODE = ("node", "--experimental-websocket")
HEAD = """\
# Scores of the example controllers

{record}

Scores over held-out scenes, one run each, from the first of the seeds {seeds} on: 20 at a time, until
half of the 95 % interval of the mean is at most 3 % of the full score. Measure your own controller with

```
palmares evaluate my_controller.py --seeds {seeds} --markdown FILE
```

At most there are 10 points in balls and in grasp, 50 in the shelf. *95 %* is an interval of the mean, by
bootstrap over the scenes. Where all n runs end alike, up to 3 / n of all scenes may still end otherwise. If a
controller fails, the referee scores the objects where they are.
`client-py/benchmarks/controllers.py` plays and writes the table.

The scores do not depend on the processor ([why](python.md#the-same-bits-on-every-machine)). Before the table
is written, `client-py/benchmarks/processors.py` plays a run of each example as on several processors, and the
runs must end in the same states. The scores of balls.mjs are those of one version of Node.

The authors did not use the seeds {seeds}, with two exceptions. They saw the rows of earlier versions of
shelf_softhand and shelf_sensors, the first with a mean of 40.60, and then tuned both on other seeds. They
saw that grasp_sensors dropped cans, and then searched the grasp of a can anew on the seeds 1-160.

"""


def controllers() -> dict[str, Path]:
    """Return the examples that play a task, by name."""
    examples = PACKAGE / "examples"
    found = {path.stem: path for task in FULL for path in sorted(examples.glob(f"{task}_*.py"))}
    found.pop("grasp_arm")  # It plays a task of its own.
    return found | SCRIPTS


def digest(path: Path) -> str:
    """Return a digest of a file, 12 hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def play_script(path: Path, job: Job) -> Played:
    """Play a run of a controller in JavaScript on a server."""
    begun = time.perf_counter()
    command = [*NODE, str(path), "--url", job.url, "--seed", str(job.seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return Played(job.controller, "balls", "softhand", job.seed, error=done.stderr.strip()[-300:])
    result = json.loads(done.stdout)
    return Played(
        job.controller,
        result["task"],
        result["hand"],
        job.seed,
        "truth",
        result["score"],
        result["in_goal"],
        result["outside"],
        result["reason"],
        result["sim_time_s"],
        time.perf_counter() - begun,
        result["run_id"],
        result["state_hash"],
    )


def pool_of(name: str, path: Path, stack: contextlib.ExitStack) -> tuple[str, str, Pool]:
    """Return the name and address of a controller's jobs, and what plays them."""
    if name not in SCRIPTS:
        return str(path), "local", processes()
    if shutil.which(NODE[0]) is None:
        sys.exit(f"{name} needs {NODE[0]}, which is not there")
    data = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    server = stack.enter_context(Server(data))

    def pool(jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            yield from zip(jobs, threads.map(lambda job: play_script(path, job), jobs), strict=True)

    return name, server.url, pool


class Runs:
    """The runs of a controller, which a file keeps from one call to the next."""

    def __init__(self, name: str, path: Path, stack: contextlib.ExitStack) -> None:
        self.name = name
        self.file = KEPT / f"{name}-{digest(path)}.jsonl"
        self.controller, self.url, self.pool = pool_of(name, path, stack)
        self.by_seed = self.kept()

    def play(self, wanted: Iterable[int]) -> Iterator[Played]:
        """Play seeds and yield the runs as they end."""
        jobs = [Job(self.controller, None, None, seed, self.url) for seed in wanted]
        for _, run in self.pool(jobs):
            print(
                f"{self.name}: seed {run.seed}: {run.error or f'{run.score:g}'}", file=sys.stderr, flush=True
            )
            yield run

    def kept(self) -> dict[int, Played]:
        """Return the runs of the file, by seed; none if they would end differently now."""
        if not self.file.exists():
            return {}
        runs = [Played(**json.loads(line)) for line in self.file.read_text().splitlines()]
        worst = sorted(runs, key=lambda run: run.score)[:1]
        if [run.state_hash for run in self.play(run.seed for run in worst)] != [
            run.state_hash for run in worst
        ]:
            print(f"{self.file.name}: its runs end differently now; they are played again", file=sys.stderr)
            self.file.unlink()
            return {}
        return {run.seed: run for run in runs}

    def until_known(self, wanted: Sequence[int], full: float, end: float) -> list[Played] | None:
        """Play blocks of seeds until the mean is known; return the runs, or none if the time ends before."""
        for last in range(BLOCK, len(wanted) + BLOCK, BLOCK):
            block = wanted[:last]
            missing = [seed for seed in block if seed not in self.by_seed]
            if missing and time.monotonic() > end:
                return None
            for run in self.play(missing):
                self.by_seed[run.seed] = run
                with self.file.open("a") as out:
                    print(json.dumps(asdict(run)), file=out)
            runs = [self.by_seed[seed] for seed in block]
            if is_known([run.score for run in runs], full):
                break
        return runs


def is_known(scores: Sequence[float], full: float) -> bool:
    """Return whether half of the interval of a mean is at most its share of the full score."""
    low, high = Spread.of(scores).interval
    return (high - low) / 2.0 <= SHARE * full


def write(document: Path, lines: dict[str, str], played: str) -> None:
    """Write lines of the table, by controller, into the document; the other lines stay."""
    names = list(controllers())
    record = of_page(document, PART, whole=lines.keys() >= {short_name(name) for name in names})
    if document.exists():
        old = [line for line in document.read_text().splitlines() if line.startswith("| ")]
        lines = {line.split(" | ")[0].removeprefix("| "): line for line in old[1:]} | lines
    table = [lines[name] for name in names if name in lines]
    head = HEAD.format(seeds=played, record=record)
    document.write_text(head + "\n".join([*MARKDOWN_HEADER, *table]) + "\n")


def options_of(doc: str | None, known: Iterable[str], wanted: str, document: Path) -> argparse.Namespace:
    """Return the options of a benchmark that plays `known` controllers with `wanted` seeds for a document."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=known, action="append", metavar="NAME", help=", ".join(known))
    parser.add_argument("--seeds", default=wanted, help=f"a range (default {wanted})")
    parser.add_argument("--output", type=output_file, default=str(document), help="the document")
    parser.add_argument("--for-s", type=float, default=math.inf, help="begin no run after this time, s")
    return parser.parse_args()


def main() -> None:
    """Play the missing runs and write the table."""
    known = controllers()
    options = options_of(__doc__, known, "5001-5100", DOCUMENT)
    KEPT.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    lines = {}
    for name in options.only or known:
        # Every example says its task first in its name.
        full = next(full for task, full in FULL.items() if name.startswith(task))
        with contextlib.ExitStack() as stack:
            runs = Runs(name, known[name], stack)
            played = runs.until_known(seeds(options.seeds), full, begun + options.for_s)
        if played is None:
            print(f"{name}: not all of its runs are played; call again", file=sys.stderr)
            continue
        (row,) = Report.of(played).rows
        lines[short_name(name)] = row.markdown()
    if lines:
        write(options.output, lines, options.seeds)
    print("\n".join([*MARKDOWN_HEADER, *lines.values()]))


if __name__ == "__main__":
    main()
