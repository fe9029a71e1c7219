"""Programs and HTTP requests."""

from __future__ import annotations

import http.client
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any


def run(*words: str, text: str | None = None, timeout_s: float = 60.0) -> str:
    """Run a program and return its output; a failure is an error with its messages."""
    done = subprocess.run(words, input=text, capture_output=True, text=True, timeout=timeout_s, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def attempt(*words: str) -> bool:
    """Run a program; return whether it succeeded."""
    return subprocess.run(words, capture_output=True, check=False, timeout=60.0).returncode == 0


def start(words: Sequence[str], log: Path, folder: Path | None = None) -> subprocess.Popen[bytes]:
    """Start a program that writes into a log file."""
    with log.open("ab") as output:
        return subprocess.Popen(
            list(words), stdin=subprocess.DEVNULL, stdout=output, stderr=output, cwd=folder, process_group=0
        )


def until(condition: Callable[[], bool], limit_s: float, what: str, period_s: float = 0.02) -> None:
    """Wait for a condition."""
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"not within {limit_s:g} s: {what}")
        time.sleep(period_s)


def get(address: str, path: str, timeout_s: float = 1.0) -> tuple[int, str]:
    """GET a path; the status is 0 when there is no answer."""
    return request("GET", address, path, timeout_s=timeout_s)


def request(
    method: str, address: str, path: str, body: str | None = None, timeout_s: float = 1.0, **headers: str
) -> tuple[int, str]:
    """Send a request; the status is 0 when there is no answer."""
    connection = http.client.HTTPConnection(address, timeout=timeout_s)
    try:
        connection.request(method, path, body=body, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(errors="replace")
    except (OSError, http.client.HTTPException):
        return 0, ""
    finally:
        connection.close()


def tail(log: Path, lines: int = 15) -> str:
    """Return the last lines of a log."""
    return "\n".join(log.read_text(errors="replace").splitlines()[-lines:]) if log.exists() else ""


Process = subprocess.Popen[bytes]
Output = IO[Any]
