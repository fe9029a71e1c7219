"""The conditions of the end: every acknowledged result is stored, once, and verified."""

from __future__ import annotations

import math
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path
from typing import Any

from fleet.faults import Fault
from fleet.fleet import Fleet
from fleet.services import BUCKET
from fleet.shell import attempt, request, until

COUNTS = ("provisional", "verified")
# Ends by the rules of the task.
ENDS = ("complete", "time_limit")
# A pause that begins this long after the end of a fault is still its consequence, s.
SETTLE_S = 3.0


def wait_for_verdicts(fleet: Fleet, limit_s: float) -> None:
    """Wait until no run is open and none waits for its verification; the counts show those that still do."""
    assert fleet.postgres
    postgres = fleet.postgres
    waiting = "SELECT COUNT(*) FROM runs WHERE status IN ('open', 'provisional')"
    try:
        until(lambda: postgres.sql(waiting) == "0", limit_s, "all runs are verified", 0.5)
    except TimeoutError as late:
        print(late)


def quantile(sorted_values: list[float], share: float) -> float:
    """Return a quantile: the value that this share of all does not exceed."""
    if not sorted_values:
        return 0.0
    return sorted_values[min(len(sorted_values) - 1, math.ceil(share * len(sorted_values)) - 1)]


def resume_times(events: list[dict[str, Any]], faults: list[Fault]) -> dict[str, list[float]]:
    """Return how long clients waited, sorted, by the kind of the last fault in the pause.

    The part of a pause in which nobody could serve does not count.
    """
    waits: dict[str, list[float]] = {}
    for gap in events:
        if gap["event"] != "gap":
            continue
        begin: float = gap["from_s"]
        kind = "none"
        for fault in faults:
            if fault.began_s <= gap["to_s"] and fault.healed_s >= gap["from_s"] - SETTLE_S:
                begin = max(begin, min(fault.healed_s, gap["to_s"]))
                kind = fault.kind
        waits.setdefault(kind, []).append(gap["to_s"] - begin)
    return {kind: sorted(found) for kind, found in waits.items()}


def all_of(waits: dict[str, list[float]]) -> list[float]:
    """Return all waits, sorted."""
    return sorted(wait for found in waits.values() for wait in found)


def compare(fleet: Fleet, stuck: int) -> dict[str, Any]:
    """Compare the replies that the teams got with what is stored."""
    assert fleet.postgres
    stored = {row["run_id"]: row for row in fleet.postgres.rows("SELECT * FROM runs")}
    sessions = fleet.postgres.rows("SELECT session_id, team, status FROM sessions")
    events = fleet.events()
    results = [event for event in events if event["event"] == "result"]
    counted = [result for result in results if result["status"] in COUNTS]
    lost = wrong = 0
    for result in counted:
        row = stored.get(result["run_id"])
        if row is None or row["status"] not in (*COUNTS, "rejected"):
            lost += 1
            print(f"lost: {result} is {row and row['status']}")
        elif (row["score"], row["ticks"], row["state_hash"]) != tuple(
            result[key] for key in ("score", "ticks", "state_hash")
        ):
            wrong += 1
            print(f"another result: {result} is {row}")
    twice = [run for run, times in Counter(result["run_id"] for result in counted).items() if times > 1]
    numbers = Counter((row["team"], row["task"], row["k"]) for row in stored.values())
    twice += [str(number) for number, times in numbers.items() if times > 1]
    open_by_team = Counter(session["team"] for session in sessions if session["status"] == "open")
    several = [team for team, number in open_by_team.items() if number > 1]
    for what, found in (("twice", twice), ("several sessions", several)):
        if found:
            print(f"{what}: {found}")
    judged = (*COUNTS, "rejected")
    by_status = Counter(row["status"] for row in stored.values())
    for row in stored.values():
        if row["status"] == "rejected":
            print(f"rejected: {row['run_id']}: {row['verify_note']}")
    return {
        "acknowledged": len(counted),
        "acknowledged_lost": lost,
        "counted_twice": len(twice) + len(several),
        "stale_accepted": wrong,
        "rejected": by_status["rejected"],
        "stuck": stuck + by_status["open"] + by_status["provisional"],
        "runs": dict(by_status),
        "runs_cut": sum(not r["by_client"] and r["reason"] not in ENDS for r in counted),
        "unacknowledged": sum(row["status"] in judged for row in stored.values()) - len(counted) + lost,
        "errors": dict(Counter(event["code"] for event in events if event["event"] == "error")),
        "runs_lost": sum(event["event"] == "lost" for event in events),
    }


def verify_replays(fleet: Fleet) -> tuple[int, int]:
    """Let `palmares verify` play all replays of runs that count; return how many, and how many fail."""
    assert fleet.postgres
    query = "SELECT run_id, replay_path, replay_sha256 FROM runs WHERE status = 'verified'"

    def is_good(row: dict[str, Any]) -> bool:
        good = attempt(*verification(row))
        if not good:
            print(f"the replay of {row['run_id']} is not verified")
        return good

    def verification(row: dict[str, Any]) -> list[str]:
        """Return the command that verifies a replay on a host's disk, or the one in the object store."""
        local = _on_disk(fleet, row)
        if local is not None:
            return [str(fleet.program), "verify", str(local)]
        variables = [f"{name}={value}" for name, value in fleet.hosts[0].environment.items()]
        stored = f"s3://{BUCKET}/replays/{row['replay_sha256']}.mcap"
        return ["env", *variables, str(fleet.program), "verify", stored]

    rows = fleet.postgres.rows(query)
    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(is_good, rows))
    return len(outcomes), outcomes.count(False)


def _on_disk(fleet: Fleet, row: dict[str, Any]) -> Path | None:
    """Find a replay on the hosts' disks."""
    for host in fleet.hosts:
        path = host.data / str(row["replay_path"])
        # A host that has lost the run may have a part of it.
        if (
            row["replay_path"]
            and path.is_file()
            and sha256(path.read_bytes()).hexdigest() == row["replay_sha256"]
        ):
            return path
    return None


def objects(fleet: Fleet) -> int:
    """Return the number of objects in the store."""
    if fleet.store is None:
        return 0
    return request("GET", fleet.store.address, f"/{BUCKET}?list-type=2", timeout_s=10.0)[1].count("<Key>")
