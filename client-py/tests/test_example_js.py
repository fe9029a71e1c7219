"""The controller in JavaScript, on a real server."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import palmares
from tests.real_server import RealServer, needs_server

SCRIPT = Path(__file__).parents[2] / "docs/examples/balls.mjs"
NODE = shutil.which("node")


def has_websocket() -> bool:
    """Return whether Node is installed and supports WebSocket, with the flag or without."""
    if NODE is None:
        return False
    command = [
        NODE,
        "--experimental-websocket",
        "--eval",
        "process.exit(typeof WebSocket === 'function' ? 0 : 1)",
    ]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


needs_node = pytest.mark.skipif(
    not has_websocket(), reason="no Node with a WebSocket (20.10 or newer) is there"
)


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    assert NODE is not None
    command = [NODE, "--experimental-websocket", str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@needs_node
@needs_server
def test_it_brings_balls_to_box_b(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server:
        done = run("--url", server.url, "--seed", "3", "--picks", "2", "--team", "crabs")
        assert done.returncode == 0, done.stderr
        result: dict[str, Any] = json.loads(done.stdout)
        assert (result["task"], result["hand"], result["seed"]) == ("balls", "softhand", 3)
        assert result["picks"] == 2
        assert result["in_goal"] == result["score"] == 2
        with palmares.Client(server.url) as client:
            (row,) = client.leaderboard()
        assert row.team == "crabs"


@needs_node
@needs_server
def test_a_refusal_of_the_server_is_one_line(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server:
        done = run("--url", server.url, "--team", "x" * 300)
    assert done.returncode == 1
    assert done.stderr.startswith("bad_request: ")
    assert done.stderr.count("\n") == 1


@needs_node
def test_a_missing_server_is_one_line() -> None:
    done = run("--url", "http://127.0.0.1:9")
    assert done.returncode == 1
    assert done.stderr == "no server at http://127.0.0.1:9\n"


@pytest.mark.skipif(NODE is None, reason="no Node is there")
def test_its_options_are_listed_and_wrong_ones_are_refused() -> None:
    for word in ("--help", "-h"):
        done = run(word)
        assert done.returncode == 0, done.stderr
        assert all(f"--{name}" in done.stdout for name in ("url", "team", "seed", "runs", "picks"))
    for words, said in (
        (["--seeds", "3"], "Unknown option '--seeds'; --help lists the options"),
        (["--seed", "three"], "--seed three: wanted a whole number; --help lists the options"),
    ):
        refused = run(*words)
        assert refused.returncode == 1
        assert refused.stderr.strip().splitlines()[-1] == said
