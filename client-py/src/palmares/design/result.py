"""The folder of a designed hand: its files, a page and a picture."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

from palmares.design.file import Design
from palmares.design.goals import Goal
from palmares.design.hand_files import HandFiles
from palmares.design.making import Candidate, Designed, copy_of, files_of, usable, write
from palmares.design.picture import picture
from palmares.sim import HANDS

README = """\
# {name}

{origin}, with {count} designed for the goals below by `palmares hand design`.

![The search, the goals and the fates](design.svg)

```
palmares hand check {folder}
palmares hand show {folder}
```

## Numbers

| unknown | place | before | designed | range |
|---|---|---|---|---|
{unknowns}
{offsets}
## Goals

| goal | kind | before | designed | wanted |
|---|---|---|---|---|
{goals}

{searched}

```
{command}
```

[design.toml](design.toml) is the design file. All other numbers are those of the hand before.
"""


def write_hand(design: Design, designed: Designed, folder: Path, command: str) -> Candidate:
    """Write the best usable hand of a search with its README.md, design.toml and design.svg; return it.

    Args:
        design: The design.
        designed: The hands of the search.
        folder: The new hand's folder.
        command: The command that does it again, for the page.

    Raises:
        ValueError: No hand that was found is usable.
        OSError: The folder cannot be written.

    """
    copy_of(design.hand, folder)
    before = files_of(folder)
    best = usable(designed, folder)
    name = name_of(folder)
    write(named(best.files, name), folder)
    if design.path.resolve() != (folder / "design.toml").resolve():
        shutil.copyfile(design.path, folder / "design.toml")
    (folder / "design.svg").write_text(picture(design, designed, best), encoding="utf-8")
    page = _page(design, designed, best, before, name, folder, command)
    (folder / "README.md").write_text(page, encoding="utf-8")
    return best


def name_of(folder: Path) -> str:
    """Return the name of a hand after its folder, other than those of built-in hands."""
    name = re.sub(r"[^A-Za-z0-9_.-]", "_", folder.resolve().name)[:50] or "hand"
    return f"{name}-designed" if name in HANDS else name


def named(files: HandFiles, name: str) -> HandFiles:
    """Return the files of a hand with another name."""
    if "name" in files.settings:
        return files.toml_with(("name",), json.dumps(name))
    return HandFiles(f"name = {json.dumps(name)}\n{files.toml}", files.urdf, files.urdf_name)


def _page(
    design: Design,
    designed: Designed,
    best: Candidate,
    before: HandFiles,
    name: str,
    folder: Path,
    command: str,
) -> str:
    unknowns = [
        f"| {it.name} | `{place.text}` | {place.read(before):.6g} | {place.read(best.files):.6g} | "
        f"{it.low:g} to {it.high:g} |"
        for it in design.unknowns
        for place in it.places
    ]
    goals = [
        f"| {goal.common.name} | {goal.kind} | {_shown(goal, was.value)} | {_shown(goal, now.value)} | "
        f"{wanted(goal)} |"
        for goal, was, now in zip(design.goals, designed.before.measured, best.measured, strict=True)
    ]
    count = len(design.unknowns)
    ended = "Ctrl-C ended the search after" if designed.interrupted else "The search measured"
    limits = "" if best.missed == 0.0 else " No hand keeps all limits; this one misses them least."
    problems = [it.problem for it in designed.tried if it.problem]
    unmeasured = ""
    if problems:
        unmeasured = f" {len(problems)} of them could not be measured; the first one: {problems[0]}."
    hand = design.hand if design.hand in HANDS else Path(design.hand).resolve().name
    return README.format(
        name=name,
        origin=f"The hand `{hand}`",
        count=f"{count} number{'s' if count > 1 else ''}",
        folder=f"{folder.name}/",
        unknowns="\n".join(unknowns),
        offsets=_offsets(before, best.files),
        goals="\n".join(goals),
        searched=f"{ended} {len(designed.tried)} hands.{unmeasured}{limits}",
        command=command,
    )


def _offsets(before: HandFiles, after: HandFiles) -> str:
    """Return the sentence on offsets of motors that followed, or nothing."""
    was, now = before.settings.get("motors", {}), after.settings.get("motors", {})
    changed = [
        f"`motors.{motor}.offset` is {now[motor]['offset']:.6g} instead of {was[motor]['offset']:.6g}"
        for motor in now
        if now[motor].get("offset") != was[motor].get("offset")
    ]
    return f"\n{'; '.join(changed)}: offsets keep the open tendons taut.\n" if changed else ""


def wanted(goal: Goal) -> str:
    """Return in words what a goal asks for."""
    common = goal.common
    words = [f"at least {common.at_least:g}"] if common.at_least is not None else []
    words += [f"at most {common.at_most:g}"] if common.at_most is not None else []
    if common.weight:
        words.append(f"{'more' if goal.larger_is_better else 'less'}, weight {common.weight:g}")
    return "; ".join(words)


def _shown(goal: Goal, value: float) -> str:
    return f"{value:.4g}" + (f" {goal.unit}" if goal.unit else "")
