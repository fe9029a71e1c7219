"""Fields of a table of TOML, read one by one; an error names file, field, value and valid values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from palmares.arguments import short


class Fields:
    """A table; `end` refuses the fields that nothing asked for."""

    def __init__(self, where: str, table: Any) -> None:
        self.where = where
        if not isinstance(table, dict):
            raise ValueError(f"{where}: found {short(table)}; wanted a table")
        self._table = table
        self._asked: list[str] = []

    def wrong(self, name: str, wanted: str) -> ValueError:
        """Return the error of a field with a wrong value, or without one."""
        found = short(self._table[name]) if name in self._table else "nothing"
        return ValueError(f"{self.where}: {name}: found {found}; wanted {wanted}")

    def raw(self, name: str) -> Any:
        """Return a field as it is; None without it."""
        self._asked.append(name)
        return self._table.get(name)

    def text(self, name: str, default: str | None = None, of: Sequence[str] = ()) -> str:
        """Return a text, one of some words if these are given."""
        found = self.raw(name)
        found = default if found is None else found
        if not isinstance(found, str) or (of and found not in of):
            raise self.wrong(name, f"one of {', '.join(of)}" if of else "a text")
        return found

    def texts(self, name: str) -> list[str]:
        """Return a text, or several, as a list."""
        found = self.raw(name)
        found = [found] if isinstance(found, str) else found
        if not isinstance(found, list) or not found or not all(isinstance(it, str) for it in found):
            raise self.wrong(name, "a text or a list of texts")
        return list(found)

    def flag(self, name: str, default: bool) -> bool:
        """Return true or false."""
        found = self.raw(name)
        found = default if found is None else found
        if not isinstance(found, bool):
            raise self.wrong(name, "true or false")
        return found

    def number(
        self,
        name: str,
        default: float | None = None,
        *,
        above: float | None = None,
        least: float | None = None,
    ) -> float:
        """Return a finite number; an error without it and without a default."""
        found = self.maybe(name)
        found = default if found is None and name not in self._table else found
        bound = "" if above is None else f" above {above:g}"
        bound += "" if least is None else f" of at least {least:g}"
        if (
            found is None
            or (above is not None and not found > above)
            or (least is not None and found < least)
        ):
            raise self.wrong(name, f"a number{bound}")
        return found

    def maybe(self, name: str) -> float | None:
        """Return a finite number, or None without the field."""
        found = self.raw(name)
        if found is not None and not _is_number(found):
            raise self.wrong(name, "a number")
        return None if found is None else float(found)

    def whole(self, name: str, default: int, least: int) -> int:
        """Return a whole number."""
        found = self.raw(name)
        found = default if found is None else found
        if type(found) is not int or found < least:
            raise self.wrong(name, f"a whole number from {least} on")
        return found

    def numbers(
        self, name: str, counts: Sequence[int] = (), default: Sequence[float] | None = None
    ) -> list[float]:
        """Return a list of numbers, of one of these lengths if any is given; a number is a list of one."""
        found = self.raw(name)
        found = default if found is None else found
        return self._row(name, found, counts)

    def rows(
        self,
        name: str,
        counts: Sequence[int] = (),
        default: Sequence[Sequence[float]] | None = None,
        *,
        nan: bool = False,
    ) -> list[list[float]]:
        """Return a list of such lists."""
        found = self.raw(name)
        found = default if found is None else found
        if not isinstance(found, list | tuple) or (not found and default is None):
            raise self.wrong(name, "a list")
        return [self._row(name, row, counts, nan=nan) for row in found]

    def end(self) -> None:
        """Refuse what is left.

        Raises:
            ValueError: There is a field that nothing asked for.

        """
        for name in self._table:
            if name not in self._asked:
                valid = ", ".join(sorted(set(self._asked)))
                raise ValueError(f"{self.where}: unknown field {name!r}; valid: {valid}")

    def _row(self, name: str, found: Any, counts: Sequence[int], *, nan: bool = False) -> list[float]:
        row = [found] if _is_number(found) else found
        good = isinstance(row, list | tuple) and all(_is_number(it, nan) for it in row)
        if not good or (counts and len(row) not in counts):
            length = f"{' or '.join(map(str, counts))} numbers" if counts else "numbers"
            raise self.wrong(name, length if found is None or name == "range" else f"{length} each")
        return [float(it) for it in row]


def _is_number(value: Any, nan: bool = False) -> bool:
    real = isinstance(value, int | float) and not isinstance(value, bool)
    return real and (math.isfinite(value) or (nan and math.isnan(value)))
