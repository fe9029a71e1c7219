"""The length of a link: a stretch of all that is on it along one axis of its frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from palmares.design.hand_files import HandFiles, named, number, vector_of
from palmares.design.spans import Element, Span

AXES = "xyz"


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
    for shape in _shapes(link.element):
        if shape.tag == "box":
            scaled(shape, "size", along)
        elif shape.tag in ("cylinder", "capsule"):
            scaled(shape, "length", [factor])
        elif shape.tag == "mesh" and "scale" in shape.attributes:
            scaled(shape, "scale", along)
        elif shape.tag == "mesh":
            raise ValueError(
                f'{files.urdf_name}: link {name!r}: a mesh has no scale; add scale="1 1 1" to stretch it'
            )
    inertial = link.element.first("inertial")
    for mass in inertial.all("mass") if inertial is not None else []:
        scaled(mass, "value", [factor])
    for inertia in inertial.all("inertia") if inertial is not None else []:
        for attribute, value in _stretched(inertia, link.axis, factor).items():
            edits.append((inertia.attribute_span(files.urdf, attribute), number(value)))
    files = files.urdf_with(edits)
    own = files.settings.get("links", {}).get(name, {}).get("mass")
    return files if own is None else files.toml_with(("links", name, "mass"), number(own * factor))


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


def _shapes(link: Element) -> Iterator[Element]:
    for whole in (*link.all("collision"), *link.all("visual")):
        for geometry in whole.all("geometry"):
            yield from geometry.children


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
            yield [abs(at) + h for at, h in zip(middle, half, strict=True)]


def _refuse_turned(files: HandFiles, link: _Link, name: str) -> None:
    where = f"{files.urdf_name}: link {name!r}"
    for whole in link.element.children:
        for origin in whole.all("origin"):
            if any(vector_of(files, origin, "rpy")[0] if "rpy" in origin.attributes else []):
                raise ValueError(
                    f"{where}: its <{whole.tag}> is turned; a link with turned parts has no length"
                )
    for shape in _shapes(link.element):
        if shape.tag in ("cylinder", "capsule") and link.axis != 2:
            raise ValueError(
                f"{where}: its {shape.tag} is along z, the link along {AXES[link.axis]}: it has no length"
            )


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
