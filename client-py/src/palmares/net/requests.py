"""Arguments of requests."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from palmares.arguments import whole
from palmares.errors import BadRequestError


def names(cameras: Iterable[str]) -> list[str]:
    """Return the names as a list; a single name may be a string."""
    return [cameras] if isinstance(cameras, str) else list(cameras)


def whole_of(field: str, value: Any, least: int, most: int) -> int:
    """Return a whole number of a request, within these limits.

    Raises:
        BadRequestError: The value is no such number.

    """
    try:
        return whole(field, value, least, most)
    except ValueError as wrong:
        raise BadRequestError(f"bad_request: {wrong}") from None
