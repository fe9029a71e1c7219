"""`python -m fleet`: what `cargo xtask fleet` starts."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from fleet.board import board
from fleet.chaos import chaos
from fleet.drills import partition, upgrade
from fleet.fleet import check_machine
from fleet.soak import soak


def execute(options: argparse.Namespace, folder: Path) -> tuple[dict[str, Any], bool]:
    """Run a command; return its report, and whether it holds."""
    program = options.program.resolve()
    if options.command == "board":
        return board(folder, program, options.teams, options.runs)
    if options.command == "soak":
        return soak(folder, program, options.minutes, options.teams)
    moto = None if options.without_store else options.moto
    hosts, teams = options.hosts, options.teams
    if options.command == "upgrade":
        return upgrade(folder, program, moto, hosts, teams)
    if options.command == "partition":
        return partition(folder, program, moto, hosts, teams, options.seconds)
    only = [kind for kind in options.only.split(",") if kind]
    return chaos(folder, program, moto, hosts, options.faults, options.seed, teams, only)


def main() -> int:
    """Run a command; its last line is its report, as JSON."""
    parser = argparse.ArgumentParser(prog="cargo xtask fleet", description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the program `palmares`")
    parser.add_argument("--moto", type=Path, default=Path("moto_server"), help="the program `moto_server`")
    parser.add_argument("--keep", action="store_true", help="keep the logs, and print their folder")
    commands = parser.add_subparsers(dest="command", required=True)
    fleet = argparse.ArgumentParser(add_help=False)
    fleet.add_argument("--hosts", type=int, default=3)
    fleet.add_argument("--teams", type=int, default=12)
    fleet.add_argument("--without-store", action="store_true", help="several hosts without an object store")
    command = commands.add_parser("chaos", help="faults under load", parents=[fleet])
    command.add_argument("--faults", type=int, default=40)
    command.add_argument("--seed", type=int, default=1)
    command.add_argument("--only", default="", help="kinds of faults, with commas; all when left out")
    commands.add_parser("upgrade", help="end and start all hosts, one after another", parents=[fleet])
    command = commands.add_parser("partition", help="cut a host from the database", parents=[fleet])
    command.add_argument("--seconds", type=float, default=60.0)
    command = commands.add_parser("board", help="the ranking of a large event")
    command.add_argument("--runs", type=int, default=500_000)
    command.add_argument("--teams", type=int, default=10_000)
    command = commands.add_parser("soak", help="one server under load for a long time")
    command.add_argument("--minutes", type=float, default=60.0)
    command.add_argument("--teams", type=int, default=8)
    options = parser.parse_args()

    if options.command != "soak":
        check_machine()
    # Postgres reads its folder as a user of its own.
    folder = Path(tempfile.mkdtemp(prefix="palmares-fleet-"))
    folder.chmod(0o755)
    try:
        report, holds = execute(options, folder)
    finally:
        if options.keep:
            print(f"the logs are in {folder}")
        else:
            shutil.rmtree(folder, ignore_errors=True)
    print(json.dumps(report), flush=True)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
