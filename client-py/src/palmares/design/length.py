"""The length of a link: a stretch of all that is on it along one axis of its frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from palmares.arrays import Array
from palmares.design.hand_files import HandFiles, named, number, turn_of, vector_of
from palmares.design.spans import Element, Span
from palmares.reproducible import matmul

AXES = "xyz"
ALONG = 1.0 - 1e-6
"""Cosine from which an axis of a part is along one of its link"""


@dataclass(frozen=True)
class _Link:
    """A link's elements, and the axis along which it is long."""

    element: Element
    joints: list[Element]
    """Joints to the links behind it"""
    axis: int
    length: float
    """Distance of the farthest joint from the link's frame along the axis; of a last link, of the far end of
    its shapes, without their round ends"""


def read(files: HandFiles, keys: tuple[str, ...]) -> float:
    """Return the length of a link, m."""
    return _link(files, keys[1]).length


def write(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    """Return the files with the link stretched to a length, m. Mass and inertia are those of even density."""
    name = keys[1]
    link = _link(files, name)
    _refuse_what_is_on_it(files, link, name)
    if not value > 0.0:
        raise ValueError(f"length of link {name!r} is {value}; valid: above 0 m")
    factor = value / link.length
    edits: list[tuple[Span, str]] = []

    def scaled(element: Element, attribute: str, factors: list[float]) -> None:
        numbers, span = vector_of(files, element, attribute)
        made = [number * by for number, by in zip(numbers, factors, strict=True)]
        edits.append((span, " ".join(map(number, made))))

    along = [factor if axis == link.axis else 1.0 for axis in range(3)]
    for origin in _origins(link):
        if "xyz" in origin.attributes:
            scaled(origin, "xyz", along)
    for whole in (*link.element.all("collision"), *link.element.all("visual")):
        along_shape = _along(files, whole, link.axis)
        for shape in _shapes(whole):
            if along_shape is None or not _stretches(shape, along_shape):
                # A turned visual moves only; `_refuse_turned` has seen the collision shapes.
                continue
            own = [factor if axis == along_shape else 1.0 for axis in range(3)]
            if shape.tag == "box":
                scaled(shape, "size", own)
            elif shape.tag in ("cylinder", "capsule"):
                scaled(shape, "length", [factor])
            elif shape.tag == "mesh":
                scaled(shape, "scale", own)
    for inertial in link.element.all("inertial"):
        for mass in inertial.all("mass"):
            scaled(mass, "value", [factor])
        own_axis = _along(files, inertial, link.axis)
        for inertia in inertial.all("inertia") if own_axis is not None else []:
            assert own_axis is not None
            for attribute, value in _stretched(inertia, own_axis, factor).items():
                edits.append((inertia.attribute_span(files.urdf, attribute), number(value)))
    files = files.urdf_with(edits)
    mass_there = files.settings.get("links", {}).get(name, {}).get("mass")
    if mass_there is None:
        return files
    return files.toml_with(("links", name, "mass"), number(mass_there * factor))


def _link(files: HandFiles, name: str) -> _Link:
    element = named(files, "link", name)
    joints = [
        joint
        for joint in files.robot.all("joint")
        if any(parent.attributes.get("link") == name for parent in joint.all("parent"))
    ]
    ends = [_origin(files, joint) for joint in joints] or list(_ends(files, element, name))
    far = [max((abs(end[axis]) for end in ends), default=0.0) for axis in range(3)]
    axis = far.index(max(far))
    if far[axis] == 0.0:
        raise ValueError(f"{files.urdf_name}: link {name!r} has no length: no joint or shape away from it")
    link = _Link(element, joints, axis, far[axis])
    _refuse_turned(files, link, name)
    return link


def _origin(files: HandFiles, element: Element) -> list[float]:
    found = element.first("origin")
    if found is None or "xyz" not in found.attributes:
        return [0.0, 0.0, 0.0]
    return vector_of(files, found, "xyz")[0]


def _shapes(whole: Element) -> Iterator[Element]:
    for geometry in whole.all("geometry"):
        yield from geometry.children


def _turn(files: HandFiles, whole: Element) -> Array:
    """Return the rotation (3, 3) of a part of a link."""
    found = whole.first("origin")
    rpy = vector_of(files, found, "rpy")[0] if found is not None and "rpy" in found.attributes else [0.0] * 3
    return turn_of(rpy)


def _along(files: HandFiles, whole: Element, axis: int) -> int | None:
    """Return the axis of a part's frame that is along an axis of the link's; None if none is."""
    for own, cosine in enumerate(_turn(files, whole)[axis].tolist()):
        if abs(cosine) > ALONG:
            return own
    return None


def _stretches(shape: Element, axis: int) -> bool:
    """Whether a shape can be longer along an axis of its frame."""
    return (
        shape.tag == "box"
        or (shape.tag in ("cylinder", "capsule") and axis == 2)
        or "scale" in shape.attributes
    )


def _origins(link: _Link) -> Iterator[Element]:
    own = [child for child in link.element.children if child.tag in ("collision", "visual", "inertial")]
    for whole in (*own, *link.joints):
        yield from whole.all("origin")


def _ends(files: HandFiles, link: Element, name: str) -> Iterator[list[float]]:
    """Yield the far ends of a link's shapes along each axis, without round ends."""
    for whole in link.all("collision"):
        middle = _origin(files, whole)
        for shape in (child for geometry in whole.all("geometry") for child in geometry.children):
            if shape.tag == "mesh":
                raise ValueError(
                    f"{files.urdf_name}: link {name!r}: a last link with a mesh has no length here; take "
                    "the scale of the mesh by hand, or give it boxes"
                )
            half = [0.0, 0.0, 0.0]
            if shape.tag == "box":
                half = [0.5 * size for size in vector_of(files, shape, "size")[0]]
            elif shape.tag in ("cylinder", "capsule"):
                half[2] = 0.5 * vector_of(files, shape, "length")[0][0]
            reach = matmul(np.abs(_turn(files, whole)), half).tolist()
            yield [abs(at) + r for at, r in zip(middle, reach, strict=True)]


def _refuse_turned(files: HandFiles, link: _Link, name: str) -> None:
    """Refuse collision shapes and inertia that cannot be longer along the link."""
    where = f"{files.urdf_name}: link {name!r}"
    for whole in link.element.all("collision"):
        own = _along(files, whole, link.axis)
        for shape in _shapes(whole):
            if shape.tag != "sphere" and (own is None or not _stretches(shape, own)):
                more = '; add scale="1 1 1" to its mesh' if shape.tag == "mesh" and own is not None else ""
                raise ValueError(
                    f"{where}: its {shape.tag} cannot be longer along the link's {AXES[link.axis]} axis{more}"
                )
    for whole in link.element.all("inertial"):
        if _along(files, whole, link.axis) is None and files.settings.get("inertia") != "from_geometry":
            raise ValueError(f'{where}: its <inertial> is turned; inertia = "from_geometry" replaces it')


def _refuse_what_is_on_it(files: HandFiles, link: _Link, name: str) -> None:
    """Refuse links on which ``hand.toml`` places something, which would have to move too."""
    settings: dict[str, Any] = files.settings
    sensors = settings.get("sensors", {})
    on = {
        "[[tactile]]": [it.get("link") for it in settings.get("tactile", [])],
        "[sensors.accelerometer]": [sensors.get("accelerometer", {}).get("link")],
        "[[sensors.cameras]]": [it.get("link") for it in sensors.get("cameras", [])],
        "[linkages]": [end for it in settings.get("linkages", {}).values() for end in it.get("links", [])],
        "[base]": [settings.get("base", {}).get("link")],
    }
    joints = {joint.attributes.get("name") for joint in link.joints}
    eyelets = {joint for it in settings.get("tendons", {}).values() for joint in it.get("eyelets", {})}
    for table in [table for table, links in on.items() if name in links] + (
        ["eyelets of its joints"] if joints & eyelets else []
    ):
        raise ValueError(f"hand.toml: {table} has a place on link {name!r}, so its length cannot change")


def _stretched(inertia: Element, axis: int, factor: float) -> dict[str, float]:
    """Return the inertia of a body of even density that is stretched along an axis."""
    given = {name: float(text) for name, text in inertia.attributes.items()}
    xx, yy, zz = (given.get(f"i{a}{a}", 0.0) for a in AXES)
    second = [0.5 * (yy + zz - xx), 0.5 * (xx + zz - yy), 0.5 * (xx + yy - zz)]
    second = [factor * s * (factor * factor if a == axis else 1.0) for a, s in enumerate(second)]
    whole = math.fsum(second)
    made = {f"i{a}{a}": whole - s for a, s in zip(AXES, second, strict=True)}
    for name in ("ixy", "ixz", "iyz"):
        made[name] = given.get(name, 0.0) * factor * (factor if AXES[axis] in name[1:] else 1.0)
    return {name: value for name, value in made.items() if name in given}
