"""Hands of a design: numbers put into the files, goals measured, the best one found."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from palmares.analysis import Hand
from palmares.arrays import Array, array
from palmares.design.file import Design, Unknown
from palmares.design.goals import Measured
from palmares.design.hand_files import HandFiles, number
from palmares.design.search import Key, search
from palmares.reproducible import matmul
from palmares.sim import HANDS

DIGITS = 6
"""Significant digits of a designed number, in the measured hand as in the written one"""
SLACK_M = 1e-9
"""Changes of a tendon's length that are roundings"""
MOST_CHECKED = 20
"""So many of the best hands at most are checked, until one is usable"""


@dataclass(frozen=True)
class Candidate:
    """A hand with its numbers and goals."""

    values: tuple[float, ...]
    """Of the unknowns"""
    files: HandFiles
    measured: tuple[Measured, ...]
    """Of the goals; empty for a hand that cannot be measured"""
    problem: str
    """Why it cannot be measured"""
    score: float
    missed: float
    """Sum of the parts by which limits are missed"""

    @property
    def key(self) -> Key:
        """Key of comparison, the smaller the better."""
        return self.missed, -self.score


@dataclass
class Designed:
    """The hands of a search."""

    before: Candidate
    """The hand as it was"""
    tried: list[Candidate] = field(default_factory=list)
    """All hands, in the order in which they were measured"""
    interrupted: bool = False

    @property
    def ranked(self) -> list[Candidate]:
        """The measured hands, the best first; of equal ones the earlier."""
        return sorted((it for it in self.tried if it.measured), key=lambda it: it.key)


class Maker:
    """Makes and measures the hands of a design.

    Args:
        design: The design.
        folder: A folder of its own, in which the hand lies while it is measured.

    Raises:
        ValueError: The hand cannot be read or measured, or a place is not in it.

    """

    def __init__(self, design: Design, folder: Path) -> None:
        self.design = design
        self.folder = folder / "hand"
        copy_of(design.hand, self.folder)
        self.files = files_of(self.folder)
        for unknown in design.unknowns:
            for place in unknown.places:
                try:
                    place.read(self.files)
                except ValueError as error:
                    raise ValueError(f"{design.path}: unknown {unknown.name!r}: {error}") from None
        self._slack = self._slack_of(Hand(str(self.folder)))
        values = tuple(unknown.places[0].read(self.files) for unknown in design.unknowns)
        self.before = self._measured(values, self.files)
        if self.before.problem:
            raise ValueError(f"{design.hand}: the hand cannot be measured: {self.before.problem}")

    def start(self) -> Array:
        """Return the hand as it is as a point of the unit cube."""
        shares = [
            (value - it.low) / (it.high - it.low)
            for value, it in zip(self.before.values, self.design.unknowns, strict=True)
        ]
        return np.clip(array(shares), 0.0, 1.0)

    def at(self, point: Array) -> Candidate:
        """Return the hand at a point of the unit cube, measured."""
        values = tuple(
            _value(it, share) for it, share in zip(self.design.unknowns, point.tolist(), strict=True)
        )
        try:
            files = self._made(values)
        except ValueError as error:
            return self._worst(values, self.files, str(error))
        if files == self.files:
            return replace(self.before, values=values)
        return self._measured(values, files)

    def _made(self, values: tuple[float, ...]) -> HandFiles:
        files = self.files
        for unknown, value in zip(self.design.unknowns, values, strict=True):
            for place in unknown.places:
                files = place.write(files, value)
        if files == self.files or not self.design.taut:
            return files
        write(files, self.folder)
        return self._taut(files, Hand(str(self.folder)))

    def _slack_of(self, hand: Hand) -> Array:
        """Return the length that each tendon's joints take up where the springs rest."""
        return matmul(hand.R(), hand.q0)

    def _taut(self, files: HandFiles, hand: Hand) -> HandFiles:
        """Return the files with offsets of the motors with which the open tendons are as taut as before."""
        given = {key for it in self.design.unknowns for place in it.places for key in [place.keys]}
        more, before = self._slack_of(hand) - self._slack, self.files.settings.get("motors", {})
        shared = np.count_nonzero(hand.W, axis=1) > 1
        if shared[np.abs(more) > SLACK_M].any():
            raise ValueError(
                "hand.toml: a tendon of several motors is no longer as taut as it was; write taut = false "
                "into the design file, and make offsets unknowns"
            )
        for column, motor in enumerate(hand.motors):
            wound = hand.W[:, column]
            rows = np.flatnonzero(wound)
            now = files.settings.get("motors", {}).get(motor, {})
            if ("motors", motor, "offset") in given or not len(rows) or motor not in before:
                continue
            was = before[motor]["scaling"] * before[motor].get("offset", 0.0)
            # Each tendon is wound by (weight · scaling) · (σ − offset).
            wanted = {
                round((was - float(more[row]) * now["scaling"] / float(wound[row])) / now["scaling"], 9)
                for row in rows.tolist()
            }
            (offset, *others) = sorted(wanted)
            if not others and abs(offset - now.get("offset", 0.0)) < 1e-8:
                continue
            if others or "offset" not in now:
                raise ValueError(
                    f"hand.toml: [motors.{motor}]: "
                    + ("its tendons need different offsets" if others else "it has no offset; add offset = 0")
                    + "; or write taut = false into the design file"
                )
            files = files.toml_with(("motors", motor, "offset"), number(offset))
        return files

    def _measured(self, values: tuple[float, ...], files: HandFiles) -> Candidate:
        write(files, self.folder)
        try:
            found = tuple(goal.measure(str(self.folder)) for goal in self.design.goals)
        except ValueError as error:
            return self._worst(values, files, str(error))
        pairs = list(zip(self.design.goals, found, strict=True))
        score = math.fsum(goal.score(it.value) for goal, it in pairs)
        missed = math.fsum(goal.missed(it.value) for goal, it in pairs)
        return Candidate(values, files, found, "", score, missed)

    def _worst(self, values: tuple[float, ...], files: HandFiles, problem: str) -> Candidate:
        return Candidate(values, files, (), problem, -math.inf, math.inf)


