"""`python -m fleet`: what `cargo xtask fleet` starts."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path

from fleet.board import board
from fleet.chaos import chaos
from fleet.fleet import check_machine


def main() -> int:
    """Run a command; its last line is its report, as JSON."""
    parser = argparse.ArgumentParser(prog="cargo xtask fleet", description=__doc__)
    parser.add_argument("--program", type=Path, required=True, help="the program `palmares`")
    parser.add_argument("--moto", type=Path, default=Path("moto_server"), help="the program `moto_server`")
    parser.add_argument("--keep", action="store_true", help="keep the logs, and print their folder")
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("chaos", help="faults under load")
    command.add_argument("--hosts", type=int, default=3)
    command.add_argument("--faults", type=int, default=40)
    command.add_argument("--seed", type=int, default=1)
    command.add_argument("--teams", type=int, default=12)
    command.add_argument("--only", default="", help="kinds of faults, with commas; all when left out")
    command = commands.add_parser("board", help="the ranking of a large event")
    command.add_argument("--runs", type=int, default=500_000)
    command.add_argument("--teams", type=int, default=10_000)
    options = parser.parse_args()

    check_machine()
    # Postgres reads its folder as a user of its own.
    folder = Path(tempfile.mkdtemp(prefix="palmares-fleet-"))
    folder.chmod(0o755)
    program = options.program.resolve()
    try:
        match options.command:
            case "board":
                report, holds = board(folder, program, options.teams, options.runs)
            case _:
                only = [kind for kind in options.only.split(",") if kind]
                report, holds = chaos(
                    folder,
                    program,
                    options.moto,
                    options.hosts,
                    options.faults,
                    options.seed,
                    options.teams,
                    only,
                )
    finally:
        if options.keep:
            print(f"the logs are in {folder}")
        else:
            shutil.rmtree(folder, ignore_errors=True)
    print(json.dumps(report), flush=True)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
