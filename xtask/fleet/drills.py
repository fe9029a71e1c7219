"""Two drills with one figure each: an upgrade of all hosts, and a host that is cut off from the database."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from fleet import judge
from fleet.faults import Fault
from fleet.fleet import Fleet
from fleet.services import DATABASE
from fleet.shell import until

# Longest pause of 99 of 100 clients in an upgrade, s, and the return of a host after its cut, s.
PAUSE_P99_S = 1.0
BACK_S = 2.0
# These must be zero in the end.
ZERO = ("acknowledged_lost", "counted_twice", "stale_accepted", "rejected", "stuck")
FINISH_S = 45.0
VERDICTS_S = 120.0


def finish(fleet: Fleet, faults: list[Fault]) -> dict[str, Any]:
    """Let the teams finish, wait for the verdicts, and compare."""
    stuck = fleet.stop_players(FINISH_S)
    judge.wait_for_verdicts(fleet, VERDICTS_S)
    report = judge.compare(fleet, stuck)
    waits = judge.all_of(judge.resume_times(fleet.events(), faults))
    report |= {
        "pauses": len(waits),
        "pause_p50_s": round(judge.quantile(waits, 0.5), 2),
        "pause_p99_s": round(judge.quantile(waits, 0.99), 2),
    }
    return report


def upgrade(
    folder: Path, program: Path, moto: Path | None, hosts: int, teams: int
) -> tuple[dict[str, Any], bool]:
    """End and start one host after another while teams play; no run may be lost."""
    with Fleet(folder, program, hosts, moto, teams) as fleet:
        fleet.play()
        time.sleep(3.0)
        ended = []
        for host in fleet.hosts:
            began = time.monotonic()
            status = host.terminate()
            ended.append(round(time.monotonic() - began, 2))
            print(f"{host.name} ended with status {status} after {ended[-1]} s", flush=True)
            host.begin()
            host.wait_until_ready()
            time.sleep(4.0)
        report = finish(fleet, [])
        # A host with another engine, while the competition is open.
        report |= {"ended_s": ended, "other_engine_refused": refuses_other_engine(fleet)}
    holds = (
        all(report[name] == 0 for name in (*ZERO, "runs_lost", "runs_cut", "unacknowledged"))
        and report["acknowledged"] > 0
    )
    holds = holds and report["pause_p99_s"] < PAUSE_P99_S and report["other_engine_refused"] is not False
    return report, holds


def refuses_other_engine(fleet: Fleet) -> bool | None:
    """Pin another engine in the database; return whether a host refuses to start, None if none is pinned."""
    assert fleet.postgres
    pinned = fleet.postgres.rows("SELECT key, value FROM settings WHERE key = 'engine'")
    if not pinned:
        return None
    host = fleet.hosts[-1]
    host.terminate()
    fleet.postgres.sql("UPDATE settings SET value = 'another' WHERE key = 'engine'")
    host.begin()
    assert host.process
    try:
        return host.process.wait(20.0) != 0
    except TimeoutError:
        return False


def partition(
    folder: Path, program: Path, moto: Path | None, hosts: int, teams: int, seconds: float
) -> tuple[dict[str, Any], bool]:
    """Cut a host from the database; its sessions go on elsewhere, and it is back soon after the heal."""
    with Fleet(folder, program, hosts, moto, teams) as fleet:
        fleet.play()
        time.sleep(3.0)
        host = fleet.hosts[0]
        began = time.monotonic()
        fleet.network.cut(host.name, DATABASE)
        until(lambda: not host.is_ready(), 30.0, "the host notices the cut")
        noticed = time.monotonic() - began
        time.sleep(max(0.0, seconds - noticed))
        fleet.network.heal(host.name, DATABASE)
        healed = time.monotonic()
        until(host.is_ready, 60.0, "the host is back", 0.05)
        back = time.monotonic() - healed
        time.sleep(5.0)
        report = finish(fleet, [Fault("cut_database", host.name, began, began)])
        report |= {"noticed_s": round(noticed, 2), "back_s": round(back, 2), "seconds": seconds}
    holds = all(report[name] == 0 for name in ZERO) and report["acknowledged"] > 0
    return report, holds and report["back_s"] <= BACK_S
