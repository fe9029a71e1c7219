"""The addresses of a server, from the one that a person has."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit

# Paths of the sockets below the address of a server.
CONTROL, WATCH = "/v1/control", "/v1/watch"
SCHEMES = {"http": ("http", "ws"), "https": ("https", "wss"), "ws": ("http", "ws"), "wss": ("https", "wss")}


@dataclass(frozen=True)
class Addresses:
    """The addresses of one server."""

    http: str
    """The pages, without a slash at the end."""
    control: str
    """The socket of teams."""
    watch: str
    """The socket of spectators."""


def addresses(url: str) -> Addresses:
    """Return the addresses of the server at `url`.

    Args:
        url: The address of the server, or of one of its sockets; `palmares serve` prints both.

    Raises:
        ValueError: It is no such address.

    """
    parts = urlsplit(url if "://" in url else f"http://{url}")
    if parts.scheme not in SCHEMES or not parts.netloc:
        raise ValueError(f"{url!r} is not the address of a server; try http://127.0.0.1:8080")
    http, ws = SCHEMES[parts.scheme]
    place = parts.netloc + parts.path.rstrip("/").removesuffix(CONTROL).removesuffix(WATCH)
    return Addresses(f"{http}://{place}", f"{ws}://{place}{CONTROL}", f"{ws}://{place}{WATCH}")
