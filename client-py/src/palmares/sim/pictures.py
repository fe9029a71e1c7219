"""Pictures of worlds in this process, of any size and from anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from palmares.arguments import is_real, whole
from palmares.arrays import Array, array
from palmares.reproducible import norm
from palmares.rotation import quat_of
from palmares.views import Brief

Kind = Literal["depth", "depth_mm", "rgb", "bodies", "film"]
KINDS: tuple[Kind, ...] = ("depth", "depth_mm", "rgb", "bodies", "film")
FILM = "film"
"""Name of a view that shows fingers and objects, and of the kind of pictures for people"""
MOST_PIXELS = 1280 * 720
"""Most pixels of a picture"""


@dataclass(frozen=True, repr=False)
class View(Brief):
    """A pinhole camera of your own in the world, without errors.

    >>> view = View.looking((0.5, -0.5, 0.5), at=(0.0, 0.0, 0.1))
    >>> view.fov_deg
    60.0
    """

    position: tuple[float, float, float]
    """m"""
    quat_xyzw: tuple[float, float, float, float]
    """Orientation of the optical frame: x to the right, y down, z forward"""
    fov_deg: float = 60.0
    """Horizontal field of view"""
    range_m: tuple[float, float] = (0.01, 10.0)
    """Nearest and farthest surface that has a depth"""
    link: str | None = None
    """The hand's link that carries it; the world when left out"""

    @classmethod
    def looking(
        cls,
        position: Sequence[float] | Array,
        at: Sequence[float] | Array,
        up: Sequence[float] | Array = (0.0, 0.0, 1.0),
        fov_deg: float = 60.0,
        link: str | None = None,
    ) -> View:
        """Return a view from a point towards another, both in the world or in the frame of a link.

        Raises:
            ValueError: The two points are one, or the view is along `up`.

        """
        forward = array(at) - array(position)
        right = np.cross(forward, array(up))
        far, aside = norm(forward), norm(right)
        if far < 1e-9 or aside < 1e-9 * far:
            raise ValueError(
                f"at: found {tuple(at)} from {tuple(position)}; wanted another point, not along up"
            )
        z, x = forward / far, right / aside
        quat = quat_of(np.column_stack([x, np.cross(z, x), z]))
        place = tuple(float(number) for number in position)
        return cls(place, tuple(quat.tolist()), fov_deg, link=link)  # type: ignore[arg-type]


@dataclass(frozen=True)
class PictureRequest:
    """A view as the compiled part takes it."""

    camera: str | None
    pose: tuple[float, ...] | None
    link: str | None
    fov_deg: float
    range_m: tuple[float, float]
    size: tuple[int, int] | None


def picture_request(camera: str | View, size: tuple[int, int] | None) -> PictureRequest:
    """Return the view, checked.

    Raises:
        ValueError: The size, the field of view or the range is out of bounds.

    """
    if size is not None:
        width, height = size
        size = (whole("size[0]", width, 1, MOST_PIXELS), whole("size[1]", height, 1, MOST_PIXELS))
    if isinstance(camera, str):
        return PictureRequest(camera, None, None, 60.0, (0.01, 10.0), size)
    near, far = camera.range_m
    if not (is_real(camera.fov_deg) and 1.0 <= camera.fov_deg <= 170.0):
        raise ValueError(f"fov_deg: found {camera.fov_deg}; wanted 1 to 170")
    if not (is_real(near) and is_real(far) and 0.0 < near < far):
        raise ValueError(f"range_m: found {camera.range_m}; wanted two distances, the nearer first")
    pose = (*camera.position, *camera.quat_xyzw)
    return PictureRequest(None, pose, camera.link, camera.fov_deg, (near, far), size)


def kinds_of(kinds: Sequence[Kind] | Kind) -> list[str]:
    """Return the kinds of pictures.

    Raises:
        ValueError: There is no such kind, or there is none.

    """
    chosen = [kinds] if isinstance(kinds, str) else list(kinds)
    if not chosen or any(kind not in KINDS for kind in chosen):
        raise ValueError(f"kinds: found {chosen}; wanted some of {', '.join(KINDS)}")
    return list(dict.fromkeys(chosen))
