"""One object in one pose: tries in rounds, and the kept grasps tried again."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palmares.analysis import Contact, quality
from palmares.arrays import Array, array
from palmares.grasps.hand import Reach
from palmares.grasps.play import FATES, Grip, Outcome, Table
from palmares.grasps.sample import Candidates, candidates, joined, near
from palmares.grasps.scene import Pose, Subject, write_scene
from palmares.reproducible import acos, dots, matmul, norms
from palmares.rotation import matrix_of, quat_of
from palmares.scene import SceneBody
from palmares.sim import describe_hand
from palmares.training import Training

ROUND = 128
"""Tries of a round: those near successes of the rounds before, and new ones"""
NEAR = 0.75
"""Part of a round's tries that are near a success, where there is one"""
SEARCH_MS = 4.0
"""Step of the tries, ms"""
STEPS_MS = (1.0, 2.0, 4.0)
"""Steps at which a kept grasp is played, ms; the first is the task's own"""
APART_M, APART_DEG = 0.025, 25.0
"""Two grasps differ if the base's places in the object's frame are farther apart, or are turned by more"""


@dataclass(frozen=True)
class Job:
    """Tries of grasps of an object in one of its poses. The result is a function of this alone."""

    hand: str
    """Name of the hand, or the path of your own"""
    reach: Reach
    subject: Subject
    body: SceneBody
    pose: Pose
    pose_number: int
    tries: int
    drawn_hands: int
    """Hands drawn from the ranges of its ``[uncertain]``, in which kept grasps are played; 0 for none"""
    seed: int


@dataclass(frozen=True)
class Tries:
    """All tries of a job; every array has one entry for each."""

    base: Array
    """(n, 7), where the hand was to close, in the world of the scene: m, and x y z w"""
    approach: Array
    """(n, 3), unit vector along which it came, in the world"""
    parent: NDArray[np.int32]
    """(n,), the try near which this one was drawn, −1 for none"""
    fate: NDArray[np.uint8]
    """(n,), row of `FATES`"""
    points: Array
    """(n,), of the referee, at most 10"""
    ticks: NDArray[np.int32]
    """(n,), length of the run, in ticks"""
    state_hash: NDArray[np.bytes_]
    """(n,), digest of the world's state at the end"""


@dataclass(frozen=True)
class Kept:
    """Kept grasps that differ by `APART_M` or `APART_DEG`; every array has one entry for each."""

    row: NDArray[np.int32]
    """(k,), row of the try"""
    hand_in_object: Array
    """(k, 7), pose of the hand's base in the object's frame when the object was held: m, and x y z w"""
    joints: Array
    """(k, n), the hand's joint coordinates then, rad or m"""
    survived: NDArray[np.bool_]
    """(k, 3), whether it is kept at each of `STEPS_MS`"""
    points: Array
    """(k, 3), of the referee at each of them"""
    state_hash: NDArray[np.bytes_]
    """(k,), digest of the world's state at the end of the run with the task's own step"""
    drawn_survived: NDArray[np.int32]
    """(k,), in how many of the drawn hands it is kept"""
    epsilon: Array
    """(k,), ε of Ferrari and Canny, N: the contacts' normal forces add up to 1 N, moments are divided by the
    largest distance of a contact from the object's centre of mass"""
    contact_start: NDArray[np.int32]
    """(k + 1,), first row of each one's contacts, and the end of the last"""
    contact_link: NDArray[np.int32]
    """(c,), row of the hand's link"""
    contact_position: Array
    """(c, 3), in the object's frame, m"""
    contact_normal: Array
    """(c, 3), into the object"""
    contact_force: Array
    """(c, 3), on the object, N"""


@dataclass(frozen=True)
class Explored:
    """What a job found."""

    job: Job
    tries: Tries
    kept: Kept
    scene: str
    """The ``task.toml`` of its runs"""


def explore(job: Job, report: Callable[[int], None] | None = None) -> Explored:
    """Try the grasps of a job; call `report` with the number of new tries after each round."""
    with tempfile.TemporaryDirectory(prefix="palmares-grasps-") as name:
        folder = Path(name)
        write_scene(folder, job.subject, job.body, job.pose, job.reach)
        generator = np.random.default_rng([job.seed, job.pose_number, *job.subject.name.encode()])
        tries, parents, outcomes = _rounds(job, folder, generator, report or (lambda _: None))
        kept = _kept(job, folder, tries, outcomes)
        text = (folder / "task.toml").read_text()
    return Explored(job, _tries(tries, parents, outcomes), kept, text)


def _rounds(
    job: Job, folder: Path, generator: np.random.Generator, report: Callable[[int], None]
) -> tuple[Candidates, list[int], list[Outcome]]:
    table = Table(folder, job.hand, job.reach, training=Training(step_ms=SEARCH_MS), threads=1)
    tries, parents, outcomes = list[Candidates](), list[int](), list[Outcome]()
    while len(outcomes) < job.tries:
        count = min(ROUND, job.tries - len(outcomes))
        good = [row for row, outcome in enumerate(outcomes) if outcome.fate not in ("missed", "fault")]
        drawn = int(NEAR * count) if good else 0
        some = [candidates(job.reach, job.body, job.pose, generator, count - drawn)]
        parents += [-1] * (count - drawn)
        if drawn:
            chosen = [good[int(k)] for k in generator.integers(len(good), size=drawn)]
            some.append(near(job.reach, joined(tries), chosen, generator))
            parents += chosen
        tries.append(joined(some))
        found = dict(table.play(tries[-1]))
        outcomes += [found[row] for row in range(count)]
        report(count)
    return joined(tries), parents, outcomes


