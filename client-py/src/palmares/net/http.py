"""Requests over HTTP: hands, replays, the leaderboard, results."""

from __future__ import annotations

import urllib.error
import urllib.request
from typing import Any
from urllib.parse import urlsplit

import msgspec

from palmares.errors import NoServerError, PalmaresError, ProtocolError, error_of
from palmares.messages import Result
from palmares.wire import LeaderboardRow

TIMEOUT_S = 10.0


def is_loopback(url: str) -> bool:
    """Return whether `url` is this machine; such requests must not go through a proxy."""
    return urlsplit(url).hostname in ("127.0.0.1", "localhost", "::1")


def get(base_url: str, path: str, token: str | None = None) -> bytes:
    """GET `path` and return the body of the response."""
    request = urllib.request.Request(base_url + path)
    if token:
        # Not a plain header: a redirect to another server must not receive the token.
        request.add_unredirected_header("Authorization", f"Bearer {token}")
    handlers = [urllib.request.ProxyHandler({})] if is_loopback(base_url) else []
    opener = urllib.request.build_opener(*handlers)
    try:
        with opener.open(request, timeout=TIMEOUT_S) as response:
            body: bytes = response.read()
    except urllib.error.HTTPError as refused:
        raise error_of_response(refused.code, refused.read(), base_url + path) from None
    except OSError as unreachable:
        raise NoServerError(
            f"no server at {base_url} ({unreachable}); is `palmares serve` running?"
        ) from None
    return body


def get_json(base_url: str, path: str, token: str | None = None) -> Any:
    """GET `path` and return the decoded JSON."""
    body = get(base_url, path, token)
    try:
        return msgspec.json.decode(body)
    except msgspec.MsgspecError as unreadable:
        raise ProtocolError(f"the response of {base_url}{path} is not JSON: {unreadable}") from None


def get_object(base_url: str, path: str, token: str | None = None) -> dict[str, Any]:
    """GET `path` and return the decoded JSON object."""
    value = get_json(base_url, path, token)
    if not isinstance(value, dict):
        raise ProtocolError(f"the response of {base_url}{path} is not a JSON object")
    return value


def leaderboard(base_url: str, token: str | None = None) -> list[LeaderboardRow]:
    """Return the rows of ``/v1/leaderboard``, best first."""
    rows = get_object(base_url, "/v1/leaderboard", token).get("rows")
    try:
        return msgspec.convert(rows, list[LeaderboardRow])
    except msgspec.ValidationError as unreadable:
        raise ProtocolError(f"{base_url}/v1/leaderboard: {unreadable}") from None


def result_of(base_url: str, run_id: str, token: str | None = None) -> Result | None:
    """Return the stored result of a run that has ended; ``None`` when there is none."""
    try:
        return msgspec.convert(get_object(base_url, f"/v1/runs/{run_id}", token) | {"op": "result"}, Result)
    except (PalmaresError, msgspec.ValidationError):
        return None


def error_of_response(status: int, body: bytes | bytearray, where: str) -> PalmaresError:
    """Return the exception for an HTTP error; Palmares sends it as `application/problem+json`."""
    try:
        problem = msgspec.json.decode(bytes(body), type=dict[str, Any])
    except msgspec.MsgspecError:
        problem = {}
    code = problem.get("code")
    text = problem.get("detail") or problem.get("message") or problem.get("title") or ""
    if status == 401:
        text = f"{text or 'the token is missing or wrong'}; pass token=… or set PALMARES_TOKEN"
        return error_of("not_authorized", str(text))
    if isinstance(code, str):
        return error_of(code, str(text), retry_after_s=problem.get("retry_after_s"))
    if status in (502, 503, 504):
        # A proxy that reaches no server now. After a break the client tries again.
        return NoServerError(f"no server behind {where}: HTTP status {status}")
    return PalmaresError(f"{where}: HTTP status {status} {text}".rstrip())
