"""The file of grasps: HDF5, schema `SCHEMA`; docs/grasps.md describes it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

try:
    import h5py
except ImportError as missing:
    raise ImportError("palmares.grasps needs h5py: pip install 'palmares[grasps]'") from missing

from palmares.arrays import array
from palmares.grasps.explore import STEPS_MS, Explored, Kept, Tries
from palmares.grasps.hand import Reach
from palmares.grasps.play import FATES
from palmares.grasps.scene import Pose, Subject
from palmares.reproducible import total
from palmares.scene import SceneBody
from palmares.sim import identity
from palmares.version import VERSION

SCHEMA = "palmares-grasps-1"
UNITS = {
    "base": "m, quaternion x y z w",
    "hand_in_object": "m, quaternion x y z w",
    "joints": "rad or m",
    "ticks": "0.01 s",
    "epsilon": "N",
    "contact_position": "m",
    "contact_force": "N",
}

Columns = TypeVar("Columns", Tries, Kept)


@dataclass(frozen=True)
class Settings:
    """What decides the contents of a file, beside the program."""

    hand: str
    """Name of the hand, or the path of a hand of one's own"""
    opened: list[float]
    closed: list[float]
    tries: int
    """Of each object"""
    poses: int
    """Most poses of each object"""
    drawn_hands: int
    seed: int


class GraspFile:
    """A file of grasps, to read and to continue.

    Args:
        path: The file.
        settings: Of a file that is written; left out, the file is only read.

    Raises:
        ValueError: The file has another schema, or was begun with other settings or another engine.
        OSError: It cannot be opened.

    """

    def __init__(self, path: Path, settings: Settings | None = None, reach: Reach | None = None) -> None:
        self.path = path
        begun = path.exists() and path.stat().st_size > 0
        try:
            self._file = h5py.File(path, "r" if settings is None else "a")
        except OSError as error:
            raise OSError(
                f"{path}: it is no file of `palmares grasps`, or another process has it: {error}"
            ) from None
        try:
            if settings is None or begun:
                self._check(settings)
            else:
                assert reach is not None
                self._begin(settings, reach)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> GraspFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def settings(self) -> Settings:
        """How it was made."""
        return Settings(**json.loads(self._file.attrs["settings"]))

    @property
    def engine(self) -> str:
        """Fingerprint of the engine that played it."""
        return str(self._file.attrs["engine"])

    @property
    def reach(self) -> Reach:
        """How its hand takes hold."""
        group = self._file["hand"]
        given = {it.name: group.attrs[it.name] for it in fields(Reach)}
        return Reach(**{name: value if np.ndim(value) else _plain(value) for name, value in given.items()})

    @property
    def objects(self) -> list[str]:
        """Names of its objects."""
        return list(self._file["objects"])

    def poses(self, name: str) -> list[Pose] | None:
        """Return the poses at rest of an object; None if they are not known yet."""
        group = self._file["objects"].get(name)
        if group is None:
            return None
        rows = zip(group["pose_position"][:], group["pose_quat"][:], group["pose_share"][:], strict=True)
        return [Pose(array(position), array(quat), float(share)) for position, quat, share in rows]

    def body(self, name: str) -> SceneBody:
        """Return an object with its shapes, in a frame of its own."""
        return msgspec.json.decode(self._group(name).attrs["body"], type=SceneBody)

    def add_object(self, subject: Subject, body: SceneBody, poses: list[Pose]) -> None:
        """Add an object with its poses at rest."""
        group = self._file["objects"].create_group(subject.name)
        group.attrs["own"] = subject.own
        for name, contents in subject.files:
            group[f"files/{name}"] = np.frombuffer(contents, dtype=np.uint8)
        group.attrs["body"] = msgspec.json.encode(body).decode()
        group.attrs["mass_kg"], group.attrs["friction"] = body.mass, body.friction
        group["pose_position"] = array([pose.position for pose in poses])
        group["pose_quat"] = array([pose.quat for pose in poses])
        group["pose_share"] = array([pose.share for pose in poses])
        self._file.flush()

    def files(self, name: str) -> tuple[tuple[str, bytes], ...]:
        """Return the files of an object of one's own: path in the folder of its scene, contents."""
        found: list[tuple[str, bytes]] = []

        def visit(path: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset):
                found.append((path, item[:].tobytes()))

        group = self._group(name)
        if "files" in group:
            group["files"].visititems(visit)
        return tuple(found)

    def is_done(self, name: str, pose: int) -> bool:
        """Whether all tries of an object in a pose are there."""
        return f"objects/{name}/pose_{pose}" in self._file

    def add(self, found: Explored) -> None:
        """Add what a job found; it is there as a whole or not at all."""
        objects = self._file[f"objects/{found.job.subject.name}"]
        name = f"pose_{found.job.pose_number}"
        group = objects.create_group("_" + name)
        group.attrs["scene"] = found.scene
        for part, columns in (("tries", found.tries), ("kept", found.kept)):
            inner = group.create_group(part)
            for field in fields(columns):
                data = np.asarray(getattr(columns, field.name))
                small = (
                    data.astype(np.float32)
                    if field.name.startswith("contact_") and data.dtype == float
                    else data
                )
                dataset = inner.create_dataset(
                    field.name, data=small, compression="gzip" if small.size > 64 else None
                )
                if field.name in UNITS:
                    dataset.attrs["unit"] = UNITS[field.name]
        self._file.flush()
        objects.move("_" + name, name)
        self._file.flush()

    def sections(self) -> Iterator[tuple[str, int]]:
        """Yield each object with the number of each pose whose tries are there."""
        for name in self.objects:
            group = self._file[f"objects/{name}"]
            for key in sorted(key for key in group if key.startswith("pose_") and key[5:].isdigit()):
                yield name, int(key[5:])

    def tries(self, name: str, pose: int) -> Tries:
        """Return the tries of an object in a pose."""
        return self._columns(Tries, name, pose, "tries")

    def kept(self, name: str, pose: int) -> Kept:
        """Return the kept grasps of an object in a pose."""
        return self._columns(Kept, name, pose, "kept")

    def scene(self, name: str, pose: int) -> str:
        """Return the ``task.toml`` of an object in a pose."""
        return str(self._section(name, pose).attrs["scene"])

    def _columns(self, kind: type[Columns], name: str, pose: int, part: str) -> Columns:
        group = self._section(name, pose)[part]
        return kind(**{field.name: group[field.name][:] for field in fields(kind)})

    def _group(self, name: str) -> Any:
        if name not in self._file["objects"]:
            raise ValueError(f"{self.path}: found object {name!r}; wanted one of {', '.join(self.objects)}")
        return self._file["objects"][name]

    def _section(self, name: str, pose: int) -> Any:
        group = self._group(name)
        if f"pose_{pose}" not in group:
            there = ", ".join(str(number) for object_name, number in self.sections() if object_name == name)
            raise ValueError(f"{self.path}: {name}: found pose {pose}; wanted one of {there or 'none'}")
        return group[f"pose_{pose}"]

    def _begin(self, settings: Settings, reach: Reach) -> None:
        attributes = self._file.attrs
        attributes["schema"], attributes["program"] = SCHEMA, VERSION
        attributes["engine"] = identity().engine
        attributes["settings"] = json.dumps(asdict(settings))
        attributes["fates"], attributes["steps_ms"] = FATES, STEPS_MS
        hand = self._file.create_group("hand")
        for field in fields(reach):
            hand.attrs[field.name] = getattr(reach, field.name)
        self._file.create_group("objects")

    def _check(self, settings: Settings | None) -> None:
        found = self._file.attrs.get("schema")
        if found != SCHEMA:
            raise ValueError(f"{self.path}: found schema {found!r}; wanted {SCHEMA}")
        if settings is None:
            return
        there, here = self.settings, settings
        for field in fields(Settings):
            before, now = getattr(there, field.name), getattr(here, field.name)
            if before != now:
                raise ValueError(
                    f"{self.path}: it was begun with {field.name} {before}, not {now}: "
                    "give the same, or another --out"
                )
        engine = self._file.attrs["engine"]
        if engine != identity().engine:
            raise ValueError(
                f"{self.path}: it was begun by engine {engine}, not {identity().engine}: give another --out"
            )
        for name in self.objects:
            for key in [key for key in self._file[f"objects/{name}"] if key.startswith("_")]:
                del self._file[f"objects/{name}/{key}"]  # An interrupted write.


