"""Fill a file of grasps: all objects, in all their poses, on all cores."""

from __future__ import annotations

import math
import multiprocessing
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, TypeAlias

from palmares.evaluate.workers import cores
from palmares.grasps.explore import Explored, Job, explore
from palmares.grasps.file import GraspFile, Settings
from palmares.grasps.hand import reach_of
from palmares.grasps.scene import Pose, Subject, poses_at_rest, subjects_of
from palmares.reproducible import total
from palmares.scene import SceneBody
from palmares.sim import World, describe_hand

Pool: TypeAlias = Callable[[Callable[[Any], Any], Sequence[Any]], Iterator[Any]]
"""Calls a function with each of some arguments and yields the results, in any order"""

TRIES, POSES, DRAWN_HANDS = 1500, 4, 2


def make(
    hand: str,
    objects: Iterable[str],
    path: str | os.PathLike[str],
    *,
    tries: int = TRIES,
    poses: int = POSES,
    drawn_hands: int | None = None,
    seed: int = 1,
    opened: Sequence[float] | None = None,
    closed: Sequence[float] | None = None,
    pool: Pool | None = None,
    on_found: Callable[[Explored], None] | None = None,
    on_planned: Callable[[int, int], None] | None = None,
) -> None:
    """Try grasps of objects and write them into a file; a file that was begun is continued.

    The file's contents are a function of these arguments and the engine alone, whatever the pool.

    Args:
        hand: Name of the hand, or the path of your own.
        objects: Names of the catalogue, and folders of tasks, for all of their own objects.
        path: The file.
        tries: Number of tries of each object, over all its poses.
        poses: Most poses at rest of each object, the commonest first.
        drawn_hands: Hands drawn from the ranges of ``[uncertain]`` in which kept grasps are played; left out,
            `DRAWN_HANDS`, and none for a hand without ranges.
        seed: Of what is drawn.
        opened: σ of every motor on the way to the object; left out, of the hand's recipe, or else 0.
        closed: σ of every motor in the grasp; left out, of the recipe, or else 1.
        pool: Where the work is done; left out, on all cores of this machine.
        on_found: Called with each finished part, after it is in the file.
        on_planned: Called with the number of tries that are there, and of all.

    Raises:
        ValueError: An argument is wrong, or the file was begun with others.
        OSError: The file cannot be written.

    """
    subjects = [subject for text in dict.fromkeys(objects) for subject in subjects_of(text)]
    reach = reach_of(hand, opened, closed)
    uncertain = bool(describe_hand(hand).get("uncertain"))
    drawn = (DRAWN_HANDS if uncertain else 0) if drawn_hands is None else drawn_hands
    if drawn and not uncertain:
        raise ValueError(f"drawn_hands: found {drawn}; {reach.name} has no [uncertain], so wanted 0")
    settings = Settings(hand, reach.opened.tolist(), reach.closed.tolist(), tries, poses, drawn, seed)
    run = pool or processes()
    with GraspFile(Path(path), settings, reach) as file:
        missing = [(hand, subject, poses) for subject in subjects if file.poses(subject.name) is None]
        for subject, body, found in run(_prepare, missing):
            file.add_object(subject, body, found)
        jobs = []
        there = 0
        for subject in subjects:
            name = subject.name
            at_rest = file.poses(name) or []
            for number, pose in enumerate(at_rest):
                count = math.ceil(tries / len(at_rest))
                if file.is_done(name, number):
                    there += count
                else:
                    body = file.body(name)
                    jobs.append(Job(hand, reach, subject, body, pose, number, count, drawn, seed))
        if on_planned is not None:
            on_planned(there, there + int(total([job.tries for job in jobs])))
        for explored in run(explore, jobs):
            file.add(explored)
            if on_found is not None:
                on_found(explored)


def processes(count: int | None = None) -> Pool:
    """Return a pool of processes of this machine, one for each core when `count` is left out."""

    def run(function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[Any]:
        if not items:
            return
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(min(count or cores(), len(items)), mp_context=context) as executor:
            futures = [executor.submit(function, item) for item in items]
            try:
                for future in as_completed(futures):
                    yield future.result()
            finally:
                for future in futures:
                    future.cancel()

    return run


def _prepare(item: tuple[str, Subject, int]) -> tuple[Subject, SceneBody, list[Pose]]:
    """Return an object's description and its poses at rest."""
    hand, subject, most = item
    with tempfile.TemporaryDirectory(prefix="palmares-grasps-") as folder:
        found = poses_at_rest(subject, hand, Path(folder), most)
        return subject, World(folder, hand, seed=1).scene.free[0], found
