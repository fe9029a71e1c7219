"""The two texts of a hand, with numbers replaced in them."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from palmares.arrays import Array, array
from palmares.design.spans import Element, Path, Span, elements_of, toml_spans
from palmares.reproducible import matmul
from palmares.rotation import rot_y, rot_z


# A place is read more often than it is written; nothing changes what these return.
@lru_cache(maxsize=16)
def _settings(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


@lru_cache(maxsize=16)
def _robot(data: bytes) -> Element:
    return elements_of(data)


@dataclass(frozen=True)
class HandFiles:
    """The two texts of a hand."""

    toml: str
    urdf: bytes
    urdf_name: str = "hand.urdf"

    @property
    def settings(self) -> dict[str, Any]:
        """Contents of ``hand.toml``."""
        return _settings(self.toml)

    @property
    def robot(self) -> Element:
        """Root element of the URDF."""
        return _robot(self.urdf)

    def urdf_with(self, edits: list[tuple[Span, str]]) -> HandFiles:
        """Return the files with other texts in some spans of the URDF."""
        data = self.urdf
        for (first, last), text in sorted(edits, reverse=True):
            data = data[:first] + text.encode() + data[last:]
        return replace(self, urdf=data)

    def toml_with(self, path: Path, text: str) -> HandFiles:
        """Return the files with another text for a value of ``hand.toml`` that is there."""
        first, last = toml_spans(self.toml)[path]
        return replace(self, toml=self.toml[:first] + text + self.toml[last:])


def number(value: float) -> str:
    """Return a number as it is written into a hand's files."""
    return repr(float(value))


def named(files: HandFiles, tag: str, name: str) -> Element:
    """Return the element of the URDF with this tag and name.

    Raises:
        ValueError: There is none.

    """
    robot = files.robot
    found = robot.first(tag, name=name)
    if found is None:
        names = [it.attributes.get("name", "") for it in robot.all(tag)]
        raise ValueError(f"{files.urdf_name}: has no {tag} {name!r}; valid: {listed(names)}")
    return found


def vector_of(files: HandFiles, element: Element, name: str) -> tuple[list[float], Span]:
    """Return the numbers of an attribute, and where they are.

    Raises:
        ValueError: They are no numbers.

    """
    text = element.attributes[name]
    try:
        return [float(word) for word in text.split()], element.attribute_span(files.urdf, name)
    except ValueError:
        raise ValueError(f"{files.urdf_name}: <{element.tag} {name}> is {text!r}, no numbers") from None


def listed(names: list[str]) -> str:
    """Return names with commas."""
    return ", ".join(names) if names else "nothing"


def turn_of(rpy: Sequence[float]) -> Array:
    """Return the rotation matrix (3, 3) of roll, pitch and yaw as of URDF, rad."""
    # This permutation of the axes makes a turn about z one about x.
    lay = array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    roll = matmul(lay, rot_z(rpy[0]), lay.T)
    return matmul(rot_z(rpy[2]), rot_y(rpy[1]), roll)
