"""``palmares hand design``: a hand whose numbers meet the goals of a design file."""

from __future__ import annotations

import argparse
import shlex
import sys
import textwrap
from pathlib import Path

from tqdm import tqdm

from palmares.design import Designed, find, maker, read, write_hand
from palmares.design.places import NOTATION
from palmares.design.result import wanted
from palmares.errors import PalmaresError
from palmares.outputs import output_folder

EXAMPLES = f"""\
A design file names a hand, the numbers that may change with their ranges, and goals:

  hand = "yale_t42"

  [[unknowns]]
  name = "distal radius"
  in = ["arm.left_tendon.left_distal_joint", "arm.right_tendon.right_distal_joint"]
  range = [0.004, 0.009]

  [[goals]]
  kind = "fates"                    # or ejection, pull_out, epsilon, probability, postures, forces
  shape = "cylinder"
  sizes = [[0.02, 0.05], [0.03, 0.05]]
  places = [[0, 0, 0.13], [0, 0.02, 0.15]]
  rpy = [0, 1.5707963, 0]

places of unknowns:
{textwrap.indent(NOTATION, "  ")}

examples:
  palmares hand design design.toml --out my-hand/
  palmares hand design design.toml --out my-hand/ --evaluations 500
  palmares hand check my-hand/
docs/analysis.md explains places and goals. Ctrl-C ends the search and keeps the best hand so far."""


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code: 130 after Ctrl-C, with the best hand written."""
    options = _parser().parse_args(arguments)
    folder: Path = options.out
    try:
        if any(folder.iterdir()) and not options.force:
            raise ValueError(f"{folder} is not empty; name another folder, or add --force")
        design = read(options.design)
        with (
            maker(design) as made,
            tqdm(total=options.evaluations, unit="hand", file=sys.stderr, disable=options.quiet) as bar,
        ):

            def report(found: Designed) -> None:
                bar.update()
                ranked = found.ranked
                if ranked:
                    best = ranked[0]
                    missed = "" if best.missed == 0.0 else f", limits missed by {best.missed:.3g}"
                    bar.set_postfix_str(f"best {best.score:.5g}{missed}")

            found = find(made, options.evaluations, options.seed, report)
        again = f"palmares hand design {shlex.quote(options.design.name)} --out {shlex.quote(folder.name)}/"
        again += f" --evaluations {options.evaluations} --seed {options.seed}"
        best = write_hand(design, found, folder, again)
    except KeyboardInterrupt:
        print("palmares hand design: interrupted before a hand was written", file=sys.stderr)
        return 130
    except (ValueError, OSError, PalmaresError) as error:
        print(f"palmares hand design: {error}", file=sys.stderr)
        return 1
    print(f"{'unknown':28} {'before':>12} {'designed':>12}  range")
    for unknown, was, now in zip(design.unknowns, found.before.values, best.values, strict=True):
        print(f"{unknown.name:28} {was:12.6g} {now:12.6g}  {unknown.low:g} to {unknown.high:g}")
    print(f"{'goal':28} {'before':>12} {'designed':>12}  wanted")
    for goal, old, new in zip(design.goals, found.before.measured, best.measured, strict=True):
        print(f"{goal.common.name:28} {old.value:12.5g} {new.value:12.5g}  {wanted(goal)}")
    if best.missed > 0.0:
        print("no hand keeps all limits; this one misses them least")
    print(f"wrote {folder}: palmares hand check {folder}")
    return 130 if found.interrupted else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palmares hand design",
        description="Search for the numbers of a hand that meet goals best, and write that hand.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("design", type=Path, metavar="DESIGN.toml", help="the design file")
    parser.add_argument(
        "--out", type=output_folder, required=True, metavar="FOLDER", help="folder of the new hand"
    )
    parser.add_argument(
        "--evaluations",
        type=_positive,
        default=200,
        metavar="N",
        help="how many hands are measured; default 200",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the search's steps; default 1")
    parser.add_argument("--force", action="store_true", help="write into a folder that is not empty")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    return parser


def _positive(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"found {text!r}; wanted a whole number from 1 on")
    return int(text)
