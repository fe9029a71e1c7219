"""Scenes of the task `grasp` with one object in one of its poses at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palmares import own_task
from palmares.arrays import Array, array
from palmares.grasp_task import fixed, grasp_task, own_object
from palmares.grasps.hand import Reach
from palmares.grasps.surface import bounds, support
from palmares.reproducible import atan2, cos, dots, matmul
from palmares.rotation import matrix_of, quat_of, rot_z
from palmares.scene import SceneBody
from palmares.sim import OBJECTS, Batch, World
from palmares.training import Training

DROPS = 48
"""Number of drops that show how an object comes to rest"""
RARE = 3
"""A pose at rest is kept if this many drops end in it"""
SAME_DEG = 8.0
"""Poses at rest whose verticals differ by less are one, whatever the turn about the vertical"""
ABOVE_M = 0.03
"""Distance of the object's top from a hand that turns above it"""
HIGH_M = 1.5
"""Height of the hand over a dropped object"""

REMARK = "The task `grasp` with one object. `palmares grasps` wrote this file."
DESCRIPTION = "Lift the object by 0.1 m, hold it for 2 s and through a shake: up to 10 points."
SCATTER = """\
[place.scatter]
into = "middle"
gap = 0.004

[training.randomise]
object_poses = { tilt_deg = 180.0 }"""


@dataclass(frozen=True)
class Subject:
    """An object to grasp: of the catalogue, or one's own."""

    name: str
    own: str = ""
    """Its table ``[[objects.own]]`` as TOML; empty for one of the catalogue"""
    files: tuple[tuple[str, bytes], ...] = ()
    """Files that the table names: path in the folder, contents"""


@dataclass(frozen=True)
class Pose:
    """An object at rest on the table; its middle is above the origin."""

    position: Array
    """(3,), of the object's frame, m"""
    quat: Array
    """(4,), x y z w"""
    share: float
    """Part of all drops that ended so"""

    @property
    def rotation(self) -> Array:
        """World from object, (3, 3)."""
        return matrix_of(self.quat)


def subjects_of(text: str) -> list[Subject]:
    """Return the objects that a word names: one of the catalogue, or all of a task's own.

    Args:
        text: A name of the catalogue, or the path of a task's folder or its ``task.toml``.

    Raises:
        ValueError: There is no such object, or the task has none of its own.

    """
    if text in OBJECTS:
        return [Subject(text)]
    path = Path(text)
    file = path / "task.toml" if path.is_dir() else path
    if file.suffix != ".toml" or not file.is_file():
        raise ValueError(
            f"objects: found {text!r}; wanted a name of `palmares objects`, such as 025_mug, or the folder "
            "of a task with [[objects.own]]"
        )
    found = []
    for own in own_task.read(file).get("objects", {}).get("own", []):
        named = (
            [own["urdf"]] if "urdf" in own else [it["file"] for it in own.get("parts", []) if "file" in it]
        )
        files = tuple((name, (file.parent / name).read_bytes()) for name in named)
        found.append(Subject(str(own.get("name")), own_object(own), files))
    if not found:
        raise ValueError(f"objects: {file} has no [[objects.own]]")
    return found


def poses_at_rest(subject: Subject, hand: str, folder: Path, most: int) -> list[Pose]:
    """Drop an object many times; return at most `most` poses in which it came to rest, the commonest first.

    Args:
        subject: The object.
        hand: Name of the hand, or the path of your own; it looks on from above.
        folder: A folder in which the scene's file is written.
        most: At least 1.

    Raises:
        ValueError: The object cannot be read, or never comes to rest.

    """
    write_task(folder, subject, SCATTER, array([0.0, 0.0, HIGH_M]), array([0.0, 1.0, 0.0, 0.0]))
    batch = Batch(str(folder), hand, DROPS, training=Training(randomise=("object_poses",)))
    rows = batch.reset(range(1, DROPS + 1))["objects"][:, 0]
    body = World(str(folder), hand, seed=1).scene.free[0]
    upward = array([matrix_of(row[3:7])[2] for row in rows])
    left, groups = list(range(DROPS)), []
    while left:
        alike = dots(upward[left], upward[left[0]][None]) > cos(math.radians(SAME_DEG))
        groups.append([row for row, same in zip(left, alike, strict=True) if same])
        left = [row for row, same in zip(left, alike, strict=True) if not same]
    groups.sort(key=len, reverse=True)
    kept = [group for group in groups if len(group) >= RARE] or groups
    return [_centred(body, rows[group[0]], len(group) / DROPS) for group in kept[:most]]


def _centred(body: SceneBody, row: Array, share: float) -> Pose:
    """Return a pose with the object's middle above the origin and its x axis towards the world's x."""
    turn = matrix_of(row[3:7])
    ahead = turn[:, 0] if abs(float(turn[2, 0])) < 0.9 else turn[:, 1]
    turn = matmul(rot_z(-atan2(float(ahead[1]), float(ahead[0]))), turn)
    low, high = bounds(body.parts)
    middle = matmul(turn, 0.5 * (low + high))
    return Pose(array([-middle[0], -middle[1], row[2]]), quat_of(turn), share)


def top_of(body: SceneBody, pose: Pose) -> float:
    """Return the height of an object's top, m."""
    up = matmul(pose.rotation.T, array([0.0, 0.0, 1.0]))
    return float(pose.position[2]) + max(support(part, up) for part in body.parts)


def start_of(reach: Reach, top_m: float) -> tuple[Array, Array]:
    """Return where the hand begins: position (3,) and quaternion (4,); its fingers point down."""
    down = array([0.0, 0.0, -1.0])
    side = array([1.0, 0.0, 0.0]) if abs(float(reach.fingers[0])) < 0.9 else array([0.0, 1.0, 0.0])
    across = np.cross(reach.fingers, side)
    across = across / np.sqrt(dots(across, across))
    hand = np.column_stack([reach.fingers, across, np.cross(reach.fingers, across)])
    world = np.column_stack([down, array([0.0, 1.0, 0.0]), np.cross(down, array([0.0, 1.0, 0.0]))])
    rotation = matmul(world, hand.T)
    return array([0.0, 0.0, top_m + ABOVE_M + reach.size_m]), quat_of(rotation)


def write_scene(folder: Path, subject: Subject, body: SceneBody, pose: Pose, reach: Reach) -> None:
    """Write the task in which the object lies in a pose and the hand begins above it."""
    place = fixed(subject.name, pose.position, pose.quat)
    write_task(folder, subject, place, *start_of(reach, top_of(body, pose)))


def write_task(folder: Path, subject: Subject, place: str, position: Array, quat: Array) -> None:
    """Write a ``task.toml`` and the files of its object."""
    folder.mkdir(parents=True, exist_ok=True)
    name = f"grasp_of_{subject.name}"
    text = grasp_task(name, DESCRIPTION, subject.name, subject.own, place, position, quat, remark=REMARK)
    (folder / "task.toml").write_text(text)
    for name, contents in subject.files:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(contents)
