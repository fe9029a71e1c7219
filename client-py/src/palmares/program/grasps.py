"""``palmares grasps``: try grasps by the thousand, and read, replay, check and draw their file."""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tqdm import tqdm

from palmares.outputs import output_file, output_folder

if TYPE_CHECKING:
    from palmares.grasps.explore import Explored
    from palmares.grasps.file import GraspFile

EXAMPLES = """\
A try is a run of the task grasp with one object at rest on the table: the hand comes to a point of its
surface, closes, lifts it by 0.2 m and holds it for 2 s; then the hand is shaken. A kept grasp is played
again with steps of 1, 2 and 4 ms and in drawn hands.

examples:
  palmares grasps softhand 025_mug 056_tennis_ball --out grasps.h5
  palmares grasps my-hand/ --all --tries 3000 --out grasps.h5     every object of `palmares objects`
  palmares grasps leap --all --out grasps.h5 --ray                on the machines of a Ray cluster
  palmares grasps show grasps.h5                                  a line for each object
  palmares grasps page grasps.h5 --out grasps.html                pictures, and success by object
  palmares grasps check grasps.h5 --sample 100                    plays kept grasps again, and compares
  palmares grasps dataset grasps.h5 --out runs/                   runs of kept grasps, for LeRobot
  palmares grasps replay grasps.h5 025_mug --pose 0 --grasp 3 --out a-folder/
Ctrl-C keeps all finished parts; the same command continues."""

COMMANDS = ("show", "check", "replay", "page", "dataset")


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    command = arguments[0] if arguments and arguments[0] in COMMANDS else None
    try:
        if command is None:
            return _make(arguments)
        options = _parser_of(command).parse_args(arguments[1:])
        from palmares.grasps.file import GraspFile

        if not options.file.is_file():
            raise ValueError(f"{options.file}: there is no such file")
        with GraspFile(options.file) as file:
            return RUNS[command](file, options)
    except (ValueError, OSError, ImportError) as error:
        print(f"palmares grasps: {error}", file=sys.stderr)
        return 1


def _make(arguments: list[str]) -> int:
    options = _parser().parse_args(arguments)
    from palmares.grasps import making
    from palmares.sim import OBJECTS

    names = list(OBJECTS) if options.all else options.objects
    if not names:
        raise ValueError("objects: found none; wanted names of `palmares objects`, or --all")
    pool = making.processes(options.jobs)
    if options.ray is not None:
        from palmares import ray

        pool = ray.calls(options.ray or None)
    with tqdm(unit="try", file=sys.stderr, disable=options.quiet, desc="poses at rest") as bar:

        def on_planned(there: int, every: int) -> None:
            bar.set_description("tries")
            bar.reset(every)
            bar.update(there)

        def on_found(found: Explored) -> None:
            bar.update(found.job.tries)
            kept = int(found.kept.survived[:, 0].sum())
            bar.write(f"{found.job.subject.name}, pose {found.job.pose_number}: {kept} kept", file=sys.stderr)

        try:
            making.make(
                options.hand,
                names,
                options.out,
                tries=options.tries,
                poses=options.poses,
                drawn_hands=options.drawn_hands,
                seed=options.seed,
                opened=options.opened,
                closed=options.closed,
                pool=pool,
                on_found=on_found,
                on_planned=on_planned,
            )
        except KeyboardInterrupt:
            print(f"palmares grasps: interrupted; the same command continues {options.out}", file=sys.stderr)
            return 130
    from palmares.grasps.file import GraspFile

    with GraspFile(options.out) as file:
        return _show(file, options)


def _show(file: GraspFile, _: argparse.Namespace) -> int:
    from palmares.grasps.file import totals

    print(f"{file.path}: hand {file.reach.name}, engine {file.engine}")
    print(f"{'object':32} poses  tries  kept at 4 ms  differing  ... also at 1, 2 ms  in drawn hands")
    for row in totals(file):
        print(
            f"{row.name:32} {row.poses:5} {row.tries:6} {row.kept:13} {row.apart:10} {row.survived:18}  "
            + (f"{row.drawn_share:13.0%}" if row.drawn_share is not None else f"{'-':>13}")
        )
    return 0


def _check(file: GraspFile, options: argparse.Namespace) -> int:
    from palmares.grasps.replay import replay

    chosen = _sampled(file, options)
    different = 0
    with tqdm(total=len(chosen), unit="grasp", file=sys.stderr) as bar, tempfile.TemporaryDirectory() as name:
        for object_name, pose, grasp in chosen:
            found = replay(file, object_name, pose, grasp, Path(name))
            if not found.same:
                different += 1
                bar.write(
                    f"{object_name}, pose {pose}, grasp {grasp}: it ends in another state", file=sys.stderr
                )
            bar.update()
    print(f"{len(chosen) - different} of {len(chosen)} grasps end in the state of the file, bit for bit")
    return int(different > 0 or not chosen)


def _replay(file: GraspFile, options: argparse.Namespace) -> int:
    from palmares.grasps.replay import replay

    found = replay(file, options.object, options.pose, options.grasp, options.out, write=True)
    same = "in the state" if found.same else "NOT in the state"
    print(f"{found.outcome.fate}, {found.outcome.points:.2f} points; it ended {same} of the file")
    print(
        f"wrote {options.out / 'run.mcap'}: palmares verify {options.out / 'run.mcap'} --task {options.out}"
    )
    return int(not found.same)


