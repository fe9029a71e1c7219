"""Images of cameras, as arrays."""

from __future__ import annotations

from functools import cached_property

import msgspec
import numpy as np
from numpy.typing import NDArray

from palmares import wire
from palmares.arrays import Array, Vec3, array
from palmares.png import grey, png
from palmares.reproducible import matmul
from palmares.rotation import matrix_of
from palmares.views import Rows, Viewed, vector


class Intrinsics(msgspec.Struct, kw_only=True, frozen=True):
    """A pinhole: the point (x, y, z) of the optical frame is at u = fx x/z + cx, v = fy y/z + cy.

    The middle of the first pixel is at 0.5, 0.5.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def matrix(self) -> Array:
        """Shape (3, 3): maps a point of the optical frame to homogeneous pixels."""
        return array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


class CameraImage(Viewed, wire.CameraImage, kw_only=True, dict=True):
    """An image of a camera. The optical frame has x to the right, y down and z forward.

    A notebook shows its colours, or its depth as greys.
    """

    @property
    def intrinsics(self) -> Intrinsics:
        """Focal lengths and axis."""
        return Intrinsics(
            width=self.width, height=self.height, fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy
        )

    @cached_property
    def depth(self) -> Array:
        """Distances along the optical axis, shape (height, width), m; NaN where there is no reading.

        Raises:
            ValueError: The request had no depth: ``cameras=["wrist"]``.

        """
        steps = np.frombuffer(self._pixels("depth", self._depth), "<u2").reshape(self.height, self.width)
        depth = steps * self.depth_unit
        depth[steps == 0] = np.nan
        return depth

    @cached_property
    def rgb(self) -> NDArray[np.uint8]:
        """Colours, shape (height, width, 3), sRGB.

        Raises:
            ValueError: The request had no colours: ``cameras=["wrist.rgb"]``.

        """
        return np.frombuffer(self._pixels("rgb", self._rgb), np.uint8).reshape(self.height, self.width, 3)

    @cached_property
    def bodies(self) -> NDArray[np.uint16]:
        """Body in every pixel by its id, shape (height, width); 65535 for none. With ``sensing="truth"``.

        Raises:
            ValueError: The request had no bodies: ``cameras=["wrist.bodies"]``.

        """
        return np.frombuffer(self._pixels("bodies", self._bodies), "<u2").reshape(self.height, self.width)

    def points(self) -> Array:
        """Return the world point of every pixel, shape (height, width, 3), m; NaN without a reading."""
        v, u = np.mgrid[: self.height, : self.width] + 0.5
        rays = np.stack([(u - self.cx) / self.fx, (v - self.cy) / self.fy, np.ones_like(u)], axis=-1)
        return matmul(rays * self.depth[..., None], matrix_of(self.quat_xyzw).T) + array(self.position)

    def pixel(self, point: Vec3 | Array) -> tuple[float, float]:
        """Return the pixel u, v of a point of the world (m); NaN if the point is behind the camera."""
        x, y, z = matmul(array(point) - array(self.position), matrix_of(self.quat_xyzw)).tolist()
        if z <= 0.0:
            return (float("nan"), float("nan"))
        return (self.fx * x / z + self.cx, self.fy * y / z + self.cy)

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed image."""
        rows = [("pose", f"{vector(self.position)} m, quaternion {vector(self.quat_xyzw)}")]
        if self._depth is not None:
            known = self.depth[np.isfinite(self.depth)]
            near = f"{known.min():.3f} to {known.max():.3f} m, " if known.size else ""
            rows.append(("depth", f"{near}{known.size} of {self.width * self.height} pixels"))
        if self._rgb is not None:
            rows.append(("rgb", "colours"))
        if self._bodies is not None:
            rows.append(("bodies", f"{len(np.unique(self.bodies))} of them"))
        return f"CameraImage of {self.camera} at tick {self.tick}, {self.width} × {self.height}", rows

    def _repr_png_(self) -> bytes | None:
        """Return the picture for a notebook."""
        if self._rgb is not None:
            return png(self.rgb)
        return None if self._depth is None else png(grey(self.depth))

    def _pixels(self, channel: str, pixels: bytes | None) -> bytes:
        if pixels is None:
            message = f'the request had no {channel}: cameras=["{self.camera}.{channel}"]'
            raise ValueError(message)
        return pixels
