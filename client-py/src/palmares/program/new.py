"""``palmares new``: a folder with a controller that plays, a test of it, and a README."""

from __future__ import annotations

import argparse
import sys
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
BY_TASK = {"balls": "ball_in_box", "peg": "peg", "grasp": "box", "shelf": "box"}
"""Kind of the cookbook that a task's controller grasps; another one if the hand has none of it"""
IMPORTS = {
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
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            print(f"palmares new: {folder} exists already; choose another name", file=sys.stderr)
            return 1
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in project(folder.resolve().name, options.task, options.hand).items():
            with (folder / name).open("x", encoding="utf-8") as file:
                file.write(text)
    except OSError as error:
        print(f"palmares new: {error}", file=sys.stderr)
        return 1
    print(f"{folder}: controller.py, test_controller.py, README.md. Next:")
    print(f"  cd {folder}")
    print("  python controller.py --url local --seed 1")
    print("  palmares evaluate controller.py --seeds 1-20")
    return 0


def project(team: str, task: str, hand: str) -> dict[str, str]:
    """Return the text of every file, by its name."""
    grips = COOKBOOK[hand]
    wanted = BY_TASK.get(task, "")
    kind = wanted if wanted in grips else next(iter(grips))
    words = {"team": team, "task": task, "hand": hand, wanted: kind}
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
    made.add_argument("folder", type=_folder, help="folder to make; its name is the team's")
    made.add_argument("--task", choices=TASKS, default="balls", help="default: balls")
    made.add_argument(
        "--hand",
        choices=HANDS,
        default="softhand",
        metavar="HAND",
        help=f"one of {', '.join(HANDS)}; default: softhand",
    )
    return made


def _folder(text: str) -> Path:
    name = Path(text).resolve().name
    if not 1 <= len(name) <= 64:
        raise argparse.ArgumentTypeError(f"{text!r}: wanted a folder whose name has 1 to 64 characters")
    if any(not (letter.isalnum() or letter in "_-.") for letter in name):
        raise argparse.ArgumentTypeError(f"{text!r}: wanted a name of letters, digits, '_', '-' and '.'")
    return Path(text)


def _text(name: str) -> str:
    return files("palmares.program.made").joinpath(f"{name}.txt").read_text(encoding="utf-8")
