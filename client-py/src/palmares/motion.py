"""Deprecated name of parts of `palmares.skills`, for controllers of 0.1.0; 0.3.0 removes it."""

import importlib
import warnings
from typing import Any

_PARTS = ("motion", "objects", "grasps", "attempts", "runs")
_ROTATIONS = ("angle_between", "matrix_of", "quat_of", "rot_y", "rot_z", "rot_zyz", "slerp")


def __getattr__(name: str) -> Any:
    parts = ["palmares.rotation"] if name in _ROTATIONS else [f"palmares.skills.{part}" for part in _PARTS]
    for part in parts:
        module = importlib.import_module(part)
        if name in vars(module):
            text = f"palmares.motion.{name} is now {part}.{name}"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return vars(module)[name]
    raise AttributeError(f"module 'palmares.motion' has no attribute {name!r}")
