"""A grasp of a file, played again: its outcome compared, its run as a replay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from palmares.arrays import Array
from palmares.grasps.course import TICKS
from palmares.grasps.file import GraspFile
from palmares.grasps.play import Outcome, Table
from palmares.grasps.sample import Candidates
from palmares.sim import Batch, World


@dataclass(frozen=True)
class Replayed:
    """A kept grasp that was played again."""

    outcome: Outcome
    same: bool
    """Whether the run ended in the state of the file, bit for bit"""


def replay(
    file: GraspFile,
    name: str,
    pose: int,
    grasp: int,
    folder: Path,
    write: bool = False,
    on_held: Callable[[Batch, int], None] | None = None,
) -> Replayed:
    """Play a kept grasp with the task's own step.

    Args:
        file: The file.
        name: The object.
        pose: Number of its pose.
        grasp: Row of `GraspFile.kept`.
        folder: Where the scene is written, and with `write` the replay ``run.mcap``.
        write: Write a replay, which ``palmares verify run.mcap --task FOLDER`` plays and the pages show.
        on_held: As for `Table.play`.

    Raises:
        ValueError: There is no such grasp.

    """
    kept, tries = file.kept(name, pose), file.tries(name, pose)
    if not 0 <= grasp < len(kept.row):
        raise ValueError(
            f"{file.path}: {name}, pose {pose}: found grasp {grasp}; wanted 0 to {len(kept.row) - 1}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "task.toml").write_text(file.scene(name, pose))
    for path, contents in file.files(name):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(contents)
    row = slice(int(kept.row[grasp]), int(kept.row[grasp]) + 1)
    one = Candidates(tries.base[row, :3], tries.base[row, 3:], tries.approach[row])
    hand = file.settings.hand
    actions: list[Array] = []
    table = Table(folder, hand, file.reach, worlds=1, threads=1)
    ((_, outcome),) = table.play(one, actions, on_held)
    if write:
        _write(folder, hand, actions)
    return Replayed(outcome, outcome.state_hash.encode() == bytes(kept.state_hash[grasp]))


def _write(folder: Path, hand: str, actions: list[Array]) -> None:
    world = World(str(folder), hand, seed=1)
    for action in actions:
        world.step(base=action[:7], hand=action[7:], repeat=TICKS)
    world.save_replay(folder / "run.mcap")
