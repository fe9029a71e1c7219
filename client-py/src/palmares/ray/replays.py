"""Replays verified on a Ray cluster, for ``palmares verify --ray``."""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import ray
from ray.exceptions import RayError, RayTaskError

from palmares.ray.parcel import Parcel, of_files
from palmares.ray.runs import LOOK_S, OPTIONS, build, check_build, connect

# Replays for each core: while one is verified, the next is on its way.
AHEAD = 2

Replay = tuple[int, bytes]


def verify(
    incoming: BinaryIO,
    write: Callable[[dict[str, Any]], None],
    wanted: str,
    address: str | None,
    *,
    key: str | None,
    tasks: Sequence[str],
) -> None:
    """Verify replays in the order in which they come; write each verdict when it is there.

    Every replay is a task of Ray. When a worker is lost, Ray verifies its replay again on another one.

    Args:
        incoming: For each replay a line of JSON with ``index`` and ``bytes``, then its bytes.
        write: Takes ``{"ready": places}`` at first, then ``{"judged": {"index": …, "verdict": …}}``.
        wanted: Build of the program, which the package has to have on every machine.
        address: As for `palmares.ray.pool`.
        key: Expected public key of the server.
        tasks: Folders of tasks that are not built in.

    Raises:
        RuntimeError: The build differs, here or on a worker.

    """
    if build() != wanted:
        raise RuntimeError(f"this Python has palmares {build()}, not {wanted}: install the same version")
    connect(address)
    # An address or credentials of a bucket stay here: workers get bytes.
    remote = ray.remote(check_replay).options(**OPTIONS)
    parcels = [ray.put(of_files(task)) for task in tasks]
    came: queue.SimpleQueue[Replay | None] = queue.SimpleQueue()
    threading.Thread(target=read, args=(incoming, came), daemon=True).start()
    write({"ready": AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))})
    waiting: dict[Any, int] = {}
    open_input = True
    while open_input or waiting:
        with contextlib.suppress(queue.Empty):
            while open_input:
                replay = came.get(timeout=None if not waiting else 0.01)
                if replay is None:
                    open_input = False
                    break
                index, content = replay
                waiting[remote.remote(content, wanted, key, *parcels)] = index
        if waiting:
            ready, _ = ray.wait(list(waiting), timeout=LOOK_S if not open_input else 0.05)
            for ref in ready:
                write({"judged": {"index": waiting.pop(ref), "verdict": verdict_of(ref)}})


def read(incoming: BinaryIO, came: queue.SimpleQueue[Replay | None]) -> None:
    """Read replays until the input ends."""
    while line := incoming.readline():
        head = json.loads(line)
        content = incoming.read(head["bytes"])
        if len(content) < head["bytes"]:
            break
        came.put((head["index"], content))
    came.put(None)


def verdict_of(ref: Any) -> dict[str, Any]:
    """Return the verdict of a task that has ended; ``unreadable`` if its workers were lost too often."""
    try:
        verdict: dict[str, Any] = ray.get(ref)
    except RayTaskError as error:
        raise RuntimeError(f"on a worker: {error.cause or error}") from error
    except RayError as lost:
        reason = str(lost).split("\n", 1)[0]
        return {"verdict": "unreadable", "message": f"its worker was lost: {reason}"}
    return verdict


def check_replay(content: bytes, wanted: str, key: str | None, *tasks: Parcel | None) -> dict[str, Any]:
    """Verify a replay in this worker with the program; return the verdict as its ``--json`` has it."""
    check_build(wanted)
    with tempfile.TemporaryDirectory(prefix="palmares-") as name:
        folder = Path(name)
        file = folder / "replay.mcap"
        file.write_bytes(content)
        command = [sys.executable, "-m", "palmares", "verify", "--json", "--jobs", "1", str(file)]
        if key is not None:
            command += ["--key", key]
        for number, task in enumerate(tasks):
            if task is not None:
                command += ["--task", task.unpack(folder / f"task{number}")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    if not lines:
        raise RuntimeError(f"`palmares verify` ended with {done.returncode}: {done.stderr.strip()}")
    verdict: dict[str, Any] = json.loads(lines[0])
    del verdict["file"]
    return verdict