@dataclass(frozen=True)
class Total:
    """Counts of an object over all its poses."""

    name: str
    poses: int
    tries: int
    kept: int
    """Tries whose object stayed in the hand, with the step of the search"""
    apart: int
    """Those that differ from each other"""
    survived: int
    """Of these, those that are kept at every one of `STEPS_MS`"""
    drawn_share: float | None
    """Part of the drawn hands in which these are kept; None without drawn hands"""


def totals(file: GraspFile) -> list[Total]:
    """Return the counts of every object."""
    found = []
    for name in file.objects:
        poses = [pose for other, pose in file.sections() if other == name]
        tries = [file.tries(name, pose) for pose in poses]
        kept = [file.kept(name, pose) for pose in poses]
        every = [it.survived.all(axis=1) for it in kept]
        drawn = [it.drawn_survived[rows] for it, rows in zip(kept, every, strict=True)]
        survived, hands = count(every), file.settings.drawn_hands
        share = None
        if hands and survived:
            share = total(np.concatenate(drawn)) / (hands * survived)
        found.append(
            Total(
                name,
                len(poses),
                count([np.ones(len(it.fate), dtype=bool) for it in tries]),
                count([it.fate == FATES.index("kept") for it in tries]),
                count([np.ones(len(it.row), dtype=bool) for it in kept]),
                survived,
                share,
            )
        )
    return found


def count(marks: list[Any]) -> int:
    """Return how many marks are set."""
    return int(np.count_nonzero(np.concatenate([np.zeros(0, dtype=bool), *marks])))


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
