"""Numbers of a hand by their places in ``hand.toml`` and ``hand.urdf``: read, and replaced in the text."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palmares.design import length
from palmares.design.hand_files import HandFiles, listed, named, number, vector_of
from palmares.design.spans import Element, Span

NOTATION = """\
arm.TENDON.JOINT        entry of R: radius of a pulley
stiffness.JOINT         entry of E
rest.JOINT              q0, where the spring rests
length.LINK             length of a link, m: origins of the next joints, shapes, mass and inertia follow
joint.JOINT.origin.x    also y, z, roll, pitch, yaw
joint.JOINT.limit.upper also lower, effort, velocity
joint.JOINT.dynamics.damping   also friction
link.LINK.mass          kg
motors.MOTOR.scaling    any other number of hand.toml, by its tables and its key
-PLACE                  the number with the other sign"""
ORIGIN = {"x": ("xyz", 0), "y": ("xyz", 1), "z": ("xyz", 2)} | {
    "roll": ("rpy", 0),
    "pitch": ("rpy", 1),
    "yaw": ("rpy", 2),
}
JOINT_NUMBERS = {"limit": ("lower", "upper", "effort", "velocity"), "dynamics": ("damping", "friction")}


@dataclass(frozen=True)
class Place:
    """A place of a number in a hand's files."""

    text: str

    @property
    def keys(self) -> tuple[str, ...]:
        """Words of its path."""
        return keys_of(self.text.removeprefix("-"))

    @property
    def sign(self) -> float:
        """−1 for a place written with a minus."""
        return -1.0 if self.text.startswith("-") else 1.0

    def read(self, files: HandFiles) -> float:
        """Return the number.

        Raises:
            ValueError: There is no number.

        """
        return self.sign * _of(self)[0](files, self.keys)

    def write(self, files: HandFiles, value: float) -> HandFiles:
        """Return the files with another number there; a number that stays keeps its text.

        Raises:
            ValueError: There is no number, or it cannot be changed.

        """
        if self.read(files) == value:
            return files
        return _of(self)[1](files, self.keys, self.sign * value)


def keys_of(text: str) -> tuple[str, ...]:
    """Return the words of a dotted path, in which TOML's quotes may enclose a word.

    Raises:
        ValueError: It is no such path.

    """
    try:
        found: Any = tomllib.loads(f"{text} = 0")
    except tomllib.TOMLDecodeError:
        raise ValueError(f"found {text!r}; wanted words with dots, as arm.left_tendon.left_tip") from None
    keys = []
    while isinstance(found, dict) and len(found) == 1:
        ((key, found),) = found.items()
        keys.append(key)
    if found != 0:
        raise ValueError(f"found {text!r}; wanted words with dots, as arm.left_tendon.left_tip")
    return tuple(keys)


_Read = Callable[[HandFiles, tuple[str, ...]], float]
_Write = Callable[[HandFiles, tuple[str, ...], float], HandFiles]


def _of(place: Place) -> tuple[_Read, _Write]:
    heads: dict[str, tuple[_Read, _Write]] = {
        "arm": (_read_arm, _write_arm),
        "stiffness": (_read_spring, _write_spring),
        "rest": (_read_spring, _write_spring),
        "joint": (_read_joint, _write_joint),
        "link": (_read_mass, _write_mass),
        "length": (length.read, length.write),
    }
    keys = place.keys
    wanted = {"arm": 3, "stiffness": 2, "rest": 2, "joint": 4, "link": 3, "length": 2}.get(keys[0])
    if wanted is not None and len(keys) != wanted:
        raise ValueError(f"found {place.text!r}; wanted one of these forms:\n{NOTATION}")
    return heads.get(keys[0], (_read_toml, _write_toml))


# hand.toml


def _read_toml(files: HandFiles, keys: tuple[str, ...]) -> float:
    found: Any = files.settings
    for position, key in enumerate(keys):
        there = list(found) if isinstance(found, dict) else []
        inside = ".".join(keys[:position])
        if isinstance(found, list):
            if not key.isdigit() or int(key) >= len(found):
                raise ValueError(f"hand.toml: {inside} has no {key}; valid: 0 to {len(found) - 1}")
            found = found[int(key)]
        elif key in there:
            found = found[key]
        else:
            here = f"[{inside}]" if inside else "it"
            also = "" if inside else f"\nor one of these forms:\n{NOTATION}"
            raise ValueError(f"hand.toml: {here} has no {key!r}; valid: {listed(there)}{also}")
    if not _is_number(found):
        raise ValueError(f"hand.toml: {'.'.join(keys)} is no number")
    return float(found)


