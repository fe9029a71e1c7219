"""Runs of a controller from the command line, and their summaries."""

from __future__ import annotations

import argparse
import json
import logging
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from statistics import fmean

from palmares.client import Client
from palmares.errors import PalmaresError
from palmares.outputs import show_everything

__all__ = [
    "Summary",
    "play",
]


@dataclass(frozen=True, kw_only=True)
class Summary:
    """Outcome of a run. Controllers add fields; `play` prints all of them."""

    run_id: str
    seed: int | None
    score: float
    sim_time_s: float
    rtf: float
    """Real-time factor: simulated time per wall time"""

    def __str__(self) -> str:
        common = {field.name for field in fields(Summary)}
        own = {name: value for name, value in vars(self).items() if name not in common}
        listed = {k: ", ".join(map(str, v)) or "none" if isinstance(v, list) else v for k, v in own.items()}
        extra = "".join(f"; {name.replace('_', ' ')}: {value}" for name, value in listed.items())
        return (
            f"run {self.run_id}: score {self.score:.4g}{extra}; "
            f"{self.sim_time_s:.1f} s simulated, {self.rtf:.1f} x real time"
        )


def play(run: Callable[..., Summary], doc: str | None, hands: Iterable[str] = ()) -> None:
    """Read the command line, play runs and print their summaries: the main program of a controller.

    Args:
        run: Plays one run: ``run(client, seed)``; with a seed of ``None`` the server draws it.
        doc: Docstring of the controller; ``--help`` shows its first line.
        hands: Hands among which the option ``--hand`` chooses, for a ``run(client, seed, hand)``.

    """
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="address of the server, or local")
    parser.add_argument("--team", default="example", help="name on a practice server's leaderboard")
    parser.add_argument("--seed", type=int, help="scene of the first run; later runs count up from it")
    parser.add_argument("--runs", type=int, default=1, help="number of runs")
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    parser.add_argument("--json", action="store_true", help="one JSON object per run on standard output")
    if hands:
        names = list(hands)
        parser.add_argument("--hand", choices=names, default=names[0], help="name of the hand")
    show_everything()
    args = parser.parse_args()
    more = [args.hand] if hands else []
    logging.basicConfig(level=logging.WARNING if args.quiet else logging.INFO, format="%(message)s")
    scores = []
    try:
        with Client(args.url, team=args.team) as client:
            for k in range(args.runs):
                summary = run(client, None if args.seed is None else args.seed + k, *more)
                scores.append(summary.score)
                print(json.dumps(asdict(summary)) if args.json else summary, flush=True)
    except PalmaresError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("interrupted")
    if args.runs > 1 and not args.json:
        print(f"{len(scores)} runs: score {fmean(scores):.4g} on average")