def _tries(tries: Candidates, parents: list[int], outcomes: list[Outcome]) -> Tries:
    return Tries(
        np.hstack([tries.position, tries.quat]),
        tries.approach,
        np.array(parents, dtype=np.int32),
        np.array([FATES.index(it.fate) for it in outcomes], dtype=np.uint8),
        array([it.points for it in outcomes]),
        np.array([it.ticks for it in outcomes], dtype=np.int32),
        np.array([it.state_hash.encode() for it in outcomes], dtype="S16"),
    )


def _kept(job: Job, folder: Path, tries: Candidates, outcomes: list[Outcome]) -> Kept:
    """Play the kept tries again, with other steps and in other hands."""
    rows = _apart([(row, it.grip) for row, it in enumerate(outcomes) if it.fate == "kept" and it.grip])
    chosen = tries.at(rows)
    again: list[list[Outcome]] = []
    for step_ms in STEPS_MS:
        if step_ms == SEARCH_MS:
            again.append([outcomes[row] for row in rows])
            continue
        training = None if step_ms == STEPS_MS[0] else Training(step_ms=step_ms)
        again.append(_played(Table(folder, job.hand, job.reach, training=training, threads=1), chosen))
    drawn = np.zeros(len(rows), dtype=np.int32)
    for number in range(job.drawn_hands):
        training = Training(step_ms=SEARCH_MS, randomise=("hand",))
        table = Table(folder, job.hand, job.reach, training=training, threads=1, seed=job.seed + number)
        drawn += np.array([it.fate == "kept" for it in _played(table, chosen)], dtype=np.int32)
    # The task's own step decides how the object is held; another step's, where it is not.
    grips = [next(it.grip for it in each if it.grip is not None) for each in zip(*again, strict=True)]
    joints = len(grips[0].q) if grips else 0
    counts = [len(grip.links) for grip in grips]
    bases = array([_inverse(grip.object_in_hand) for grip in grips]).reshape(len(grips), 7)
    survived = np.array([[it.fate == "kept" for it in each] for each in zip(*again, strict=True)], dtype=bool)
    survived = survived.reshape(-1, len(STEPS_MS))
    return Kept(
        np.array(rows, dtype=np.int32),
        bases,
        array([grip.q for grip in grips]).reshape(len(grips), joints),
        survived,
        array([[it.points for it in each] for each in zip(*again, strict=True)]).reshape(-1, len(STEPS_MS)),
        np.array([it.state_hash.encode() for it in again[0]], dtype="S16"),
        drawn,
        _qualities(job, grips),
        np.cumsum([0, *counts], dtype=np.int32),
        np.concatenate([np.zeros(0, dtype=np.int32), *(grip.links for grip in grips)]).astype(np.int32),
        *(
            np.concatenate([np.zeros((0, 3)), *(getattr(grip, name) for grip in grips)])
            for name in ("position", "normal", "force")
        ),
    )


def _played(table: Table, tries: Candidates) -> list[Outcome]:
    found = dict(table.play(tries))
    return [found[row] for row in range(len(tries))]


def _inverse(pose: Array) -> Array:
    """Return the pose of the hand in the object's frame, of that of the object in the hand's."""
    back = matrix_of(pose[3:]).T
    return array([*-matmul(back, pose[:3]), *quat_of(back)])


def _qualities(job: Job, grips: list[Grip]) -> Array:
    """Return ε of each grasp; 0 without contacts that resist every wrench."""
    links = describe_hand(job.hand)["links"]
    friction = {row: _friction(link) for row, link in enumerate(links)}
    com = array([*job.body.com, 0.0, 0.0, 0.0, 1.0])
    found = []
    for grip in grips:
        contacts = [
            Contact("", point, normal, friction=math.sqrt(friction[int(link)] * job.body.friction))
            for link, point, normal in zip(grip.links, grip.position, grip.normal, strict=True)
        ]
        found.append(quality(contacts, com).epsilon if len(contacts) > 1 else 0.0)
    return array(found)


def _friction(link: dict[str, object]) -> float:
    """Return the mean coefficient of a link's shapes; 0 of a link without shapes."""
    shapes = link["shapes"]
    assert isinstance(shapes, list)
    values = [float(shape["friction"]) for shape in shapes]
    return math.fsum(values) / len(values) if values else 0.0


def _apart(grasps: list[tuple[int, Grip]]) -> list[int]:
    """Return the rows of grasps, of which each is far from all before it."""
    rows, bases = list[int](), np.zeros((0, 7))
    for row, grip in grasps:
        base = _inverse(grip.object_in_hand)
        away = norms(bases[:, :3] - base[:3]) > APART_M
        cosines = np.minimum(1.0, np.abs(dots(bases[:, 3:], base[None, 3:])))
        turned = array([2.0 * acos(c) for c in cosines.tolist()]) > math.radians(APART_DEG)
        if (away | turned).all():
            rows.append(row)
            bases = np.concatenate([bases, base[None]])
    return rows


ARRAYS = {kind: tuple(field.name for field in fields(kind)) for kind in (Tries, Kept)}
"""Names of the arrays of `Tries` and `Kept`"""
