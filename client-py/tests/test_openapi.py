"""No request of the OpenAPI document, valid or not, makes the server fail: schemathesis draws them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.real_server import RealServer, needs_server

pytestmark = needs_server

OFFICIAL = """\
mode = "official"
tasks = ["balls"]
hands = ["pinch"]
"""
SCHEMATHESIS = Path(sys.executable).with_name("schemathesis")
# Requests that are drawn for an operation, in addition to those that cover its schema.
EXAMPLES = 3


def test_no_request_makes_the_server_fail(tmp_path: Path) -> None:
    data, config = tmp_path / "data", tmp_path / "competition.toml"
    config.write_text(OFFICIAL)
    with RealServer(data, "--config", str(config)) as server:
        token = (data / "organizer.token").read_text().strip()
        command = [str(SCHEMATHESIS), "run", f"{server.url}/openapi.json", "--no-color", "--no-shrink"]
        command += ["--checks", "not_a_server_error", "--phases", "coverage,fuzzing"]
        command += ["--max-examples", str(EXAMPLES), "--seed", "1", "--generation-deterministic"]
        # It cannot make ZIP archives.
        command += ["--exclude-operation-id", "post_v1_hands", "--request-timeout", "60"]
        command += ["--header", f"Authorization: Bearer {token}"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        assert " passed" in done.stdout, done.stdout
