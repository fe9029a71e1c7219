"""Tries of grasps: runs of the task `grasp`, many at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palmares._native import Snapshot
from palmares.arrays import Array, array
from palmares.grasps.course import COME, TICKS, Course
from palmares.grasps.hand import Reach
from palmares.grasps.sample import Candidates
from palmares.reproducible import matmul
from palmares.rotation import matrix_of, quat_of
from palmares.sim import Batch
from palmares.sim.batch import Arrays
from palmares.training import Training

MOVED_M = 0.002
"""The hand stops its approach when the object has moved by this"""
BEHIND_M, STANDS = 0.015, 0.03
"""It also stops when its base stands, slower than this, m/s, so far from where it should be"""
EARLY_TICKS, RISEN_M = 30, 0.02
"""From so many ticks before the end of the lift, an object that has not risen by this is lost"""
HOLD_TICKS = 600
"""Ticks after the lift in which the shake has to begin"""
LIFTED, HELD, SHAKEN = 1.0, 4.0, 7.0
"""Points of the referee from which the object was lifted, held still and kept through the shake"""
FATES = ("kept", "missed", "dropped", "slipped", "shaken_off", "fault")
"""kept through the shake; never lifted; lifted and lost; not held still for two seconds; lost in the shake;
the world faulted"""
MOST_CONTACTS = 48


@dataclass(frozen=True)
class Grip:
    """A held object, just before the shake."""

    object_in_hand: Array
    """(7,), pose of the object in the frame of the hand's base"""
    q: Array
    """(n,), the hand's joint coordinates, rad or m"""
    links: NDArray[np.int64]
    """(k,), row of the hand's link at each contact with the object"""
    position: Array
    """(k, 3), of each contact in the object's frame, m"""
    normal: Array
    """(k, 3), into the object"""
    force: Array
    """(k, 3), on the object, N"""


@dataclass(frozen=True)
class Outcome:
    """What became of a try."""

    fate: str
    """One of `FATES`"""
    points: float
    """Of the referee, at most 10"""
    ticks: int
    """Length of the run, in ticks"""
    state_hash: str
    """Digest of the world's state at the end, 16 hexadecimal digits"""
    grip: Grip | None
    """Only of objects that were held"""


class Table:
    """Worlds of one scene in which grasps are tried.

    Args:
        scene: Folder of the task.
        hand: Name of the hand, or the path of your own.
        reach: How it takes hold.
        worlds: How many tries are under way at once.
        threads: Threads that step; one for each core when left out.
        training: Longer steps, or drawn hands.
        seed: Of the runs; the scene is the same for all, drawn hands are not.

    """

    def __init__(
        self,
        scene: Path,
        hand: str,
        reach: Reach,
        worlds: int = 32,
        threads: int | None = None,
        training: Training | None = None,
        seed: int = 1,
    ) -> None:
        self._batch = Batch(str(scene), hand, worlds, base="pose", threads=threads, training=training)
        self._first = self._batch.reset([seed] * worlds)
        self._start: Snapshot = self._batch.snapshot(0)
        self._course = Course(worlds, self._first["base"][0, :7], reach)

    def play(
        self,
        tries: Candidates,
        actions_of_first: list[Array] | None = None,
        on_held: Callable[[Batch, int], None] | None = None,
    ) -> Iterator[tuple[int, Outcome]]:
        """Play all tries; yield each one's row and outcome as it ends.

        Args:
            tries: The grasps.
            actions_of_first: Takes the actions of the first world, (7 + motors,) each.
            on_held: Called with the worlds and the number of one whose object is held, before the shake.

        """
        batch, course, count = self._batch, self._course, self._batch.count
        at_rest = self._first["objects"][:, 0, :3]
        row, ticks = np.full(count, -1), np.zeros(count, dtype=np.int64)
        grips: list[Grip | None] = [None] * count
        waiting = iter(range(len(tries)))
        seen = self._first

        def begin(world: int) -> None:
            row[world] = next(waiting, -1)
            if row[world] >= 0:
                batch.restore(world, self._start)
                course.set(world, tries, int(row[world]))
                ticks[world], grips[world] = 0, None

        for world in range(count):
            begin(world)
        while (row >= 0).any():
            actions = course.actions(ticks)
            if actions_of_first is not None:
                actions_of_first.append(actions[0].copy())
            stepped = batch.step(actions, TICKS, row >= 0)
            ticks += TICKS
            seen, scores, over = stepped.observations, batch.scores, stepped.terminated | stepped.truncated
            phase = course.phase(ticks)
            moved = np.abs(seen["objects"][:, 0, :3] - at_rest).max(axis=1) > MOVED_M
            base = seen["base"]
            behind = np.abs(base[:, :3] - actions[:, :3]).max(axis=1) > BEHIND_M
            stands = np.abs(base[:, 7:10]).max(axis=1) < STANDS
            early = np.flatnonzero((phase == COME) & (moved | behind & stands) & (row >= 0))
            course.stop(early, ticks, seen["base"][early, :3])
            held = [w for w in np.flatnonzero((scores >= HELD) & (row >= 0)).tolist() if grips[w] is None]
            if held:
                for world, grip in zip(held, self._grips(held, seen), strict=True):
                    grips[world] = grip
                    if on_held is not None:
                        on_held(batch, world)
            late = course.since_lift(ticks)
            rise = seen["objects"][:, 0, 2] - at_rest[:, 2]
            lost = (late > -EARLY_TICKS) & (rise < RISEN_M) & (scores < HELD) | moved & (phase < COME)
            ended = np.flatnonzero((row >= 0) & (over | lost | (late > HOLD_TICKS) & (scores < HELD)))
            if not len(ended):
                continue
            hashes = batch.state_hashes()
            for world in ended.tolist():
                fate = self._fate(world, float(scores[world]), bool(over[world]), bool(lost[world]))
                yield (
                    int(row[world]),
                    Outcome(fate, float(scores[world]), int(ticks[world]), hashes[world], grips[world]),
                )
                begin(world)

    def _fate(self, world: int, score: float, over: bool, lost: bool) -> str:
        result = self._batch.result(world) if over else None
        if result is not None and result["fault"] is not None:
            return "fault"
        if score >= SHAKEN:
            return "kept"
        if score >= HELD:
            return "shaken_off"
        if score < LIFTED:
            return "missed"
        return "dropped" if lost or over else "slipped"

    def _grips(self, worlds: list[int], seen: Arrays) -> list[Grip]:
        """Return how the hands of some worlds hold their objects."""
        found = self._batch.contacts(MOST_CONTACTS)
        links = self._batch.mechanics("links")["links"].shape[1]
        grips = []
        for world in worlds:
            base, held = seen["base"][world, :7], seen["objects"][world, 0, :7]
            hand, turn = matrix_of(base[3:]), matrix_of(held[3:])
            bodies, mask = found["bodies"][world], found["mask"][world].astype(bool)
            rows = np.flatnonzero(
                mask & (bodies[:, 0] >= 0) & (bodies[:, 0] < links) & (bodies[:, 1] == links)
            )
            local = [matmul(found[name][world][rows], turn) for name in ("normal", "force")]
            grips.append(
                Grip(
                    array([*matmul(hand.T, held[:3] - base[:3]), *quat_of(matmul(hand.T, turn))]),
                    array(seen["joints"][world, 0]),
                    bodies[rows, 0],
                    matmul(found["position"][world][rows] - held[:3], turn),
                    local[0],
                    local[1],
                )
            )
        return grips
