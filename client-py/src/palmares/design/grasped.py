"""Goals that need an object under gravity: quality of the reached grasp, and grasps that succeed."""

from __future__ import annotations

import math
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palmares.analysis import held
from palmares.arrays import Array, array
from palmares.design.fields import Fields
from palmares.design.goals import SIZES, Common, Goal, Measured, placed
from palmares.evaluate.workers import cores
from palmares.grasp_task import fixed, grasp_task, own_object
from palmares.reproducible import matmul
from palmares.rotation import matrix_of, quat_of
from palmares.sim import World

TICK_S = 0.01
PARTS = 20
"""Parts in which the motors close and the hand rises"""
LIFT_M, LIFT_S, STILL_S = 0.05, 0.5, 0.3
"""How far and in what time the hand lifts the object, and how long it then waits"""
FREE_M = 0.0005
"""Distance of the object from the post at the start"""
POST = 0.5
"""Half width of the post under the object, in parts of the object's smallest half length"""
EDGES = 8
"""Edges of the pyramids inside the friction cones"""
POST_M = 0.15
"""Half height of the post"""
OBJECT = "object"
"""Its name"""
DOWN = array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
"""World from base: fingers down"""


@dataclass(frozen=True)
class Epsilon(Goal):
    """ε, N, of the contacts with which the hand holds an object after closing on it and lifting it."""

    kind, unit = "epsilon", "N"
    larger_is_better = True
    common: Common
    shape: str
    size: list[float]
    place: list[float]
    sigma: list[float]
    mass: float
    friction: float
    close_s: float

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        shape = fields.text("shape", of=tuple(SIZES))
        size = fields.numbers("size", SIZES[shape])
        places = placed(fields, "places")
        if len(places) != 1:
            raise fields.wrong("places", "one place")
        return cls(
            common,
            shape,
            size,
            places[0],
            fields.numbers("sigma", default=[1.0]),
            fields.number("mass", 0.1, above=0.0),
            fields.number("friction", 0.8, least=0.0),
            fields.number("close_s", 1.0, above=0.0),
        )

    def measure(self, hand: str) -> Measured:
        """Close on the object on its post, lift it and take the contacts; 0 if it is not held."""
        turn = matmul(DOWN, matrix_of(self.place[3:]))
        aside = matmul(DOWN, self.place[:3])
        height = _reach_down(self.shape, self.size, turn) + FREE_M
        base = array([-aside[0], -aside[1], height - aside[2]])
        quat = quat_of(DOWN).tolist()
        with tempfile.TemporaryDirectory(prefix="palmares-design-") as name:
            own = {
                "name": OBJECT,
                "source": "of the design file",
                "parts": [{"shape": self.shape, **_size(self.shape, self.size)}],
                "mass": self.mass,
                "friction": self.friction,
            }
            half = POST * min(self.size)
            text = grasp_task(
                "design",
                "One object on a post under a hand.",
                OBJECT,
                own_object(own),
                fixed(OBJECT, [0.0, 0.0, height], quat_of(turn)),
                base,
                quat,
                ("post", (half, half, POST_M)),
            )
            (Path(name) / "task.toml").write_text(text, encoding="utf-8")
            world = World(name, hand, seed=1)
        motors = len(self.sigma) if len(self.sigma) > 1 else len(world.observe().hand.actuators)
        closed = array(self.sigma * (1 if len(self.sigma) > 1 else motors))

        def go(share: float, rise: float, time_s: float) -> None:
            target = (base + array([0.0, 0.0, rise])).tolist(), quat
            world.step(base=target, hand=(share * closed).tolist(), repeat=max(1, round(time_s / TICK_S)))

        for k in range(1, PARTS + 1):
            go(k / PARTS, 0.0, self.close_s / PARTS)
        for k in range(1, PARTS + 1):
            go(1.0, LIFT_M * k / PARTS, LIFT_S / PARTS)
        go(1.0, LIFT_M, STILL_S)
        truth = world.observe("truth").truth
        if truth is None or float(truth.objects[0].position[2]) < height + 0.5 * LIFT_M:
            return Measured(0.0)
        grasp = held(world, OBJECT)
        return Measured(grasp.quality(edges=EDGES).epsilon if len(grasp.contacts) > 1 else 0.0)


def _size(shape: str, size: list[float]) -> dict[str, Any]:
    if shape == "sphere":
        return {"radius": size[0]}
    if shape == "cylinder":
        return {"radius": size[0], "height": 2.0 * size[1]}
    return {"size": [2.0 * half for half in size]}


def _reach_down(shape: str, size: list[float], turn: Array) -> float:
    """Return how far a turned shape reaches below its middle, m."""
    if shape == "sphere":
        return size[0]
    if shape == "cylinder":
        upright = min(1.0, abs(float(turn[2, 2])))
        return size[0] * math.sqrt(1.0 - upright * upright) + size[1] * upright
    return math.fsum(abs(float(turn[2, axis])) * half for axis, half in enumerate(size))


@dataclass(frozen=True)
class Probability(Goal):
    """Part of drawn grasps of objects on a table that last through the shake of the task `grasp`."""

    kind = "probability"
    larger_is_better = True
    common: Common
    objects: list[str]
    tries: int
    """Of each object"""
    opened: list[float] | None
    closed: list[float] | None
    seed: int
    _scenes: list[Any] = field(default_factory=list, repr=False, compare=False)
    """Each object with its pose at rest, found once"""

    @classmethod
    def read(cls, common: Common, fields: Fields) -> Goal:
        """Read it from its table."""
        sigma = {
            name: None if fields.raw(name) is None else fields.numbers(name) for name in ("opened", "closed")
        }
        objects = fields.texts("objects")
        try:
            from palmares.grasps.scene import subjects_of
        except ImportError as missing:
            raise ValueError(f"{fields.where}: {missing}") from None
        for name in objects:
            subjects_of(name)
        tries, seed = fields.whole("tries", 64, 1), fields.whole("seed", 1, 0)
        return cls(common, objects, tries, sigma["opened"], sigma["closed"], seed)

    def measure(self, hand: str) -> Measured:
        """Play the same number of tries on each object, in its commonest pose at rest."""
        from palmares.grasps.explore import SEARCH_MS
        from palmares.grasps.hand import reach_of
        from palmares.grasps.play import Table
        from palmares.grasps.sample import candidates
        from palmares.grasps.scene import poses_at_rest, subjects_of, write_scene
        from palmares.training import Training

        if not self._scenes:
            for subject in (subject for name in self.objects for subject in subjects_of(name)):
                with tempfile.TemporaryDirectory(prefix="palmares-design-") as name:
                    pose = poses_at_rest(subject, hand, Path(name), 1)[0]
                    body = World(name, hand, seed=1).scene.free[0]
                self._scenes.append((subject, body, pose))
        reach = reach_of(hand, self.opened, self.closed)

        def kept(scene: Any) -> int:
            subject, body, pose = scene
            generator = np.random.default_rng([self.seed, *subject.name.encode()])
            with tempfile.TemporaryDirectory(prefix="palmares-design-") as name:
                write_scene(Path(name), subject, body, pose, reach)
                training = Training(step_ms=SEARCH_MS)
                table = Table(Path(name), hand, reach, training=training, threads=1)
                tries = candidates(reach, body, pose, generator, self.tries)
                return len([1 for _, outcome in table.play(tries) if outcome.fate == "kept"])

        with ThreadPoolExecutor(cores()) as pool:
            counts = list(pool.map(kept, self._scenes))
        return Measured(math.fsum(counts) / (self.tries * len(counts)))
