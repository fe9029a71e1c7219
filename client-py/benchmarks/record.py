"""The line that a page of measured results has: engine, models, commit, day and machine.

    python record.py controllers        prints that of the part `controllers`

``bench/src/record/pages.toml`` declares the parts. `palmares-bench pages` reads the lines and lists the pages
that are of another engine.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import subprocess
import tomllib
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palmares.sim import Identity, identity

ROOT = Path(__file__).resolve().parents[2]
DECLARED = ROOT / "bench/src/record/pages.toml"
DIGITS = 12
PAGES = (":!docs", ":!README.md", ":!models/hands/grasps.toml")
"""Files whose change does not make the program another one"""


def controllers(root: Path, named: Iterable[str]) -> str:
    """Return a digest of the names and texts of files, and of the Python files in folders."""
    digest = hashlib.sha256()

    def text(words: str) -> None:
        raw = words.encode()
        digest.update(len(raw).to_bytes(8, "little") + raw)

    text("controllers")
    for name in named:
        folder = root / name
        files = sorted(f"{name}/{path.name}" for path in folder.glob("*.py")) if folder.is_dir() else [name]
        for file in files:
            text(file)
            text((root / file).read_text())
    return digest.hexdigest()[:DIGITS]


def models(part: dict[str, Any], known: Identity) -> dict[str, str]:
    """Return hashes of what a part depends on beside the engine, by name."""
    found = {f"hand {name}": known.hands[name][:DIGITS] for name in part.get("hands", [])}
    found |= {f"task {name}": known.tasks[name][:DIGITS] for name in part.get("tasks", [])}
    if part.get("controllers"):
        found["controllers"] = controllers(ROOT, part["controllers"])
    return dict(sorted(found.items()))


def commit() -> str:
    """Return the checked-out commit, with a `+` if files of the program are changed."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    name = git("rev-parse", "--short=10", "HEAD") or "unknown"
    return name + ("+" if git("status", "--porcelain", "--untracked-files=no", "--", ".", *PAGES) else "")


def processor() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or "unknown processor"


def fields(name: str) -> dict[str, Any]:
    """Return the record of a part as fields of a JSON."""
    known = identity()
    parts = {part["name"]: part for part in tomllib.loads(DECLARED.read_text())["part"]}
    machine = {
        "processor": processor(),
        "threads": os.cpu_count(),
        "system": f"{platform.system().lower()} {platform.machine()}",
    }
    return {
        "engine": known.engine,
        "models": models(parts[name], known),
        "commit": commit(),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine,
    }


def line(record: dict[str, Any]) -> str:
    """Return the line of a page with these fields."""
    hashes = "".join(f"; {name} {digest}" for name, digest in record["models"].items())
    machine = record["machine"]
    words = f"{machine['processor']}, {machine['threads']} threads, {machine['system']}"
    return f"Engine {record['engine']}{hashes}; commit {record['commit']}; {record['date']}; {words}."


def of_page(page: Path, name: str, whole: bool) -> str:
    """Return the line for a page of a part that is written again.

    A page of which only some rows are new keeps its line, unless this is of the same engine and models.
    """
    new = line(fields(name))
    lines = page.read_text().splitlines() if page.exists() else []
    old = next(
        (text for text in (row.removeprefix("# ") for row in lines) if text.startswith("Engine ")), new
    )
    same = old.partition("; commit ")[0] == new.partition("; commit ")[0]
    return new if whole or same else old


def main() -> None:
    """Print a line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("part")
    print(line(fields(parser.parse_args().part)))


if __name__ == "__main__":
    main()
