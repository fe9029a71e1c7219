"""A picture of a design, SVG: the best score over the search, the goals, and fates before and after."""

from __future__ import annotations

import html
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from palmares.design.file import Design
from palmares.design.making import Candidate, Designed

WIDTH, LEFT, HIGH = 720, 20, 150
CELL, GAP, MOST_CELLS = 18, 60, 320
COLOURS = {
    "held": "#2a9d5c",
    "dropped": "#e9a23b",
    "ejected": "#c8443a",
    "missed": "#b8bcc4",
    "overlaps": "#5d6470",
    "fault": "#000000",
}
STYLE = (
    "text { font: 13px system-ui, sans-serif; fill: #333 } .head { font-weight: 600 } "
    ".small { font-size: 11px } "
    "@media (prefers-color-scheme: dark) { text { fill: #ddd } }"
)


def picture(design: Design, designed: Designed, best: Candidate) -> str:
    """Return the picture."""
    y = 24.0
    parts: list[str] = []
    for title, draw in (
        ("Best score of the hands that keep the limits", _history(designed, best)),
        ("Goals before and after", _goals(design, designed.before, best)),
        (
            "Fates before and after: a row for each size, a column for each place",
            _maps(design, designed, best),
        ),
    ):
        rows, height = draw
        if rows:
            parts.append(f'<text class="head" x="{LEFT}" y="{y:g}">{html.escape(title)}</text>')
            parts.append(f'<g transform="translate({LEFT} {y + 12:g})">{"".join(rows)}</g>')
            y += height + 44
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y:g}" width="{WIDTH}">'
        f"<style>{STYLE}</style>{''.join(parts)}</svg>\n"
    )


def _history(designed: Designed, best: Candidate) -> tuple[list[str], float]:
    scores: list[tuple[int, float]] = []
    key = None
    for number, candidate in enumerate(designed.tried):
        if candidate.measured and (key is None or candidate.key < key):
            key = candidate.key
        if key is not None and key[0] == 0.0:
            scores.append((number, -key[1]))
    if not scores:
        return [f'<text y="14">no hand keeps the limits; missed by {best.missed:.3g} of them</text>'], 20
    low, high = min(score for _, score in scores), max(score for _, score in scores)
    wide, most = WIDTH - 2 * LEFT - 70, max(1, len(designed.tried) - 1)
    way = ""
    for number, score in scores:
        x = 60 + wide * number / most
        y = HIGH - (HIGH - 10) * ((score - low) / (high - low) if high > low else 0.5)
        way += f"H{x:.1f}V{y:.1f}" if way else f"M{x:.1f} {y:.1f}"
    rows = [
        f'<path d="M60 0V{HIGH}H{60 + wide}" fill="none" stroke="#888"/>',
        f'<path d="{way}" fill="none" stroke="#2a6fc9" stroke-width="2"/>',
        f'<text class="small" x="52" y="14" text-anchor="end">{high:.4g}</text>',
        f'<text class="small" x="52" y="{HIGH}" text-anchor="end">{low:.4g}</text>',
        f'<text class="small" x="{60 + wide}" y="{HIGH + 15}" text-anchor="end">'
        f"{len(designed.tried)} hands</text>",
    ]
    return rows, HIGH + 15


def _goals(design: Design, before: Candidate, best: Candidate) -> tuple[list[str], float]:
    rows, y = [], 0.0
    for goal, was, now in zip(design.goals, before.measured, best.measured, strict=True):
        most = max(abs(was.value), abs(now.value)) or 1.0
        label = html.escape(goal.common.name) + (f", {goal.unit}" if goal.unit else "")
        rows.append(f'<text y="{y + 20:g}">{label}</text>')
        for value, colour, down in ((was.value, "#b8bcc4", 0.0), (now.value, "#2a6fc9", 15.0)):
            wide = 380 * abs(value) / most
            rows.append(
                f'<rect x="180" y="{y + down + 2:g}" width="{wide:.1f}" height="12" fill="{colour}"/>'
                f'<text class="small" x="{186 + wide:.1f}" y="{y + down + 12:g}">{value:.4g}</text>'
            )
        y += 38
    return rows, y


def _maps(design: Design, designed: Designed, best: Candidate) -> tuple[list[str], float]:
    rows: list[str] = []
    y = 0.0
    for goal, was, now in zip(design.goals, designed.before.measured, best.measured, strict=True):
        if was.fate is None or now.fate is None:
            continue
        size = min(CELL, MOST_CELLS / was.fate.shape[1])
        rows.append(f'<text class="small" y="{y + 12:g}">{html.escape(goal.common.name)}</text>')
        for x, fate in ((0.0, was.fate), (size * was.fate.shape[1] + GAP, now.fate)):
            rows += _cells(fate, x, y + 18, size)
        y += 30 + size * was.fate.shape[0]
    if rows:
        x = 0.0
        for word, colour in COLOURS.items():
            rows.append(f'<rect x="{x:g}" y="{y:g}" width="12" height="12" fill="{colour}"/>')
            rows.append(f'<text class="small" x="{x + 17:g}" y="{y + 10:g}">{word}</text>')
            x += 90
        y += 16
    return rows, y


def _cells(fate: NDArray[np.str_], left: float, top: float, size: float) -> Iterator[str]:
    for row, fates in enumerate(fate.tolist()):
        for column, word in enumerate(fates):
            yield (
                f'<rect x="{left + column * size:.1f}" y="{top + row * size:.1f}" width="{size - 1:.1f}" '
                f'height="{size - 1:.1f}" fill="{COLOURS[word]}"/>'
            )
