"""Move objects out of the shelf with the SoftHand by its sensors: a depth camera in front of the shelf.

    python shelf_sensors.py --seed 7 --runs 3           # needs `palmares serve`, or --url local

The motions and their order are those of `shelf_softhand.py`, which uses the true positions. This controller
takes an image before every attempt:

    hand up, out of the image -> depth and colours -> bounding boxes -> `palmares.skills.clearing`

The scene lists the ten objects with sizes and colours. So a pixel belongs to the object with the nearest
colour, and the front of an object determines its depth. Hidden objects are found after those in front of them
are gone. docs/controllers.md compares the scores with those of `shelf_softhand.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import palmares
from palmares.arrays import Array, array
from palmares.cameras import CameraImage
from palmares.examples.shelf_softhand import SoftHand
from palmares.reproducible import cos, norm, norms, sin
from palmares.skills.objects import ObjectBounds
from palmares.skills.runs import play
from palmares.skills.shelf import PICKS, ShelfSummary, play_shelf

ASIDE = array([0.0, -0.05, 1.25])
"""Position of the base where the hand does not hide the shelf from the camera, m"""
SETTLE_S = 0.25
"""Wait before an image, which may be 0.13 s old; rolling objects should stop"""

# --- the depth image; its error is 1 to 2 mm ---
WALL_M = 0.006
"""Points this near to floor or walls may belong to them"""
DARK = 30.0
"""Smallest brightness of a pixel with a clear colour, of 255 in each channel"""
LIKE = 0.1
"""Largest difference of equal colours, without their brightness"""
ALIKE = 0.02
"""Objects whose colours differ by less are distinguished by their sizes"""
NEAR_M = 0.03
"""Adjacent pixels at a larger distance belong to two objects"""
MIN_PIXELS = 20
"""Fewest pixels of an object"""
LOW_M = 0.1
"""The image shows the top of objects below this height, and so their depth"""


def hues(colours: Array) -> Array:
    """Return colours (..., 3) without their brightness, which depends on the light."""
    return array(colours / np.maximum(norms(colours)[..., None], 1e-9))


def connected(points: Array, mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return a label for every pixel of `mask` (h, w), 0 for others; near adjacent pixels share a label."""
    labels = np.where(mask, np.arange(1, mask.size + 1).reshape(mask.shape), 0)
    sides = []
    for first, second in (
        (np.s_[:-1, :], np.s_[1:, :]),
        (np.s_[:, :-1], np.s_[:, 1:]),
    ):
        near = norms(points[first] - points[second]) < NEAR_M
        sides.append((labels[first], labels[second], mask[first] & mask[second] & near))
    while True:
        before = labels.copy()
        for one, other, same in sides:
            one[same] = other[same] = np.minimum(one, other)[same]
        if np.array_equal(before, labels):
            return labels


def pieces(
    image: CameraImage, bodies: Sequence[palmares.SceneBody], shelf: palmares.Region
) -> list[ObjectBounds]:
    """Return the bounding boxes of the visible pieces of objects in the shelf, largest first."""
    points, colours = image.points(), image.rgb.astype(float)
    inside = np.all((points > array(shelf.min) + WALL_M) & (points < array(shelf.max) - WALL_M), axis=2)
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return []
    window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    points, colours, inside = points[window], colours[window], inside[window]
    known = hues(array([body.color for body in bodies]))
    difference = norms(hues(colours)[:, :, None] - known)
    clear = inside & (norms(colours) > DARK) & (difference.min(axis=2) < LIKE)
    # The first object of a colour represents all of them.
    first = np.argmax(norms(known[:, None] - known) < ALIKE, axis=1)
    nearest = first[np.argmin(difference, axis=2)]
    found: list[tuple[int, ObjectBounds]] = []
    for k in set(first.tolist()):
        same = [row for row in range(len(bodies)) if first[row] == k]
        labels = connected(points, clear & (nearest == k))
        for label, count in zip(*np.unique(labels[labels > 0], return_counts=True), strict=True):
            if count >= MIN_PIXELS:
                # Some points at the edges are wrong: leave out one in a hundred on each side.
                low, high = np.percentile(points[labels == label], [1.0, 99.0], axis=0)
                height = high[2] - shelf.min[2]
                row = min(same, key=lambda row: abs(2.0 * bodies[row].half_extents[2] - height))
                box = ObjectBounds(row, bodies[row].name, array(low), array(high), array(low))
                found.append((int(count), box))
    return [box for _, box in sorted(found, key=lambda entry: -entry[0])]


def depth_m(box: ObjectBounds, body: palmares.SceneBody, floor_m: float) -> float:
    """Return the depth of an object along y, m, from its visible front."""
    size = 2.0 * body.half_extents
    # The object may have fallen over: the side nearest to its height is upright.
    a, b = np.delete(size, np.argmin(np.abs(size - (box.high[2] - floor_m))))
    wide, deep = box.size[:2]
    if all(part.shape.type != "box" for part in body.parts):
        return max(float(deep), float(min(a, b)))
    # The turn of a box with sides a and b that fits the visible piece best.
    turns = [(cos(turn), sin(turn)) for turn in (math.radians(degrees) for degrees in range(0, 91, 3))]
    across, depth = (array([p * c + q * s for c, s in turns]) for p, q in ((a, b), (b, a)))
    side = array([max(b * c, a * s) for c, s in turns])
    visible = depth if box.high[2] - floor_m < LOW_M else side
    best = np.argmin(np.abs(across - wide) + np.abs(visible - deep))
    return max(float(deep), float(depth[best]))


def find_objects(
    image: CameraImage, bodies: Sequence[palmares.SceneBody], shelf: palmares.Region
) -> list[ObjectBounds]:
    """Return the bounding boxes of the visible objects in the shelf; `index` is the row in `bodies`."""
    found: dict[int, ObjectBounds] = {}
    for piece in pieces(image, bodies, shelf):
        k, low, high = piece.index, piece.low, piece.high
        if k in found:
            # Another object in front divides it, unless the whole would be too large.
            low, high = np.minimum(low, found[k].low), np.maximum(high, found[k].high)
            if norm(high - low) > 2.0 * norm(bodies[k].half_extents):
                continue
        found[k] = ObjectBounds(k, piece.name, array(low), array(high), array(low))
    whole = []
    for k, box in found.items():
        low = array([*box.low[:2], shelf.min[2]])
        high = array([box.high[0], box.low[1] + depth_m(box, bodies[k], shelf.min[2]), box.high[2]])
        whole.append(ObjectBounds(k, box.name, low, high, (low + high) / 2))
    return whole


class Senses(SoftHand):
    """The SoftHand by its sensors."""

    sensing = "sensors"
    looks = 3
    """The images differ by their noise"""

    def objects(self) -> list[ObjectBounds]:
        """Return the bounding boxes of the objects in an image."""
        return find_objects(self.look(), self.scene.free, self.shelf)

    def look(self) -> CameraImage:
        """Move the hand out of the way; return the image of the camera in front of the shelf."""
        self.to(0.4, array([self.position[0], min(self.position[1], ASIDE[1]), self.position[2]]))
        self.to(0.5, ASIDE)
        self.wait(SETTLE_S)
        self.keep(self.client.step(cameras=["shelf", "shelf.rgb"]))
        return self.obs.cameras["shelf"]


def run(client: palmares.Client, seed: int | None, picks: int = PICKS) -> ShelfSummary:
    """Play one run of at most `picks` attempts."""
    return play_shelf(Senses, client, seed, picks)


if __name__ == "__main__":
    play(run, __doc__)
