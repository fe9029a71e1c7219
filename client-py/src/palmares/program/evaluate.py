"""``palmares evaluate``: play controllers in many scenes and report their scores."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

from tqdm import tqdm

from palmares.arguments import MAX_SEED
from palmares.errors import PalmaresError
from palmares.evaluate import MAX_SEEDS, ControllerError, Played, Pool, Report, evaluate, processes
from palmares.outputs import output_file, output_folder

EXAMPLES = """\
A controller is a Python file, or a module, with a function run(client, seed), which opens a run with
client.reset(..., seed=seed), plays it and ends it with client.stop(). Parameters named task and hand
are passed to it.

examples:
  palmares evaluate my_controller.py
  palmares evaluate my_controller.py --tasks balls,shelf --hands softhand --seeds 5001-5100
  palmares evaluate new.py old.py --scenes 200                   compares them in the same scenes
  palmares evaluate palmares.examples.balls_softhand --replays worst/
  palmares evaluate my_controller.py --url http://127.0.0.1:8080   on a server
  palmares evaluate my_controller.py --hand-spread    with hands drawn from the ranges of [uncertain]
  palmares evaluate my_controller.py --ray            on the machines of a Ray cluster
Ctrl-C ends it with a report of the finished runs and names the open ones."""


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code: 1 when a run failed."""
    options = parser().parse_args(list(separated(arguments)))
    per_controller = max(1, len(options.tasks)) * max(1, len(options.hands)) * len(options.seeds)
    per_controller *= max(1, options.hand_spread)
    total = per_controller * len(options.controllers)
    bar = tqdm(total=total, unit="run", file=sys.stderr, disable=options.quiet)
    outcomes: list[Played] = []

    def on_played(played: Played) -> None:
        outcomes.append(played)
        bar.update()
        if played.error is not None:
            bar.write(f"seed {played.seed} failed: {played.error}", file=sys.stderr)

    interrupted = False
    try:
        with bar:
            report = evaluate(
                options.controllers,
                options.tasks,
                options.hands,
                options.seeds,
                url=options.url,
                replays=options.replays,
                hand_spread=options.hand_spread,
                step_ms=options.step_ms,
                pool=pool(options),
                on_played=on_played,
            )
    except (ControllerError, PalmaresError, OSError, ImportError) as error:
        print(f"palmares evaluate: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt as stop:
        print(f"palmares evaluate: interrupted after {len(outcomes)} of {total} runs", file=sys.stderr)
        for note in getattr(stop, "__notes__", []):
            print(f"open: {note}", file=sys.stderr)
        report, interrupted = Report.of(outcomes), True
    failed = any(row.failed for row in report.rows)
    if outcomes:
        # First of all: whatever fails below, the runs were played.
        failed |= not printed(report.json() if options.json else str(report))
        try:
            if options.replays is not None:
                keep_worst(report)
            if options.markdown is not None:
                options.markdown.write_text(report.markdown(), encoding="utf-8")
        except OSError as error:
            print(f"palmares evaluate: {error}", file=sys.stderr)
            failed = True
    return 130 if interrupted else int(failed)


def printed(text: str) -> bool:
    """Print a report; where standard output takes nothing more, as on a full disk, on standard error."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        print(text, f"palmares evaluate: standard output: {error}", sep="\n", file=sys.stderr)
        return False
    return True


def pool(options: argparse.Namespace) -> Pool:
    """Return the pool of the chosen processes or cluster."""
    if options.ray is None:
        return processes(options.jobs, options.timeout_s)
    if options.timeout_s is not None:
        raise ControllerError("--timeout-s is for the processes of this machine, without --ray")
    from palmares import ray

    return ray.pool(options.ray or None)


def keep_worst(report: Report) -> None:
    """Remove the replays of all but the worst runs."""
    for row in report.rows:
        named = {run.replay for run in row.worst()}
        for run in row.runs:
            if run.replay is not None and run.replay not in named:
                Path(run.replay).unlink(missing_ok=True)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares evaluate",
        description="Play controllers in many scenes and print statistics of their scores.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument("controllers", nargs="+", metavar="CONTROLLER", help="a Python file or a module's name")
    made.add_argument(
        "--tasks", type=words, default=[], metavar="A,B", help="tasks (default: the controller's own)"
    )
    made.add_argument(
        "--hands",
        "--hand",
        type=words,
        default=[],
        metavar="A,B",
        help="hands (default: the controller's own)",
    )
    scenes = made.add_mutually_exclusive_group()
    scenes.add_argument(
        "--scenes",
        type=count_of_seeds,
        dest="seeds",
        default=range(1, 101),
        metavar="N",
        help="how many scenes, with the seeds from 1 to N (default 100)",
    )
    # A single number is the old way to write --scenes.
    scenes.add_argument(
        "--seeds",
        type=seeds,
        metavar="WHICH",
        help="seeds of the scenes: a range, 5001-5100, or a list, 3,5,8",
    )
    made.add_argument(
        "--step-ms",
        type=float,
        metavar="MS",
        help="longest step of the physics, from the task's own to 10: 2 and 4 are quicker and less exact",
    )
    made.add_argument(
        "--hand-spread",
        nargs="?",
        type=positive,
        const=1,
        default=0,
        metavar="N",
        help="play N drawn hands in each scene (default 1), from the ranges of [uncertain] in hand.toml, "
        "and print what the score hangs on; 300 runs or more show effects of half a standard deviation",
    )
    made.add_argument("--url", default="local", help="a server (default: local, without one)")
    where = made.add_mutually_exclusive_group()
    where.add_argument("--jobs", type=positive, metavar="N", help="runs at once (default: one for each core)")
    where.add_argument(
        "--ray",
        nargs="?",
        const="",
        metavar="ADDRESS",
        help="play on a Ray cluster, one run on each core; without ADDRESS on the cluster of this machine, "
        "or on a new one of this machine alone",
    )
    made.add_argument(
        "--timeout-s",
        type=seconds,
        metavar="S",
        help="longest time of a run; a longer one has failed and counts 0 (default: no limit)",
    )
    made.add_argument(
        "--replays",
        type=output_folder,
        metavar="FOLDER",
        help="folder for the replays of the worst runs; without --url every run is then played twice",
    )
    made.add_argument("--markdown", type=output_file, metavar="FILE", help="file for the table, in Markdown")
    made.add_argument("--json", action="store_true", help="print everything as JSON")
    made.add_argument("--quiet", action="store_true", help="no progress bar")
    return made


def separated(arguments: Sequence[str]) -> Iterator[str]:
    """Yield the arguments; ``--ray`` before something other than an address becomes ``--ray=``.

    An address has a colon, or is ``auto`` or ``local``. Anything else after ``--ray`` is a controller. So is
    anything but a number after ``--hand-spread``.
    """
    for word, following in zip_longest(arguments, arguments[1:], fillvalue=""):
        address = ":" in following or following in ("auto", "local")
        if word == "--hand-spread" and not following.isdecimal():
            word = "--hand-spread=1"
        yield "--ray=" if word == "--ray" and not address else word


def words(text: str) -> list[str]:
    """Read names separated by commas."""
    return [word for word in text.split(",") if word]


def positive(text: str) -> int:
    """Read a number of at least 1."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"found {text}; wanted at least 1")
    return number


def seconds(text: str) -> float:
    """Read a time above 0."""
    number = float(text)
    if not 0.0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"found {text}; wanted a time above 0, s")
    return number


def count_of_seeds(text: str) -> range:
    """Read a number of scenes; return their seeds."""
    count = positive(text)
    if count > MAX_SEEDS:
        raise argparse.ArgumentTypeError(f"found {count} scenes; wanted at most {MAX_SEEDS}")
    return range(1, count + 1)


def seeds(text: str) -> Sequence[int]:
    """Read ``5001-5100`` or ``3,5,8``; a single number N stands for ``1-N``."""
    found: Sequence[int]
    try:
        if "," in text:
            found = [int(word) for word in text.split(",") if word]
        elif "-" in text:
            first, last = map(int, text.split("-"))
            found = _range(first, last)
        else:
            found = _range(1, int(text))
    except ValueError:
        found = []
    if len(found) > MAX_SEEDS:
        raise argparse.ArgumentTypeError(f"found {len(found)} seeds; wanted at most {MAX_SEEDS}")
    if not found or min(found) < 0 or max(found) > MAX_SEED:
        raise argparse.ArgumentTypeError(
            f"found {text!r}; wanted a number, a range as 5001-5100, or a list as 3,5,8"
        )
    return found


def _range(first: int, last: int) -> range:
    if last > MAX_SEED:
        raise ValueError("larger than any seed")
    return range(first, last + 1)
