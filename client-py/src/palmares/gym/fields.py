"""Observations as arrays, and their spaces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from palmares.arrays import array
from palmares.channels import array_of, early_channels
from palmares.messages import Observation, Specs
from palmares.scene import Scene, SceneBody
from palmares.targets import BaseKind
from palmares.wire import ArmJointInfo, ChannelInfo

Arrays: TypeAlias = dict[str, NDArray[Any]]

ACTIONS = {
    "twist": ("base.linear", "base.angular"),
    "pose": ("base.position", "base.quat_xyzw"),
}
"""Fields of an action for the base"""
# Nothing in a sound world is larger, in any unit.
LARGEST = 1e9
KINDS = ("sphere", "capsule", "cylinder", "box", "hull")


def arrays_of(obs: Observation, channels: Sequence[ChannelInfo] | None = None) -> Arrays:
    """Return an observation as arrays; their shapes are in the docstring of `PalmaresEnv`.

    Args:
        obs: The observation.
        channels: `HandInfo.channels` of its hand. Without them, the arrays are ``base``, ``motors``,
            ``wrist``, and, with a hand that has them, ``encoders``, ``touch`` and ``acceleration``.

    """
    if channels is None:
        hand = obs.hand
        lengths = (len(hand.actuators), hand.joints.size, len(hand.touch))
        channels = early_channels(*lengths, acceleration=hand.acceleration is not None)
    found: Arrays = {channel.name: array_of(channel, obs.hand) for channel in channels}
    for name, image in obs.cameras.items():
        if image._depth is not None:
            found[f"depth_{name}"] = np.nan_to_num(image.depth, nan=0.0).astype(np.float32)
        if image._rgb is not None:
            found[f"rgb_{name}"] = image.rgb.copy()
    if obs.has_truth:
        truth = obs.truth
        found["objects"] = np.hstack([truth.positions, truth.quats_xyzw, truth.linear, truth.angular])
        found["joints"] = array([truth.joints.position, truth.joints.velocity])
    return found


def arrays_of_scene(scene: Scene) -> Arrays:
    """Return the constants of the objects: kind, half extents and mass."""
    free = scene.free
    return {
        "object_kind": array([_kind(body) for body in free]),
        "object_half_extents": array([body.half_extents for body in free], -1, 3),
        "object_mass": array([body.mass for body in free]),
    }


def padded(arrays: Arrays, objects: int | None) -> Arrays:
    """Return the arrays with `objects` rows; rows of missing objects are zero, their kind −1."""
    if objects is not None:
        for name, values in arrays.items():
            if name.startswith("object") and len(values) < objects:
                width = [(0, objects - len(values))] + [(0, 0)] * (values.ndim - 1)
                missing = -1.0 if name == "object_kind" else 0.0
                arrays[name] = np.pad(values, width, constant_values=missing)
    return arrays


def box(*shape: int) -> spaces.Box:
    """Return the space of arrays of this shape, with numbers up to `LARGEST`."""
    return spaces.Box(-LARGEST, LARGEST, shape, dtype=np.float64)


def base_space(base: BaseKind, specs: Specs, arm: Sequence[ArmJointInfo]) -> spaces.Box:
    """Return the space of an action for the base: (6,) of velocities, (7,) of a pose, (n,) of an arm.

    Joints without end are those within half a turn.

    Raises:
        ValueError: Joints of an arm that the task does not have.

    """
    if base == "joints":
        if not arm:
            raise ValueError("base: found 'joints', but the task has no arm; wanted 'twist' or 'pose'")
        low = array([-math.pi if joint.minimum is None else joint.minimum for joint in arm])
        high = array([math.pi if joint.maximum is None else joint.maximum for joint in arm])
    else:
        found = [specs.action_field(name) for name in ACTIONS[base]]
        low = np.concatenate([np.full(int(field.shape[0]), field.range[0]) for field in found])
        high = np.concatenate([np.full(int(field.shape[0]), field.range[1]) for field in found])
    return spaces.Box(low, high, dtype=np.float64)


def action_space(base: BaseKind, of_base: spaces.Box, motors: int) -> spaces.Dict:
    """Return the space of actions in SI units: ``twist``, ``pose`` or ``joints``, and ``hand`` (motors,)."""
    found: dict[str, spaces.Space[Any]] = {
        base: of_base,
        "hand": spaces.Box(0.0, 1.0, (motors,), dtype=np.float64),
    }
    return spaces.Dict(found)


def _kind(body: SceneBody) -> float:
    return float(KINDS.index(body.parts[0].shape.type)) if len(body.parts) == 1 else float(len(KINDS))