def _value(unknown: Unknown, share: float) -> float:
    value = unknown.low + share * (unknown.high - unknown.low)
    return min(max(float(f"{value:.{DIGITS}g}"), unknown.low), unknown.high)


@contextmanager
def maker(design: Design) -> Iterator[Maker]:
    """Yield a maker of a design's hands; its folder goes afterwards."""
    with tempfile.TemporaryDirectory(prefix="palmares-design-") as name:
        yield Maker(design, Path(name))


def find(
    made: Maker, evaluations: int, seed: int = 1, report: Callable[[Designed], None] | None = None
) -> Designed:
    """Search for the best hand; Ctrl-C ends the search and keeps the hands so far.

    The result is a function of the design, `evaluations` and `seed`, on every machine.

    Args:
        made: Makes the hands.
        evaluations: How many hands are measured, the given one included.
        seed: Of the steps of the search.
        report: Called after each hand.

    """
    designed = Designed(made.before)

    def evaluate(point: Array) -> Key:
        found = made.at(point)
        designed.tried.append(found)
        if report is not None:
            report(designed)
        return found.key

    try:
        search(evaluate, made.start(), evaluations, np.random.default_rng(seed))
    except KeyboardInterrupt:
        designed.interrupted = True
    return designed


def usable(designed: Designed, folder: Path) -> Candidate:
    """Write the best hand that `palmares hand check` finds usable into a folder that has the hand; return it.

    Raises:
        ValueError: None of the best hands is usable; the message has the last error.

    """
    errors = "no hand could be measured"
    if designed.tried and not designed.ranked:
        errors = designed.tried[-1].problem
    for candidate in designed.ranked[:MOST_CHECKED]:
        write(candidate.files, folder)
        command = [sys.executable, "-m", "palmares", "hand", "check", str(folder), "--json"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")
        if done.returncode == 0:
            return candidate
        try:
            errors = "; ".join(map(str, json.loads(done.stdout)["errors"]))
        except (ValueError, KeyError):
            errors = done.stderr.strip()
    raise ValueError(f"no hand that was found is usable: {errors}")


def copy_of(hand: str, folder: Path) -> None:
    """Copy a built-in hand, or a folder with a hand, into a new folder.

    Raises:
        ValueError: It cannot be copied.

    """
    if hand not in HANDS:
        if folder.resolve().is_relative_to(Path(hand).resolve()):
            raise ValueError(f"{folder} is in the folder of the hand {hand}; name another")
        shutil.copytree(hand, folder, dirs_exist_ok=True)
        return
    command = [sys.executable, "-m", "palmares", "hand", "copy", hand, "--out", str(folder), "--force"]
    # The folder may have the name of a built-in hand.
    command += ["--name", "designed"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")
    if done.returncode != 0:
        raise ValueError(f"{hand}: {done.stderr.strip()}")


def files_of(folder: Path) -> HandFiles:
    """Return the texts of a hand's folder.

    Raises:
        ValueError: It has no URDF, or several.

    """
    found = [folder / "hand.urdf"] if (folder / "hand.urdf").is_file() else sorted(folder.glob("*.urdf"))
    if len(found) != 1:
        raise ValueError(f"{folder}: found {len(found)} files *.urdf; wanted hand.urdf, or one")
    settings = folder / "hand.toml"
    text = settings.read_text(encoding="utf-8") if settings.is_file() else ""
    return HandFiles(text, found[0].read_bytes(), found[0].name)


def write(files: HandFiles, folder: Path) -> None:
    """Write the texts into a hand's folder."""
    (folder / "hand.toml").write_text(files.toml, encoding="utf-8")
    (folder / files.urdf_name).write_bytes(files.urdf)
