"""``palmares new``: a folder with a controller that plays, a test of it, and a README."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import unicodedata
from importlib.resources import files
from pathlib import Path

from palmares.sim import HANDS, TASKS
from palmares.skills.cookbook import COOKBOOK

EXAMPLES = """\
examples:
  palmares new crabs
  palmares new crabs --task pan --hand softhand_strong
  cd crabs; python controller.py --url local --seed 1
An existing folder stays as it is, unless it is empty."""

SOFTHANDS = ("softhand", "softhand_skin", "softhand_strong")
"""Hands that `palmares.skills.clearing` moves"""
NEEDS = {
    "balls": ("ball_in_box",),
    "shelf": ("box",),
    "grasp": ("box",),
    "pan": ("knob", "handle"),
    "peg": ("peg",),
}
"""Kinds of the cookbook of which a task's controller needs one"""
MOST = {"balls": 10, "shelf": 50, "grasp": 10, "pan": 10, "peg": 10}
"""Most points of a task"""
IMPORTS = {
    "palmares.reproducible": ("matmul",),
    "palmares.rotation": ("quat_of",),
    "palmares.skills": ("clearing",),
    "palmares.skills.attempts": ("Attempt",),
    "palmares.skills.cookbook": ("COOKBOOK", "GripMover", "kind_of", "most_room", "pick", "target_of"),
    "palmares.skills.motion": ("UP", "RunOverError"),
    "palmares.skills.objects": ("object_bounds", "rolling", "truth_of"),
}
"""Names that controllers use, by module"""


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(arguments)
    folder: Path = options.folder
    if not can_start(options.task, options.hand):
        able = ", ".join(hand for hand in HANDS if can_start(options.task, hand))
        needed = " or ".join(NEEDS[options.task])
        print(
            f"palmares new: no grip of {options.hand} for a {needed} is known, so its start would do nothing "
            f"in {options.task}; --hand with one: {able}",
            file=sys.stderr,
        )
        return 1
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            print(f"palmares new: {folder} exists already; choose another name", file=sys.stderr)
            return 1
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in project(team_of(folder), options.task, options.hand).items():
            with (folder / name).open("x", encoding="utf-8") as file:
                file.write(text)
    except OSError as error:
        print(f"palmares new: {error}", file=sys.stderr)
        return 1
    print(f"{folder}: controller.py, test_controller.py, README.md.", flush=True)
    if not options.untried:
        print("It plays its first run ...", file=sys.stderr)
        try:
            print(tried(folder, options.task))
        except StartError as error:
            print(f"palmares new: {error}", file=sys.stderr)
            return 1
    print("Next:")
    print(f"  cd {folder}")
    print("  python controller.py --url local --seed 1")
    print("  palmares evaluate controller.py --seeds 1-20")
    return 0


def can_start(task: str, hand: str) -> bool:
    """Whether the cookbook has a grip of the hand for a start at the task."""
    return any(kind in COOKBOOK[hand] for kind in NEEDS[task])


def tried(folder: Path, task: str) -> str:
    """Play the new controller in the first scene, as its README says; return in a sentence what it scores.

    Raises:
        StartError: It does not play.

    """
    command = [sys.executable, "controller.py", "--url", "local", "--seed", "1", "--json", "--quiet"]
    played = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if played.returncode != 0:
        raise StartError(f"{folder} does not play:\n{played.stderr.strip()}")
    score = json.loads(played.stdout)["score"]
    text = f"As it is, it scores {score:.4g} of {MOST[task]} points in scene 1."
    if score < 0.5 * MOST[task]:
        text += " Much of the task is left to you: change `decide` in controller.py."
    return text


class StartError(Exception):
    """A new controller does not play."""


def project(team: str, task: str, hand: str) -> dict[str, str]:
    """Return the text of every file, by its name."""
    words = {"team": team, "task": task, "hand": hand}
    by_clearing = task == "shelf" and hand in SOFTHANDS
    body = _text("shelf_softhand" if by_clearing else task)
    code = body + _text("tail")
    lines = []
    for module, names in IMPORTS.items():
        used = [name for name in names if name in code]
        if used:
            lines.append(f"from {module} import {', '.join(used)}")
    words["imports"] = "\n".join(lines)
    words["math"] = "import math\n" if "math." in code else ""
    written = {
        "controller.py": _text("head") + code,
        "test_controller.py": _text("test"),
        "README.md": _text("readme"),
    }
    for word, value in words.items():
        written = {name: text.replace("{" + word + "}", value) for name, text in written.items()}
    return written


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(
        prog="palmares new",
        description="Make a folder with a controller that plays, a test of it, and a README.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    made.add_argument(
        "folder", type=_folder, help="folder to make; its name, of letters of any language, is the team's"
    )
    made.add_argument("--task", choices=TASKS, default="balls", help="default: balls")
    made.add_argument(
        "--hand",
        choices=HANDS,
        default="softhand",
        metavar="HAND",
        help=f"one of {', '.join(HANDS)}; default: softhand",
    )
    made.add_argument("--untried", action="store_true", help="do not play it; a run takes some seconds")
    return made


def team_of(folder: Path) -> str:
    """Return the team's name: that of the folder, in the composed form of its letters."""
    name = os.fsencode(folder.resolve().name).decode("utf-8", "replace")
    return unicodedata.normalize("NFC", name)


def _folder(text: str) -> Path:
    name = team_of(Path(text))
    if not 1 <= len(name) <= 64:
        raise argparse.ArgumentTypeError(f"{text!r}: wanted a folder whose name has 1 to 64 characters")
    # Marks are parts of letters, such as the vowels of Hindi.
    if not all(it.isalnum() or it in "_-." or unicodedata.category(it)[0] == "M" for it in name):
        raise argparse.ArgumentTypeError(f"{text!r}: wanted a name of letters, digits, '_', '-' and '.'")
    return Path(text)


def _text(name: str) -> str:
    return files("palmares.program.made").joinpath(f"{name}.txt").read_text(encoding="utf-8")
