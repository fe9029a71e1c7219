"""Images in observations."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from palmares.arguments import short
from palmares.channels import depth_of
from palmares.net.requests import names
from palmares.wire import CameraInfo, HandInfo, TaskInfo

if TYPE_CHECKING:
    from palmares.sim import View

FILM = "film"
"""The place from which fingers and objects are seen: only in this process"""
FILM_SIZE = (320, 240)
"""Width and height of its pictures"""


def cameras_of(task: TaskInfo, hand: HandInfo) -> dict[str, CameraInfo]:
    """Return the cameras of task and hand by the names that requests have."""
    cameras = {camera.name: camera for camera in task.cameras}
    for camera in hand.cameras:
        cameras[f"hand_{camera.name}" if camera.name in cameras else camera.name] = camera
    return cameras


def spaces_of(cameras: Iterable[str], known: dict[str, CameraInfo]) -> dict[str, spaces.Space[Any]]:
    """Return the space of each image: ``depth_NAME`` of a camera ``NAME``, ``rgb_NAME`` of ``NAME.rgb``.

    Raises:
        ValueError: There is no such camera, or it has no such image.

    """
    found: dict[str, spaces.Space[Any]] = {}
    for name in names(cameras):
        camera, _, kind = name.partition(".")
        if camera not in known or kind not in ("", "depth", "rgb"):
            wanted = ", ".join(f"{there}, {there}.rgb" for there in known) or "none"
            raise ValueError(f"cameras: found {short(name)}; wanted some of {wanted}")
        info = known[camera]
        if kind == "rgb":
            found[f"rgb_{camera}"] = spaces.Box(0, 255, (info.height, info.width, 3), dtype=np.uint8)
        else:
            depth = depth_of(info)
            shape = tuple(depth.shape)
            found[f"depth_{camera}"] = spaces.Box(depth.minimum, depth.maximum, shape, dtype=np.float32)
    return found


def view_of(camera: str | View | None, known: dict[str, CameraInfo], *, local: bool) -> str | View:
    """Return the camera of `render`: the given one, or the place of films, or the first of a server.

    Raises:
        ValueError: There is no such camera.

    """
    wanted = [*known, FILM] if local else list(known)
    if isinstance(camera, str) and camera not in wanted:
        names_of = ", ".join(wanted)
        raise ValueError(f"render_camera: found {short(camera)}; wanted one of {names_of}, or a View")
    if camera is None:
        return FILM if local else next(iter(known), "")
    return camera


def is_image(field: str) -> bool:
    """Whether a field of an observation is an image."""
    return field.startswith(("depth_", "rgb_"))
