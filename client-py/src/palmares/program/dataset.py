"""``palmares dataset``: recorded runs as a dataset in LeRobot's format."""

from __future__ import annotations

import argparse
import sys

from palmares.outputs import output_folder

EPILOG = """\
A row has the pose of the hand's base, the motors and joints, and as its action the next pose and the command.
LeRobot reads it: LeRobotDataset("mine", root="demonstrations").

example:
  palmares dataset runs/*.mcap --out demonstrations/ --every 5"""


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="palmares dataset",
        description="Write recorded runs of one hand as a dataset in LeRobot's format, version 3.0.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "replays", nargs="+", metavar="RUN.mcap", help="replays, of a server or of save_replay"
    )
    parser.add_argument("--out", type=output_folder, required=True, metavar="FOLDER", help="a new folder")
    parser.add_argument(
        "--every", type=int, default=5, metavar="TICKS", help="ticks from row to row; default 5"
    )
    parser.add_argument(
        "--task", action="append", default=[], metavar="FOLDER", help="a task of your own; repeatable"
    )
    options = parser.parse_args(arguments)
    try:
        from palmares.lerobot import of_replays

        count = of_replays(options.out, options.replays, every=options.every, tasks=options.task)
    except (ValueError, OSError, ImportError) as error:
        print(f"palmares dataset: {error}", file=sys.stderr)
        return 1
    print(f"wrote {count} episodes to {options.out}")
    return 0
