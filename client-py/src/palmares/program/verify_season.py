"""The client of a Ray cluster for ``palmares verify --ray``, which starts it.

It reads replays from standard input and writes a line of JSON for each verdict to standard output.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from typing import Any


def main(arguments: list[str]) -> int:
    """Verify until the input ends; return the exit code."""
    options = parser().parse_args(arguments)
    # Prints of Ray and of its workers must not come between the verdicts.
    verdicts = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    # `palmares verify` ends this process after Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def write(line: dict[str, Any]) -> None:
        print(json.dumps(line), file=verdicts, flush=True)

    try:
        from palmares.ray import replays

        replays.verify(
            sys.stdin.buffer, write, options.build, options.address, key=options.key, tasks=options.task
        )
    except BrokenPipeError:
        return 1
    except (ImportError, ConnectionError, ValueError, OSError, RuntimeError) as error:
        write({"failed": str(error)})
        return 1
    return 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(prog="python -m palmares.program.verify_season", description=__doc__)
    made.add_argument("--build", required=True, help="build of the program that asks for the verdicts")
    made.add_argument("--address", help="address of the cluster")
    made.add_argument("--key", help="expected public key of the server")
    made.add_argument("--task", action="append", default=[], metavar="PATH", help="folder of a task")
    return made


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
