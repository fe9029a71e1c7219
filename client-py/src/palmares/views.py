"""Text for terminals and tables for notebooks, of structs that have too many fields to read."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TypeAlias

Rows: TypeAlias = list[tuple[str, str]]
"""Label and value of each line"""
MAX_LISTED = 12
"""Longest list of objects or events; the last line counts the others"""


class Viewed:
    """A struct that shows a title and a few lines instead of all of its fields."""

    __slots__ = ()

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return text(*self._lines())

    def _repr_html_(self) -> str:
        return html(*self._lines())


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
