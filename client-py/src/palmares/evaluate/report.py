"""The report of an evaluation, as text, Markdown and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path

from palmares.evaluate.effects import Effect, effects
from palmares.evaluate.play import Played
from palmares.evaluate.statistics import Comparison, Spread
from palmares.outputs import shown
from palmares.views import Brief

WORST = 5
HEADER = ("controller", "task", "hand", "runs", "mean", "95 %", "min", "q1", "median", "q3", "max", "failed")
EFFECT_HEADER = (
    "number",
    "drawn",
    "low third",
    "high third",
    "difference",
    "95 %, all together",
    "rank correlation",
    "95 %, all together",
)
EFFECT_MARKDOWN = (f"| {' | '.join(EFFECT_HEADER)} |", "|" + len(EFFECT_HEADER) * "---|")
MARKDOWN_HEADER = (
    "| controller | task | hand | sensing | runs | mean | 95 % | least | quartiles | most | worst seeds |",
    "|---|---|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True, repr=False)
class Row(Brief):
    """Runs of a controller at a task with a hand.

    Attributes:
        spread: Distribution of the scores; a failed run counts with its `Played.score`.
        failed: Number of failed runs.
        runs: All runs, by seed.
        effects: What the score hangs on, if the hand was drawn.

    """

    controller: str
    task: str
    hand: str
    spread: Spread
    failed: int
    runs: tuple[Played, ...]
    effects: tuple[Effect, ...] = ()

    def worst(self, count: int = WORST) -> list[Played]:
        """Return the runs with the lowest scores, the lowest first."""
        return sorted(self.runs, key=lambda played: (played.error is None, played.score, played.seed))[:count]

    @property
    def sensing(self) -> str:
        """Sensing of its runs; several if they differ."""
        return ", ".join(sorted({run.sensing for run in self.runs if run.error is None})) or "?"

    def markdown(self) -> str:
        """Return the row as a line in Markdown, under `MARKDOWN_HEADER`."""
        spread = self.spread
        low, high = spread.interval
        worst = [run for run in self.worst() if run.score < spread.most]
        cells = (
            short_name(self.controller),
            self.task,
            self.hand,
            self.sensing,
            str(spread.runs) + (f", {self.failed} failed" if self.failed else ""),
            f"{spread.mean:.2f}",
            f"{low:.2f} … {high:.2f}",
            f"{spread.least:.4g}",
            f"{spread.quartile_1:.4g} {spread.median:.4g} {spread.quartile_3:.4g}",
            f"{spread.most:.4g}",
            ", ".join(f"{run.seed}: {run.score:.3g}" for run in worst) or "all alike",
        )
        return f"| {' | '.join(cells)} |"


@dataclass(frozen=True, repr=False)
class Compared(Brief):
    """Two controllers at a task with a hand, over the seeds of both."""

    first: str
    second: str
    task: str
    hand: str
    comparison: Comparison


@dataclass(frozen=True, repr=False)
class Report(Brief):
    """All rows and comparisons; as text, a table."""

    rows: tuple[Row, ...]
    comparisons: tuple[Compared, ...]

    @classmethod
    def of(cls, outcomes: Iterable[Played]) -> Report:
        """Return the report of these runs, in any order."""
        order: dict[str, int] = {}
        rows = []
        known = list(outcomes)
        # The successful runs show the task and hand that a controller chooses itself.
        plays = {run.controller: (run.task, run.hand) for run in known if run.error is None}
        for run in known:
            order.setdefault(run.controller, len(order))
        named = [(*_place(run, plays), run) for run in known]
        named.sort(key=lambda item: (order[item[2].controller], item[0], item[1], *_which(item[2])))
        for (place, task, hand), group in groupby(
            named, key=lambda item: (item[2].controller, item[0], item[1])
        ):
            runs = tuple(run for _, _, run in group)
            failed = [run.error is None for run in runs].count(False)
            spread = Spread.of([run.score for run in runs], [run.seed for run in runs])
            rows.append(Row(place, task, hand, spread, failed, runs, effects(runs)))
        return cls(tuple(rows), tuple(_comparisons(rows)))

    def markdown(self) -> str:
        """Return a table in Markdown, a line for each row, and one for each row with drawn hands."""
        lines = [*MARKDOWN_HEADER, *(row.markdown() for row in self.rows)]
        for row in self.rows:
            if row.effects:
                lines += ["", f"{_title(row)}:", "", *EFFECT_MARKDOWN]
                lines += [f"| {' | '.join(_effect_cells(effect))} |" for effect in row.effects]
        return "\n".join(lines) + "\n"

    def json(self) -> str:
        """Return everything as JSON."""
        return json.dumps(asdict(self))

    def __str__(self) -> str:
        lines = _table([HEADER, *map(_cells, self.rows)])
        for row in self.rows:
            if row.effects:
                table = _table([EFFECT_HEADER, *map(_effect_cells, row.effects)])
                lines += ["", f"{_title(row)}:", *(f"  {line}" for line in table)]
        for row in self.rows:
            lines += ["", f"lowest scores of {row.controller}, {row.task}, {row.hand}:"]
            lines += [f"  {_worst(run)}" for run in row.worst()]
        for compared in self.comparisons:
            lines += ["", _in_words(compared)]
        return shown("\n".join(line.rstrip() for line in lines))


def short_name(controller: str) -> str:
    """Return a file's name without its folder, a module's without its package."""
    path = Path(controller)
    return path.stem if path.suffix == ".py" else path.name.rpartition("palmares.examples.")[2]


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]


def _which(run: Played) -> tuple[int, int]:
    """Return the scene and the drawn hand."""
    return run.seed, -1 if run.hand_sample is None else run.hand_sample[0]


def _title(row: Row) -> str:
    name = short_name(row.controller)
    return f"what {name}, {row.task}, {row.hand} hangs on, over {row.spread.runs} drawn hands"


def _effect_cells(effect: Effect) -> tuple[str, ...]:
    (low, high), (least, most) = effect.interval, effect.correlation_interval
    return (
        effect.name,
        f"{effect.least:.3g} … {effect.most:.3g}",
        f"{effect.low:.2f}",
        f"{effect.high:.2f}",
        f"{effect.difference:+.2f}",
        f"{low:+.2f} … {high:+.2f}",
        f"{effect.correlation:+.2f}",
        f"{least:+.2f} … {most:+.2f}",
    )


def _place(run: Played, plays: dict[str, tuple[str, str]]) -> tuple[str, str]:
    task, hand = plays.get(run.controller, ("?", "?"))
    return run.task or task, run.hand or hand


def _cells(row: Row) -> tuple[str, ...]:
    spread = row.spread
    low, high = spread.interval
    numbers = (spread.least, spread.quartile_1, spread.median, spread.quartile_3, spread.most)
    return (
        row.controller,
        row.task,
        row.hand,
        str(spread.runs),
        f"{spread.mean:.2f}",
        f"{low:.2f} … {high:.2f}",
        *(f"{number:.4g}" for number in numbers),
        str(row.failed),
    )


def _worst(run: Played) -> str:
    replay = f", replay {run.replay}" if run.replay else ""
    hand = "" if run.hand_sample is None else ", hand {} of {}".format(*run.hand_sample)
    if run.error is not None:
        return f"seed {run.seed}{hand}: failed: {run.error}; counts {run.score:.4g}{replay}"
    return (
        f"seed {run.seed}{hand}: {run.score:.4g} ({run.in_goal} in the goal, {run.outside} outside, "
        f"{run.reason}, {run.sim_time_s:.0f} s){replay}"
    )


def _in_words(compared: Compared) -> str:
    found = compared.comparison
    low, high = found.interval
    return (
        f"{compared.first} minus {compared.second}, {compared.task}, {compared.hand}: "
        f"{found.mean:+.3f} a run (95 %: {low:+.3f} … {high:+.3f}) over {found.pairs} seeds, "
        f"better in {found.better}, equal in {found.equal}, worse in {found.worse}; p = {found.p_value:.2g}"
    )


def _comparisons(rows: list[Row]) -> Iterable[Compared]:
    """Compare the first controller with each other one at the same task and hand."""
    for row in rows:
        for other in rows:
            same = (row.task, row.hand) == (other.task, other.hand)
            if not same or row.controller != rows[0].controller or other.controller == row.controller:
                continue
            theirs = {_which(run): run.score for run in other.runs}
            pairs = [(run.score, theirs[_which(run)]) for run in row.runs if _which(run) in theirs]
            if pairs:
                first, second = zip(*pairs, strict=True)
                comparison = Comparison.of(first, second)
                yield Compared(row.controller, other.controller, row.task, row.hand, comparison)
