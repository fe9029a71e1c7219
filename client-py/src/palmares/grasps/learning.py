"""Tries of files of grasps as arrays for learning."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palmares.arrays import Array, array
from palmares.grasps.file import GraspFile
from palmares.grasps.play import FATES
from palmares.grasps.surface import points_on
from palmares.reproducible import matmul
from palmares.rotation import matrix_of

POINTS = 512
"""Points of an object's surface"""


@dataclass(frozen=True)
class Examples:
    """Tries of grasps, each with its object and what became of it.

    `torch.from_numpy` takes the arrays without a copy; docs/grasps.md has a `DataLoader` of them.
    """

    objects: tuple[str, ...]
    """Names"""
    points: NDArray[np.float32]
    """(objects, points, 6): points of each surface, m, and outward normals, in the object's frame"""
    object_row: NDArray[np.int64]
    """(n,), row of each try's object"""
    hand: NDArray[np.float32]
    """(n, 9): position of the hand's base in the object's frame, m; the first two columns of its rotation"""
    up: NDArray[np.float32]
    """(n, 3): the vertical in the object's frame, as it lay on the table"""
    kept: NDArray[np.float32]
    """(n,): 1 for a try whose object stayed in the hand, 0 for others; faults are left out"""
    drawn_freely: NDArray[np.bool_]
    """(n,): False for tries that were drawn near a success"""

    def __len__(self) -> int:
        return len(self.kept)


def examples(paths: Iterable[str | os.PathLike[str]], points: int = POINTS, seed: int = 0) -> Examples:
    """Read the tries of some files of one hand.

    Args:
        paths: Files of `palmares grasps`.
        points: Points of each object's surface.
        seed: Draws them.

    Raises:
        ValueError: A file is none of grasps, or there are two hands.
        OSError: A file cannot be read.

    """
    names, clouds, rows, hands, ups, kept, free = [], [], [], [], [], [], []
    of_hand: str | None = None
    for path in paths:
        with GraspFile(Path(path)) as file:
            if of_hand not in (None, file.settings.hand):
                raise ValueError(
                    f"{path}: found grasps of {file.settings.hand}; wanted {of_hand}, as in the first"
                )
            of_hand = file.settings.hand
            for name in file.objects:
                if name not in names:
                    names.append(name)
                    generator = np.random.default_rng([seed, *name.encode()])
                    clouds.append(np.hstack(points_on(file.body(name).parts, generator, points)))
            for name, pose in file.sections():
                tries, at = file.tries(name, pose), (file.poses(name) or [])[pose]
                turn = at.rotation
                valid = np.flatnonzero(tries.fate != FATES.index("fault"))
                position = matmul(tries.base[valid, :3] - at.position, turn)
                rotation = np.moveaxis(
                    matmul(np.moveaxis(_rotations(tries.base[valid, 3:]), 1, 2), turn), 1, 2
                )
                hands.append(np.hstack([position, rotation[:, :, 0], rotation[:, :, 1]]))
                rows.append(np.full(len(valid), names.index(name)))
                ups.append(np.tile(turn[2], (len(valid), 1)))
                kept.append(tries.fate[valid] == FATES.index("kept"))
                free.append(tries.parent[valid] < 0)
    if not rows:
        raise ValueError("paths: found no tries; wanted files of `palmares grasps`")
    return Examples(
        tuple(names),
        np.stack(clouds).astype(np.float32),
        np.concatenate(rows),
        np.concatenate(hands).astype(np.float32),
        np.concatenate(ups).astype(np.float32),
        np.concatenate(kept).astype(np.float32),
        np.concatenate(free),
    )


def _rotations(quats: Array) -> Array:
    return array([matrix_of(quat) for quat in quats]).reshape(-1, 3, 3)
