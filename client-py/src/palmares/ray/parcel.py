"""Files for workers on other machines: a controller's source, hands and tasks."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from palmares.evaluate.controller import is_file

# Files of a hand or a task that is no archive.
KINDS = {".urdf", ".toml", ".stl"}
# Limits the transfer if a large folder is named by mistake.
MAX_BYTES = 100 << 20


@dataclass(frozen=True)
class Parcel:
    """Files to send.

    Attributes:
        main: Path of the main file in the parcel; empty for the whole folder.
        files: Contents by path in the parcel.

    """

    main: str
    files: dict[str, bytes]

    def unpack(self, folder: Path) -> str:
        """Write the files below a folder; return the path of the main one."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        return str(folder / self.main)


def of_controller(controller: str) -> Parcel | None:
    """Pack a controller and the modules it imports from its folder; `None` for a module given by name."""
    if not is_file(controller):
        return None
    path = Path(controller).resolve()
    waiting, found = [path], dict[Path, bytes]()
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file] = file.read_bytes()
            waiting += imported(file, found[file], path.parent)
    return Parcel(path.name, {file.relative_to(path.parent).as_posix(): text for file, text in found.items()})


def imported(file: Path, text: bytes, folder: Path) -> Iterator[Path]:
    """Return the files below a folder that any import in a file may mean."""
    for node in ast.walk(ast.parse(text, str(file))):
        if isinstance(node, ast.Import):
            names, start = [alias.name for alias in node.names], folder
        elif isinstance(node, ast.ImportFrom):
            start = file.parents[node.level - 1] if node.level else folder
            of = [node.module] if node.module else []
            names = [".".join([*of, alias.name]) for alias in node.names]
        else:
            continue
        if not start.is_relative_to(folder):
            continue
        for name in names:
            place = start
            for part in name.split("."):
                place = place / part
                candidates = (place / "__init__.py", place.with_name(f"{part}.py"))
                yield from (path for path in candidates if path.is_file())


def of_files(name: str | None) -> Parcel | None:
    """Pack the files of a hand or task given by its path; `None` for one given by name.

    Raises:
        ValueError: The files exceed `MAX_BYTES`.

    """
    from palmares import sim

    if name is None or name in (*sim.TASKS, *sim.HANDS) or not Path(name).exists():
        return None
    path = Path(name).resolve()
    if path.is_file() and path.suffix not in KINDS:
        return Parcel(path.name, {path.name: path.read_bytes()})
    folder, main = (path, "") if path.is_dir() else (path.parent, path.name)
    files, total = dict[str, bytes](), 0
    for file in sorted(file for file in folder.rglob("*") if file.suffix in KINDS and file.is_file()):
        total += file.stat().st_size
        if total > MAX_BYTES:
            raise ValueError(f"{name}: more than {MAX_BYTES} bytes of {', '.join(sorted(KINDS))}")
        files[file.relative_to(folder).as_posix()] = file.read_bytes()
    return Parcel(main, files)