def _page(file: GraspFile, options: argparse.Namespace) -> int:
    from palmares.grasps.page import write_page

    write_page(file, options.out)
    print(f"wrote {options.out}")
    return 0


def _dataset(file: GraspFile, options: argparse.Namespace) -> int:
    from palmares.grasps.replay import replay
    from palmares.lerobot import Frames, frames_of, write
    from palmares.sim import Recording

    chosen = _sampled(file, options, proven=True)

    def episodes() -> Iterator[Frames]:
        for object_name, pose, grasp in tqdm(chosen, unit="grasp", file=sys.stderr):
            with tempfile.TemporaryDirectory(prefix="palmares-grasps-") as name:
                replay(file, object_name, pose, grasp, Path(name), write=True)
                recording = Recording(Path(name) / "run.mcap", [name])
                yield frames_of(recording, options.every, f"Grasp {object_name}, lift it and hold it.")

    count = write(options.out, episodes(), round(100 / options.every), file.reach.name)
    print(f"wrote {count} episodes to {options.out}")
    return 0


def _sampled(
    file: GraspFile, options: argparse.Namespace, proven: bool = False
) -> list[tuple[str, int, int]]:
    """Return object, pose and row of some kept grasps, of all or of those that are kept at every step."""
    grasps = []
    for name, pose in file.sections():
        survived = file.kept(name, pose).survived
        grasps += [(name, pose, row) for row, each in enumerate(survived) if each.all() or not proven]
    return random.Random(options.seed).sample(grasps, min(options.sample, len(grasps)))


RUNS = {"show": _show, "check": _check, "replay": _replay, "page": _page, "dataset": _dataset}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palmares grasps",
        description="Try grasps of a hand on objects and write them into a file.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("hand", metavar="HAND", help="name of a hand, or the path of your own")
    parser.add_argument(
        "objects",
        nargs="*",
        metavar="OBJECT",
        help="names of `palmares objects`, or folders of tasks with objects of their own",
    )
    parser.add_argument("--all", action="store_true", help="all objects of the catalogue")
    parser.add_argument("--out", type=output_file, required=True, metavar="FILE", help="the file, HDF5")
    parser.add_argument(
        "--tries", type=_at_least(1), default=1500, metavar="N", help="of each object; default 1500"
    )
    parser.add_argument(
        "--poses",
        type=_at_least(1),
        default=4,
        metavar="N",
        help="most poses at rest of each object; default 4",
    )
    parser.add_argument(
        "--drawn-hands",
        type=_at_least(0),
        metavar="N",
        help="hands drawn from [uncertain] in which kept grasps are played; default 2, 0 without ranges",
    )
    parser.add_argument(
        "--seed", type=_at_least(0), default=1, metavar="N", help="of what is drawn; default 1"
    )
    for name, when in (("opened", "on the way to the object"), ("closed", "in the grasp")):
        parser.add_argument(
            f"--{name}",
            type=_numbers,
            metavar="S,S,...",
            help=f"σ of every motor {when}; default: its recipe's",
        )
    parser.add_argument(
        "--jobs", type=_at_least(1), metavar="N", help="processes; default: one for each core"
    )
    parser.add_argument(
        "--ray",
        nargs="?",
        const="",
        metavar="ADDRESS",
        help="on the machines of a Ray cluster, not on this alone",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress")
    return parser


def _parser_of(command: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"palmares grasps {command}")
    parser.add_argument("file", type=Path, metavar="FILE", help="a file of `palmares grasps`")
    if command == "check":
        parser.description = "Play kept grasps again and compare the states in which they end."
        parser.add_argument(
            "--sample", type=_at_least(1), default=100, metavar="N", help="how many; default 100"
        )
        parser.add_argument("--seed", type=int, default=0, metavar="N", help="chooses them; default 0")
    elif command == "replay":
        parser.description = "Play a kept grasp again and write its run as a replay."
        parser.add_argument("object", metavar="OBJECT")
        parser.add_argument("--pose", type=_at_least(0), default=0, metavar="N")
        parser.add_argument(
            "--grasp", type=_at_least(0), default=0, metavar="N", help="row of the kept grasps"
        )
        parser.add_argument("--out", type=output_folder, required=True, metavar="FOLDER")
    elif command == "dataset":
        parser.description = "Play kept grasps again and write their runs as a dataset in LeRobot's format."
        parser.add_argument(
            "--sample", type=_at_least(1), default=100, metavar="N", help="how many; default 100"
        )
        parser.add_argument("--seed", type=int, default=0, metavar="N", help="chooses them; default 0")
        parser.add_argument("--every", type=_at_least(1), default=5, metavar="TICKS", help="from row to row")
        parser.add_argument("--out", type=output_folder, required=True, metavar="FOLDER", help="a new folder")
    elif command == "page":
        parser.description = "Write a page with pictures of kept grasps and success by object."
        parser.add_argument("--out", type=output_file, required=True, metavar="FILE", help="an HTML file")
    else:
        parser.description = "Print a line for each object."
    return parser


def _at_least(least: int) -> Callable[[str], int]:
    def whole(text: str) -> int:
        if not text.isdigit() or int(text) < least:
            raise argparse.ArgumentTypeError(f"found {text!r}; wanted a whole number from {least} on")
        return int(text)

    return whole


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"found {text!r}; wanted numbers with commas, as 0,0.2") from None
