"""``palmares demo``: the whole system once, from nothing to a leaderboard."""

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
from palmares.server import Server

# Controllers of the tasks: their module, the field of their summary that says how many objects are where they
# should be, and what it counts.
CONTROLLERS = {
    "balls": ("balls_softhand", "balls_in_b", "balls in box B"),
    "shelf": ("shelf_softhand", "in_box", "objects in the box"),
    "grasp": ("grasp_softhand", "kept", "objects still in the hand after the shake"),
}


def main(arguments: list[str]) -> int:
    """Do what the command line says; return the exit code."""
    options = parser().parse_args(arguments)
    try:
        with data_folder(options.data_dir) as data, Server(data, program=options.program) as server:
            print(
                f"a practice server listens on {server.url}; at {server.url}/live the run is seen",
                file=sys.stderr,
            )
            print(
                f"an example controller plays {options.task} with the SoftHand, scene {options.seed}",
                file=sys.stderr,
            )
            outcome = play(server.url, options.task, options.seed)
            rows = http.get_object(server.url, "/v1/leaderboard")["rows"]
            run_id = outcome["run_id"]
            options.replay.mkdir(parents=True, exist_ok=True)
            replay = options.replay / f"{run_id}.mcap"
            replay.write_bytes(http.get(server.url, f"/v1/runs/{run_id}/replay"))
            tell = summary if options.json else people
            print(tell(options.task, outcome, rows, replay), flush=True)
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
    """Print a line for people, beside the outcome."""
    print(text, file=sys.stderr, flush=True)


class DemoError(Exception):
    """The controller failed."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares demo",
        description="Start a practice server, let an example controller play one run, "
        "print the score and the leaderboard, and end the server.",
    )
    made.add_argument("--task", choices=list(CONTROLLERS), default="balls", help="which task (default balls)")
    made.add_argument("--seed", type=int, default=1, help="which scene (default 1)")
    made.add_argument("--stay", action="store_true", help="let the server run on, to look at its pages")
    made.add_argument(
        "--json", action="store_true", help="print the outcome as one JSON object, on the last line"
    )
    made.add_argument(
        "--replay", type=Path, default=Path(), metavar="FOLDER", help="where to put the replay (default here)"
    )
    made.add_argument(
        "--data-dir",
        type=Path,
        metavar="FOLDER",
        help="keep the server's database and log there, for `palmares serve --data-dir FOLDER`",
    )
    made.add_argument("--program", help="the palmares program (default: the one of this package)")
    return made


@contextlib.contextmanager
def data_folder(wanted: Path | None) -> Iterator[Path]:
    """Give the folder that is wanted, or one that goes away."""
    if wanted is not None:
        yield wanted
        return
    with tempfile.TemporaryDirectory(prefix="palmares-demo-") as folder:
        yield Path(folder)


def play(url: str, task: str, seed: int) -> dict[str, Any]:
    """Let the example play; its progress goes to standard error, its summary is returned."""
    module, _, _ = CONTROLLERS[task]
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
    _, field, _ = CONTROLLERS[task]
    told = {name: outcome[name] for name in ("score", field, "run_id", "rtf")}
    return json.dumps({**told, "leaderboard": rows, "replay": str(replay)})


def people(task: str, outcome: dict[str, Any], rows: list[dict[str, Any]], replay: Path) -> str:
    """Return the outcome for people."""
    _, field, counted = CONTROLLERS[task]
    lines = [
        f"score {outcome['score']:g}: {outcome[field]} {counted}, run {outcome['run_id']}",
        f"{outcome['sim_time_s']:.1f} s simulated, {outcome['rtf']:.1f} times as fast as real time",
        f"replay: {replay} (`palmares verify` plays it again, Foxglove and the server's pages show it)",
        "leaderboard:",
    ]
    places = (
        f"  {row['rank']}. {row['team']}: {row['total']:g} points in {row['runs']} run(s)" for row in rows
    )
    return "\n".join([*lines, *places])
