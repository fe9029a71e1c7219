"""PNG files, for notebooks: as in ISO/IEC 15948, without a filter."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a picture (height, width) or (height, width, 3) of uint8 as a PNG file."""
    height, width = pixels.shape[:2]
    colour = 2 if pixels.ndim == 3 else 0
    rows = np.zeros((height, 1 + pixels[0].size), dtype=np.uint8)  # Each begins with its filter: 0, none.
    rows[:, 1:] = pixels.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
    parts = [(b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in parts)


def grey(depth: NDArray[Any]) -> NDArray[np.uint8]:
    """Return distances as greys, the nearest white; without a reading black."""
    known = np.isfinite(depth)
    if not known.any():
        return np.zeros(depth.shape, dtype=np.uint8)
    near, far = depth[known].min(), depth[known].max()
    shade = 255.0 - 215.0 * (depth - near) / max(far - near, 1e-9)
    return np.where(known, shade, 0.0).astype(np.uint8)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
