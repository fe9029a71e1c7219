"""The linear behaviour of a step: central differences of many copies of a world, all at once.

A step solves a convex problem, and its solution is differentiable by the implicit function theorem where no
contact begins, ends or changes between sticking and sliding. But the gaps and normals of contacts come from a
geometry library that gives no derivatives, so that the theorem would need differences of them all the same:
differences of whole steps are simpler, and include everything.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palmares.arguments import is_real, table, whole
from palmares.arrays import Array, array
from palmares.reproducible import cos, dots, norms, sin
from palmares.sim.batch import Batch
from palmares.sim.state import State, state_of
from palmares.sim.world import World
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Linear(Brief):
    """``dx' = A dx + B du`` of some ticks under one action.

    x is a vector of small changes: base (6: position in m, turn as a rotation vector in rad, world frame),
    joints, each object (6), σ of each motor; then their velocities in the same order. u is an action as in
    `Batch.step`: linear and angular velocity of the base, σ of each motor.
    """

    A: Array
    """(n, n)"""
    B: Array
    """(n, 6 + motors)"""
    names: tuple[str, ...]
    """(n,) name of each entry of x"""
    state: State
    """The state after the ticks"""


def linearise(world: World, action: ArrayLike, ticks: int = 1, step: float = 1e-6) -> Linear:
    """Return the linear behaviour of a world under an action; the world itself does not move.

    Args:
        world: The world.
        action: (6 + motors,): linear (m/s) and angular (rad/s) velocity of the base, σ of each motor.
        ticks: Ticks under the action.
        step: Change of each entry for the differences, in its unit. Too small a step shows the tolerance of
            the solver, too large a one the curvature; from 1e-7 to 1e-5 the results agree in smooth motion.

    Raises:
        ValueError: An argument is out of bounds.

    """
    ticks = whole("ticks", ticks, 1, 10_000)
    if not (is_real(step) and 0.0 < step <= 0.01):
        raise ValueError(f"step: found {step}; wanted a number above 0, at most 0.01")
    now = world.state()
    shape = _Shape(now)
    motors = len(now.motors)
    given = table("action", action, 6 + motors)
    count = 1 + 2 * (shape.size + len(given))
    batch = Batch(world._task, world._hand, count, noise=world._noise, training=world._training)
    batch.clipping.mute()
    kept = world.snapshot()
    for k in range(count):
        batch.restore(k, kept)
    changes = np.zeros((count, shape.size))
    actions = np.tile(given, (count, 1))
    for k in range(shape.size + len(given)):
        place, row = (changes, k) if k < shape.size else (actions, k - shape.size)
        place[1 + 2 * k, row] += step
        place[2 + 2 * k, row] -= step
    batch.set_state(shape.moved(now, changes))
    batch.step(actions, ticks)
    after = batch.state()
    more, less = (shape.rows(after, slice(first, None, 2)) for first in (1, 2))
    slopes = (shape.difference(more, less) / (2.0 * step)).T
    first = State(**{name: getattr(after, name)[0] for name in shape.parts})
    return Linear(slopes[:, : shape.size], slopes[:, shape.size :], shape.names, first)


class _Shape:
    """The order of small changes in a vector."""

    parts = ("base", "q", "joint_velocity", "motors", "objects", "tension")

    def __init__(self, state: State) -> None:
        self.joints, self.objects, self.motors = len(state.q), len(state.objects), len(state.motors)
        axes = ("x", "y", "z", "rx", "ry", "rz")
        places = [f"base.{axis}" for axis in axes] + [f"q.{k}" for k in range(self.joints)]
        places += [f"object_{k}.{axis}" for k in range(self.objects) for axis in axes]
        places += [f"motor_{k}" for k in range(self.motors)]
        self.half = len(places)
        self.size = 2 * self.half
        self.names = (*places, *(f"velocity of {name}" for name in places))

    def moved(self, state: State, changes: Array) -> State:
        """Return a state of a batch: this one with small changes (N, size)."""
        count = len(changes)
        place, speed = changes[:, : self.half], changes[:, self.half :]
        tiled = {name: np.repeat(getattr(state, name)[None], count, axis=0) for name in self.parts}
        end = 6 + self.joints
        bodies = end + 6 * self.objects
        tiled["base"] = _moved(tiled["base"], place[:, :6], speed[:, :6])
        tiled["q"] = tiled["q"] + place[:, 6:end]
        tiled["joint_velocity"] = tiled["joint_velocity"] + speed[:, 6:end]
        objects = (count, self.objects, 6)
        tiled["objects"] = _moved(
            tiled["objects"], place[:, end:bodies].reshape(objects), speed[:, end:bodies].reshape(objects)
        )
        tiled["motors"] = tiled["motors"] + np.stack([place[:, bodies:], speed[:, bodies:]], axis=-1)
        return state_of(tiled, None)

    def rows(self, state: State, which: slice) -> State:
        """Return some rows of a state of a batch."""
        return State(**{name: getattr(state, name)[which] for name in self.parts})

    def difference(self, more: State, less: State) -> Array:
        """Return the small changes (N, size) that lead from one state to the other."""
        count = len(more.q)
        base_place, base_speed = _difference(more.base, less.base)
        place, speed = _difference(more.objects, less.objects)
        motors = more.motors - less.motors
        return np.concatenate(
            [
                base_place,
                more.q - less.q,
                place.reshape(count, -1),
                motors[..., 0],
                base_speed,
                more.joint_velocity - less.joint_velocity,
                speed.reshape(count, -1),
                motors[..., 1],
            ],
            axis=1,
        )


def _moved(bodies: Array, place: Array, speed: Array) -> Array:
    """Return bodies (…, 13) that are moved and turned by (…, 6) and faster by (…, 6)."""
    moved = bodies.copy()
    moved[..., :3] += place[..., :3]
    turned = (place[..., 3:] != 0.0).any(axis=-1)
    quats = _product(_quat_of_turn(place[..., 3:]), bodies[..., 3:7])
    moved[..., 3:7] = np.where(turned[..., None], quats, bodies[..., 3:7])
    moved[..., 7:] += speed
    return moved


def _difference(more: Array, less: Array) -> tuple[Array, Array]:
    back = less[..., 3:7] * [-1.0, -1.0, -1.0, 1.0]
    turn = _product(more[..., 3:7], back)
    # Small turns: twice the vector part.
    turn = 2.0 * turn[..., :3] * np.sign(turn[..., 3:])
    place = np.concatenate([more[..., :3] - less[..., :3], turn], axis=-1)
    return place, more[..., 7:] - less[..., 7:]


def _quat_of_turn(turn: Array) -> Array:
    half = 0.5 * norms(turn)
    shares = [(sin(angle) / angle if angle > 0.0 else 1.0, cos(angle)) for angle in half.ravel().tolist()]
    sine, cosine = np.moveaxis(array(shares, *half.shape, 1, 2), -1, 0)
    return np.concatenate([0.5 * sine * turn, cosine], axis=-1)


def _product(a: Array, b: Array) -> Array:
    """Return the product of quaternions x, y, z, w."""
    vector = a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3] + np.cross(a[..., :3], b[..., :3])
    scalar = a[..., 3:] * b[..., 3:] - dots(a[..., :3], b[..., :3])[..., None]
    return np.concatenate([vector, scalar], axis=-1)