def _write_toml(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    path: list[str | int] = []
    found: Any = files.settings
    for key in keys:
        step: str | int = int(key) if isinstance(found, list) else key
        path.append(step)
        found = found[step]
    return files.toml_with(tuple(path), number(value))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


# hand.urdf


def _transmission_joints(files: HandFiles, tendon: str | None, joint: str) -> list[Element]:
    """Return the elements of a joint in one transmission, or in all."""
    found = files.robot.all("transmission")
    if tendon is not None:
        found = [named(files, "transmission", tendon)]
    return [it for transmission in found for it in transmission.all("joint", name=joint)]


def _text_of(files: HandFiles, element: Element, what: str) -> tuple[float, Span]:
    span = element.inside, element.end
    text = files.urdf[span[0] : span[1]].decode()
    try:
        return float(text), span
    except ValueError:
        raise ValueError(f"{files.urdf_name}: {what} is {text!r}, no number") from None


def _arm(files: HandFiles, keys: tuple[str, ...]) -> tuple[float, Span]:
    _, tendon, joint = keys
    joints = _transmission_joints(files, tendon, joint)
    if not joints:
        there = [it.attributes.get("name", "") for it in named(files, "transmission", tendon).all("joint")]
        raise ValueError(
            f"{files.urdf_name}: transmission {tendon!r} has no joint {joint!r}; valid: {listed(there)}"
        )
    found = joints[0].first("mechanicalReduction")
    if found is None:
        raise ValueError(
            f"{files.urdf_name}: joint {joint!r} of transmission {tendon!r} has no <mechanicalReduction>; "
            "add it"
        )
    return _text_of(files, found, "<mechanicalReduction>")


def _own_arm(files: HandFiles, keys: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the keys of a row of R in ``hand.toml``, of a tendon without a transmission."""
    rows = files.settings.get("tendons", {}).get(keys[1], {})
    return ("tendons", keys[1], "joints", keys[2]) if "joints" in rows else None


def _read_arm(files: HandFiles, keys: tuple[str, ...]) -> float:
    own = _own_arm(files, keys)
    return _read_toml(files, own) if own else _arm(files, keys)[0]


def _write_arm(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    own = _own_arm(files, keys)
    if own:
        return _write_toml(files, own, value)
    return files.urdf_with([(_arm(files, keys)[1], number(value))])


SPRING = {"stiffness": "mechanicalElasticity", "rest": "offset"}


def _own_spring(files: HandFiles, keys: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the keys of E or q0 in ``hand.toml``, which come before those of the URDF."""
    kind, joint = keys
    if kind in files.settings.get("coordinates", {}).get(joint, {}):
        return ("coordinates", joint, kind)
    return None


def _springs(files: HandFiles, keys: tuple[str, ...]) -> list[tuple[float, Span]]:
    kind, joint = keys
    tag = SPRING[kind]
    found = [it for whole in _transmission_joints(files, None, joint) for it in whole.all(tag)]
    if not found:
        raise ValueError(
            f"{files.urdf_name}: joint {joint!r} has no <{tag}> in a transmission, and hand.toml no "
            f"coordinates.{joint}.{kind}; add one of them"
        )
    return [_text_of(files, it, f"<{tag}>") for it in found]


def _read_spring(files: HandFiles, keys: tuple[str, ...]) -> float:
    own = _own_spring(files, keys)
    return _read_toml(files, own) if own else _springs(files, keys)[0][0]


def _write_spring(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    own = _own_spring(files, keys)
    if own:
        return _write_toml(files, own, value)
    return files.urdf_with([(span, number(value)) for _, span in _springs(files, keys)])


def _joint(files: HandFiles, keys: tuple[str, ...]) -> tuple[list[float], Span, int]:
    """Return the attribute's numbers, where they are, and the position of the one that is meant."""
    _, joint, part, word = keys
    valid = {"origin": tuple(ORIGIN), **JOINT_NUMBERS}
    if word not in valid.get(part, ()):
        forms = [f"{tag}.{name}" for tag, names in valid.items() for name in names]
        raise ValueError(f"{files.urdf_name}: a joint has no number {part}.{word}; valid: {listed(forms)}")
    attribute, position = ORIGIN[word] if part == "origin" else (word, 0)
    found = named(files, "joint", joint).first(part)
    if found is None or attribute not in found.attributes:
        raise ValueError(f"{files.urdf_name}: joint {joint!r} has no <{part} {attribute}>; add it")
    numbers, span = vector_of(files, found, attribute)
    return numbers, span, position


def _read_joint(files: HandFiles, keys: tuple[str, ...]) -> float:
    numbers, _, position = _joint(files, keys)
    return numbers[position]


def _write_joint(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    numbers, span, position = _joint(files, keys)
    numbers[position] = value
    return files.urdf_with([(span, " ".join(map(number, numbers)))])


def _mass(files: HandFiles, keys: tuple[str, ...]) -> tuple[float, Span]:
    _, link, word = keys
    if word != "mass":
        raise ValueError(f"{files.urdf_name}: a link has no number {word!r} here; valid: mass")
    inertial = named(files, "link", link).first("inertial")
    found = inertial.first("mass") if inertial is not None else None
    if found is None:
        raise ValueError(f"{files.urdf_name}: link {link!r} has no <mass>; add it")
    numbers, span = vector_of(files, found, "value")
    return numbers[0], span


def _own_mass(files: HandFiles, keys: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the keys of a mass in ``hand.toml``, which comes before that of the URDF."""
    there = "mass" in files.settings.get("links", {}).get(keys[1], {})
    return ("links", keys[1], "mass") if there else None


def _read_mass(files: HandFiles, keys: tuple[str, ...]) -> float:
    own = _own_mass(files, keys)
    return _read_toml(files, own) if own else _mass(files, keys)[0]


def _write_mass(files: HandFiles, keys: tuple[str, ...], value: float) -> HandFiles:
    own = _own_mass(files, keys)
    if own:
        return _write_toml(files, own, value)
    return files.urdf_with([(_mass(files, keys)[1], number(value))])
