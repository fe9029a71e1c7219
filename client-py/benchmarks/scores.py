"""Play example controllers over many seeds and print how their scores are distributed.

    palmares serve &
    python scores.py balls_softhand balls_sensors --seed 9001 --runs 50

Every run is written to `--out` as it ends, one JSON object a line.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np

import palmares

EXAMPLES = Path(__file__).parent.parent / "src/palmares/examples"


def row(name: str, scores: Iterable[float]) -> str:
    """Return a row of the table: how the scores of a controller are distributed."""
    all_ = np.array(list(scores))
    error = all_.std(ddof=1) / len(all_) ** 0.5 if len(all_) > 1 else float("nan")
    quartiles = " ".join(f"{x:g}" for x in np.quantile(all_, [0.25, 0.5, 0.75]))
    ends = f"{all_.min():g} | {quartiles} | {all_.max():g}"
    return f"| {name} | {len(all_)} | {all_.mean():.2f} ± {error:.2f} | {ends} |"


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("controllers", nargs="+", help="names of examples, such as balls_sensors")
    parser.add_argument("--url", default="http://127.0.0.1:8080")
    parser.add_argument("--seed", type=int, default=9001, help="the first seed")
    parser.add_argument("--runs", type=int, default=50, help="runs of each, one a seed")
    parser.add_argument("--out", type=Path, default=Path("scores.jsonl"))
    args = parser.parse_args()
    sys.path.insert(0, str(EXAMPLES))
    table = [
        "| controller | runs | mean ± standard error | least | quartiles | most |",
        "|---|---|---|---|---|---|",
    ]
    with args.out.open("a") as out:
        for name in args.controllers:
            run = importlib.import_module(name).run
            scores = []
            with palmares.Client(args.url, team="scores") as client:
                for seed in range(args.seed, args.seed + args.runs):
                    summary = run(client, seed)
                    scores.append(summary.score)
                    print(json.dumps({"controller": name} | asdict(summary)), file=out, flush=True)
                    print(f"{name}: seed {seed}: {summary.score:g}", file=sys.stderr)
            table.append(row(name, scores))
    print("\n".join(table))


if __name__ == "__main__":
    main()
