"""Observations as arrays, and their spaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces

from palmares.arrays import Array, array
from palmares.channels import array_of, depth_of, early_channels
from palmares.messages import Observation
from palmares.scene import Scene, SceneBody
from palmares.wire import CameraInfo, ChannelInfo, HandInfo, TaskInfo

Arrays: TypeAlias = dict[str, Array]

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
    found = {channel.name: array_of(channel, obs.hand) for channel in channels}
    for name, image in obs.cameras.items():
        found[f"depth.{name}"] = np.nan_to_num(image.depth, nan=0.0)
    if obs.truth is not None:
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


def cameras_of(task: TaskInfo, hand: HandInfo) -> dict[str, CameraInfo]:
    """Return the cameras of a task and a hand by their names in a run."""
    found = {camera.name: camera for camera in task.cameras}
    for camera in hand.cameras:
        found[f"hand_{camera.name}" if camera.name in found else camera.name] = camera
    return found


def depth_space(cameras: dict[str, CameraInfo], name: str) -> spaces.Box:
    """Return the space of a camera's depth, m.

    Raises:
        ValueError: There is no such camera.

    """
    if name not in cameras:
        raise ValueError(f"cameras: found {name!r}; wanted some of {', '.join(cameras) or 'none'}")
    depth = depth_of(cameras[name])
    return spaces.Box(depth.minimum, depth.maximum, tuple(depth.shape), dtype=np.float64)


def action_space(limits: tuple[float, float], motors: int) -> spaces.Dict:
    """Return the space of actions in SI units: ``twist`` (6,) and ``hand`` (motors,)."""
    most = np.repeat(limits, 3)
    found: dict[str, spaces.Space[Any]] = {
        "twist": spaces.Box(-most, most, dtype=np.float64),
        "hand": spaces.Box(0.0, 1.0, (motors,), dtype=np.float64),
    }
    return spaces.Dict(found)


def _kind(body: SceneBody) -> float:
    return float(KINDS.index(body.parts[0].shape.type)) if len(body.parts) == 1 else float(len(KINDS))
