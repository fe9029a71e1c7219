"""Compute the leaderboard from a folder of replays alone, to check the server's leaderboard.

    pip install mcap
    python leaderboard_from_replays.py replays/ --key 3b6a27bc...  [--practice] [--void run_1 run_2 ...]

It does not use Palmares: it reads the files with the package `mcap` and checks signatures with the lines of
Ed25519 below (RFC 8032). The scores are those in the files; `palmares verify` simulates the runs again. Name
runs that do not count (voided, rejected, aborted by a crash) with --void, because their files do not show it.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path

P = 2**255 - 19
ORDER = 2**252 + 27742317777372353535851937790883648493
D = -121665 * pow(121666, P - 2, P) % P
Point = tuple[int, int]


def add(a: Point, b: Point) -> Point:
    """Add two points of the curve -x² + y² = 1 + d x² y²."""
    (x1, y1), (x2, y2) = a, b
    c = D * x1 * x2 * y1 * y2 % P
    x = (x1 * y2 + x2 * y1) * pow(1 + c, P - 2, P) % P
    return x, (y1 * y2 + x1 * x2) * pow(1 - c, P - 2, P) % P


def times(n: int, point: Point) -> Point:
    """Multiply a point with a number."""
    result = (0, 1)
    while n:
        if n & 1:
            result = add(result, point)
        point, n = add(point, point), n >> 1
    return result


def decoded(data: bytes) -> Point:
    """Read a point from its 32 bytes."""
    y = int.from_bytes(data, "little")
    sign, y = y >> 255, y & (2**255 - 1)
    square = (y * y - 1) * pow(D * y * y + 1, P - 2, P) % P
    x = pow(square, (P + 3) // 8, P)
    if (x * x - square) % P:
        x = x * pow(2, (P - 1) // 4, P) % P
    if y >= P or (x * x - square) % P:
        raise ValueError("no point of the curve")
    return (x, y) if x & 1 == sign else (P - x, y)


def signed(key: bytes, message: bytes, signature: bytes) -> bool:
    """Return whether `key` signed `message`."""
    s = int.from_bytes(signature[32:], "little")
    base = decoded((4 * pow(5, P - 2, P) % P).to_bytes(32, "little"))
    k = int.from_bytes(hashlib.sha512(signature[:32] + key + message).digest(), "little") % ORDER
    return s < ORDER and times(s, base) == add(decoded(signature[:32]), times(k, decoded(key)))


def read(path: Path, key: str | None) -> tuple[dict[str, str], dict[str, str]]:
    """Return a replay's metadata of run and result; `ValueError` if `key` has not signed it."""
    data = path.read_bytes()
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        records = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    proof = records["palmares.signature"]
    digits = proof["signature"].encode()
    if data.count(digits) != 1:
        raise ValueError("the signature is not in the file exactly once")
    digest = hashlib.sha256(data.replace(digits, b"0" * len(digits))).digest()
    if key is not None and proof["public_key"] != key:
        raise ValueError(f"signed by {proof['public_key']}")
    public = bytes.fromhex(proof["public_key"])
    if not signed(public, b"palmares replay 1\0" + digest, bytes.fromhex(proof["signature"])):
        raise ValueError("the signature is wrong")
    return records["palmares.run"], records["palmares.result"]


@dataclass
class Team:
    """The runs of a team."""

    sensors_only: bool = True
    runs: int = 0
    best: dict[str, tuple[float, int, str]] = field(default_factory=dict)
    """For each task: score, end in ms since 1970, run"""

    @property
    def total(self) -> float:
        """Sum of the best scores, in order of the tasks' names."""
        total = 0.0  # Not `sum`, which rounds otherwise from Python 3.12 on.
        for _, (score, _, _) in sorted(self.best.items()):
            total += score
        return total

    @property
    def reached_unix_ms(self) -> int:
        """Time of the last best score, ms since 1970."""
        return max(end for _, end, _ in self.best.values())


def main() -> int:
    """Print the leaderboard as JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the files *.mcap")
    parser.add_argument("--key", help="public key of the server: replay_key in GET /v1/competition")
    parser.add_argument("--practice", action="store_true", help="practice runs instead of official ones")
    parser.add_argument("--void", nargs="*", default=[], metavar="RUN", help="runs that do not count")
    options = parser.parse_args()
    try:
        importlib.import_module("mcap")
    except ImportError:
        sys.exit("this needs the package mcap: pip install mcap")
    teams: dict[str, Team] = {}
    refused = {}
    for path in sorted(options.folder.glob("*.mcap")):
        if path.stem in options.void:
            continue
        try:
            run, result = read(path, options.key)
        except Exception as error:
            refused[path.name] = f"{type(error).__name__}: {error}"
            continue
        outcome = json.loads(result["outcome"])
        voided = outcome["reason"] in ("world_fault", "voided")
        if voided or (run["kind"] == "practice") != options.practice:
            continue
        team = teams.setdefault(run["team"], Team())
        team.sensors_only &= run["sensing"] == "sensors"
        team.runs += 1
        new = (float(outcome["score"]), int(result["ended_unix_ms"]), run["run_id"])
        old = team.best.get(run["task"])
        if old is None or (-new[0], new[1], new[2]) < (-old[0], old[1], old[2]):
            team.best[run["task"]] = new
    scored = [item for item in teams.items() if item[1].best]
    ranked = sorted(scored, key=lambda item: (-item[1].total, item[1].reached_unix_ms, item[0]))
    rows = [
        {
            "rank": rank,
            "team": name,
            "total": team.total,
            "runs": team.runs,
            "sensors_only": team.sensors_only,
            "tasks": {task: {"score": b[0], "run_id": b[2]} for task, b in sorted(team.best.items())},
        }
        for rank, (name, team) in enumerate(ranked, start=1)
    ]
    print(json.dumps({"rows": rows, "refused": refused}, indent=2))
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
