"""``palmares new``: a folder with a controller that plays, a test of it, and the commands to go on with."""

from __future__ import annotations

import argparse
import keyword
import sys
from pathlib import Path

CONTROLLER = '''\
"""A controller of {team} for {task} with the {hand}. Play one run without a server:

    python controller.py --url local --seed 1
"""

from __future__ import annotations

import palmares
from palmares.skills.motion import UP, Mover, RunOverError
from palmares.skills.runs import Summary, play

TASK, HAND = "{task}", "{hand}"

# Constants to tune -------------------------------------------------------------------------------------
ABOVE_M = 0.05
"""Distance of the palm above the object at which the fingers close"""
LIFT_M = 0.15


def decide(mover: Mover) -> None:
    """Move the hand over the nearest object, close it and lift. Yours to change."""
    base = mover.position
    objects = mover.obs.truth.positions if mover.obs.truth is not None else []
    if len(objects) == 0:
        return
    nearest = min(objects, key=lambda at: float(((at - base)[:2] ** 2).sum()))
    over = nearest + (ABOVE_M + 0.15) * UP
    mover.to(2.0, over, sigma=0.0)
    mover.to(1.0, nearest + ABOVE_M * UP)
    mover.to(1.0, sigma=1.0)
    mover.wait(0.3)
    mover.to(1.0, over + LIFT_M * UP)


def run(client: palmares.Client, seed: int | None) -> Summary:
    """Play one run; `palmares evaluate` calls this, too."""
    mover = Mover(client, client.reset(TASK, HAND, seed=seed))
    try:
        decide(mover)
    except RunOverError:
        pass  # The task is complete, or its time is over.
    result, rtf = mover.stop()
    return Summary(
        run_id=result.run_id, seed=seed, score=result.score, sim_time_s=result.sim_time_s, rtf=rtf
    )


if __name__ == "__main__":
    play(run, __doc__)
'''

TEST = '''\
"""Does the controller still play? ``pip install pytest``, then ``pytest`` in this folder."""

import palmares
from controller import run


def test_a_run_ends_with_a_score() -> None:
    with palmares.Client("local") as client:
        summary = run(client, seed=1)
    assert summary.sim_time_s > 1.0


def test_the_same_seed_gives_the_same_score() -> None:
    scores = []
    for _ in range(2):
        with palmares.Client("local") as client:
            scores.append(run(client, seed=2).score)
    assert scores[0] == scores[1]
'''

README = '''\
# {team}

| command | what it does |
|---|---|
| `python controller.py --url local --seed 1` | plays one run in this process |
| `palmares evaluate controller.py --seeds 1-20` | plays 20 scenes on all cores, and prints mean and spread |
| `palmares serve`, then `python controller.py --team {team}` | plays on a practice server; http://127.0.0.1:8080/live shows it |
| `pytest` | tests the controller |

`controller.py` has a function `run(client, seed)`; everything else is yours. Its constants are at the top.
'''


def main(arguments: list[str]) -> int:
    """Run the command; return the exit code."""
    options = parser().parse_args(arguments)
    folder: Path = options.folder
    team = folder.resolve().name
    if folder.exists() and any(folder.iterdir()):
        print(f"palmares new: {folder} exists and is not empty; choose another name", file=sys.stderr)
        return 1
    words = {"team": team, "task": options.task, "hand": options.hand}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in (("controller.py", CONTROLLER), ("test_controller.py", TEST), ("README.md", README)):
            written = text
            for word, value in words.items():
                written = written.replace("{" + word + "}", value)
            (folder / name).write_text(written)
    except OSError as error:
        print(f"palmares new: {error}", file=sys.stderr)
        return 1
    print(f"{folder}: controller.py, test_controller.py, README.md. Next:")
    print(f"  cd {folder}")
    print("  python controller.py --url local --seed 1")
    print("  palmares evaluate controller.py --seeds 1-20")
    return 0


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    from palmares.sim import HANDS, TASKS

    made = argparse.ArgumentParser(
        prog="palmares new",
        description="Make a folder with a controller that plays, a test of it, and the commands to go on with.",
    )
    made.add_argument("folder", type=_folder, help="folder to make; its name is the team's")
    made.add_argument("--task", choices=TASKS, default="balls", help=f"{', '.join(TASKS)} (default balls)")
    made.add_argument(
        "--hand", choices=HANDS, default="softhand", metavar="HAND", help=f"{', '.join(HANDS)} (default softhand)"
    )
    return made


def _folder(text: str) -> Path:
    name = Path(text).resolve().name
    if not name or len(name) > 64 or keyword.iskeyword(name):
        raise argparse.ArgumentTypeError(f"{text!r}: wanted a folder whose name has 1 to 64 characters")
    return Path(text)
