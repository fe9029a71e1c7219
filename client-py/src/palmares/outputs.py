"""Where a long command writes: files that are tried first, and terminals that cannot show all characters."""

from __future__ import annotations

import argparse
import codecs
import sys
import tempfile
from pathlib import Path

PLAIN = {
    "…": "...",
    "×": "x",
    "·": "*",
    "°": " deg",
    "²": "^2",
    "±": "+-",
    "−": "-",
    "–": "-",
    "—": "-",
    "→": "->",
    "’": "'",
    "σ": "sigma",
    "Φ": "Phi",
}
"""Replacements of characters that a terminal cannot show; others become question marks"""
HANDLER = "palmares.plain"


def _plain(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    found = error.object[error.start : error.end]
    return "".join(PLAIN.get(character, "?") for character in found), error.end


codecs.register_error(HANDLER, _plain)


def shown(text: str) -> str:
    """Return a text as the terminal can show it."""
    encoding = getattr(sys.stdout, "encoding", None)
    if not encoding or text.isascii():
        return text
    try:
        return text.encode(encoding, HANDLER).decode(encoding)
    except (LookupError, UnicodeError):
        return text


def show_everything() -> None:
    """Let prints of this process replace what the terminal cannot show, instead of ending with an error."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors=HANDLER)


def output_file(text: str) -> Path:
    """Return the file of an option, and try to write it; one that is there stays as it is.

    Raises:
        ArgumentTypeError: It cannot be written.

    """
    file = Path(text)
    try:
        is_new = not file.exists()
        with file.open("a", encoding="utf-8"):
            pass
        if is_new:
            file.unlink()
    except OSError as error:
        raise argparse.ArgumentTypeError(f"it cannot be written: {error}; name another place") from None
    return file


def output_folder(text: str) -> Path:
    """Return the folder of an option, which is made; try to write into it.

    Raises:
        ArgumentTypeError: It cannot be made, or nothing can be written into it.

    """
    folder = Path(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{text} cannot be written: {error}; name another place") from None
    return folder
