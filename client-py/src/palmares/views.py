"""Text for terminals and tables for notebooks, of structs that have too many fields to read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any, TypeAlias

import numpy as np

from palmares.outputs import shown

Rows: TypeAlias = list[tuple[str, str]]
"""Label and value of each line"""
MAX_LISTED = 12
"""Longest list of objects or events; the last line counts the others"""


LONGEST = 400
"""Most characters of a `repr`"""
LONGEST_VALUE = 60
"""Most characters of a field in the `repr` of a `Brief`"""


class Viewed:
    """A struct that shows a title and a few lines instead of all of its fields; ``print`` shows all lines."""

    __slots__ = ()

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return shown(shortened(text(*self._lines()).splitlines()))

    def __str__(self) -> str:
        return shown(text(*self._lines()))

    def _repr_html_(self) -> str:
        return html(*self._lines())


class Brief:
    """A struct or dataclass whose `repr` has every field, but not all of a long one."""

    __slots__ = ()

    def __repr__(self) -> str:
        found = [f"{name}={brief(getattr(self, name))}" for name in _fields(self)]
        whole = f"{type(self).__name__}({', '.join(found)})"
        return shown(whole if len(whole) <= LONGEST else whole[: LONGEST - 2] + "…)")


def _fields(of: Any) -> Sequence[str]:
    """Return the names of the fields of a struct or dataclass."""
    named = getattr(type(of), "__struct_fields__", None)
    return named if named is not None else [field.name for field in dataclasses.fields(of)]


def brief(value: Any) -> str:
    """Return at most `LONGEST_VALUE` characters: of an array the shape, of a long list the count."""
    if isinstance(value, np.ndarray):
        return f"<array {'×'.join(map(str, value.shape)) or '()'}>"
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>"
    if isinstance(value, Mapping | list | tuple) and len(value) > 0:
        parts = [brief(part) for part in value]
        whole = f"[{', '.join(parts)}]"
        return whole if len(whole) <= LONGEST_VALUE else f"<{len(value)} of them>"
    whole = repr(value)
    return whole if len(whole) <= LONGEST_VALUE else f"{whole[: LONGEST_VALUE - 1].splitlines()[0]}…"


def shortened(lines: Sequence[str]) -> str:
    """Return the first lines that fit into `LONGEST` characters, and a line that counts the others."""
    whole = "\n".join(lines)
    if len(whole) <= LONGEST:
        return whole
    kept, length = [lines[0]], len(lines[0])
    room = LONGEST - len("\n  … and 999 more lines: print() shows them")
    for line in lines[1:]:
        length += 1 + len(line)
        if length > room:
            break
        kept.append(line)
    return "\n".join([*kept, f"  … and {len(lines) - len(kept)} more lines: print() shows them"])


def text(title: str, rows: Rows) -> str:
    """Return a title and aligned lines."""
    width = max((len(label) for label, _ in rows), default=0)
    return "\n".join([f"<{title}>", *(f"  {label:<{width}}  {value}" for label, value in rows)])


def html(title: str, rows: Rows) -> str:
    """Return a table."""
    lines = "".join(
        f'<tr><th style="text-align:left">{escape(label)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for label, value in rows
    )
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"


def first(rows: Rows, kind: str) -> Rows:
    """Return the first `MAX_LISTED` rows, and a row that counts the others."""
    others = len(rows) - MAX_LISTED
    return [*rows[:MAX_LISTED], ("", f"and {others} more {kind}")] if others > 0 else rows


def vector(numbers: Sequence[float]) -> str:
    """Return numbers in brackets, with three decimals."""
    return "(" + ", ".join(f"{x:.3f}" for x in numbers) + ")"


class Described(dict[str, Any]):
    """A dictionary of thousands of numbers: a prompt shows its name and its keys, ``print`` everything."""

    def __repr__(self) -> str:
        name = f"{self['name']}: " if isinstance(self.get("name"), str) else ""
        return shown(f"<{name}{', '.join(self)}>")

    def __str__(self) -> str:
        return shown(super().__repr__())
