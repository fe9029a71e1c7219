"""``palmares demo``: a practice server, one run of an example controller, and the leaderboard."""

from __future__ import annotations

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from palmares.errors import PalmaresError
from palmares.net import http
from palmares.outputs import output_folder
from palmares.server import Server

# For each task: the example's module, the field of its summary with a number of objects or a list of goals,
# and what these are and where.
CONTROLLERS = {
    "balls": ("balls_softhand", "balls_in_b", "ball", "in box B"),
    "shelf": ("shelf_softhand", "in_box", "object", "in the box"),
    "grasp": ("grasp_softhand", "kept", "object", "still in the hand after the shake"),
    "pan": ("pan_softhand", "goals", "goal", "reached"),
    "peg": ("peg_softhand", "goals", "goal", "reached"),
}


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(arguments)
    try:
        with data_folder(options.data_dir) as data, Server(data, program=options.program) as server:
            print(
                f"a practice server listens on {server.url}; {server.url}/live shows the run",
                file=sys.stderr,
            )
            print(
                f"an example controller plays {options.task} with the SoftHand, scene {options.seed}",
                file=sys.stderr,
            )
            outcome = play(server.url, options.task, options.seed)
            rows = http.get_object(server.url, "/v1/leaderboard")["rows"]
            run_id = outcome["run_id"]
            replay = options.replay / f"{run_id}.mcap"
            replay.write_bytes(http.get(server.url, f"/v1/runs/{run_id}/replay"))
            write = summary if options.json else in_words
            print(write(options.task, outcome, rows, replay), flush=True)
            if options.stay:
                note(f"leaderboard and replay: {server.url}/ (Ctrl-C ends the server)")
                server.wait()
    except (PalmaresError, OSError, DemoError) as error:
        note(f"palmares demo: {error}")
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def note(text: str) -> None:
    """Print a line for people on standard error."""
    print(text, file=sys.stderr, flush=True)


class DemoError(Exception):
    """The controller failed."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares demo",
        description="Start a practice server, play one run with an example controller, "
        "print the score and the leaderboard, and end the server.",
    )
    made.add_argument("--task", choices=list(CONTROLLERS), default="balls", help="task (default balls)")
    made.add_argument("--seed", type=int, default=1, help="scene (default 1)")
    made.add_argument("--stay", action="store_true", help="keep the server running, to look at its pages")
    made.add_argument(
        "--json", action="store_true", help="print the outcome as one JSON object, on the last line"
    )
    made.add_argument(
        "--replay",
        type=output_folder,
        default=".",
        metavar="FOLDER",
        help="folder for the replay (default here)",
    )
    made.add_argument(
        "--data-dir",
        type=output_folder,
        metavar="FOLDER",
        help="folder for the server's database and log, also for `palmares serve --data-dir FOLDER`",
    )
    made.add_argument("--program", help="the palmares program (default: the one of this package)")
    return made


@contextlib.contextmanager
def data_folder(wanted: Path | None) -> Iterator[Path]:
    """Give the wanted folder, or a temporary one."""
    if wanted is not None:
        yield wanted
        return
    with tempfile.TemporaryDirectory(prefix="palmares-demo-") as folder:
        yield Path(folder)


def play(url: str, task: str, seed: int) -> dict[str, Any]:
    """Play with the example, whose progress goes to standard error; return its summary."""
    module = CONTROLLERS[task][0]
    command = [
        sys.executable,
        "-m",
        f"palmares.examples.{module}",
        "--json",
        "--url",
        url,
        "--seed",
        str(seed),
    ]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise DemoError(f"the example failed with exit code {done.returncode}; see the messages above")
    outcome: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return outcome


def summary(task: str, outcome: dict[str, Any], rows: list[dict[str, Any]], replay: Path) -> str:
    """Return the outcome for programs."""
    field = CONTROLLERS[task][1]
    chosen = {name: outcome[name] for name in ("score", field, "run_id", "rtf")}
    return json.dumps({**chosen, "leaderboard": rows, "replay": str(replay)})


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the singular for one."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def in_words(task: str, outcome: dict[str, Any], rows: list[dict[str, Any]], replay: Path) -> str:
    """Return the outcome for people."""
    _, field, noun, place = CONTROLLERS[task]
    found = outcome[field]
    number = len(found) if isinstance(found, list) else found
    lines = [
        f"score {outcome['score']:g}: {counted(number, noun)} {place}, run {outcome['run_id']}",
        f"{outcome['sim_time_s']:.1f} s simulated, {outcome['rtf']:.1f} times as fast as real time",
        f"replay: {replay} (`palmares verify` plays it again, Foxglove and the pages of a server show it)",
        "leaderboard:",
    ]
    places = (
        f"  {row['rank']}. {row['team']}: {row['total']:g} points in {counted(row['runs'], 'run')}"
        for row in rows
    )
    return "\n".join([*lines, *places])
