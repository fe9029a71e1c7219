"""Faults under load; in the end every acknowledged result is there, once, and verified."""

from __future__ import annotations

import random
import time
from collections import Counter
from pathlib import Path
from typing import Any

from fleet import judge
from fleet.faults import Fault, draw_fault
from fleet.fleet import Fleet

# A fault begins about every 4.3 s.
PERIOD_S = 4.3
# Waits after the last fault: for the teams' last runs, and for the verification of all runs.
FINISH_S = 45.0
VERDICTS_S = 120.0
# Bounds for more than one host: the wait of 99 of 100 clients, s, and the step back of an observation.
RESUMED_P99_S = 3.5
REWOUND_TICKS = 25


def chaos(
    folder: Path,
    program: Path,
    moto: Path | None,
    hosts: int,
    count: int,
    seed: int,
    teams: int,
    only: list[str],
) -> tuple[dict[str, Any], bool]:
    """Let `count` faults happen; return the report, and whether it holds."""
    draw = random.Random(seed)
    faults: list[Fault] = []
    with Fleet(folder, program, hosts, moto, teams) as fleet:
        fleet.play()
        print(f"{teams} teams play on {hosts} host{'s' * (hosts > 1)}", flush=True)
        began = time.monotonic()
        for number in range(count):
            fault = draw_fault(fleet, draw, only)
            faults.append(fault)
            for host in fleet.hosts:
                host.count()
            took = time.monotonic() - fault.began_s
            events = Counter(event["event"] for event in fleet.events())
            print(
                f"{number + 1:4} {fault.kind:17} {fault.host}  {took:4.1f} s  results {events['result']}, "
                f"lost {events['lost']}, gaps {events['gap']}, errors {events['error']}",
                flush=True,
            )
            for host in fleet.hosts:
                # A host that ended by itself, such as with a full disk: a service manager starts it again.
                if host.process is not None and host.process.poll() is not None:
                    print(f"     {host.name} had ended with status {host.process.returncode}", flush=True)
                    host.begin()
            time.sleep(max(0.3, PERIOD_S - (time.monotonic() - fault.began_s)) * draw.uniform(0.5, 1.0))
        lasted = time.monotonic() - began
        fleet.heal()
        for host in fleet.hosts:
            host.wait_until_ready()
        stuck = fleet.stop_players(FINISH_S)
        judge.wait_for_verdicts(fleet, VERDICTS_S)
        for host in fleet.hosts:
            host.count()
        report = judge.compare(fleet, stuck)
        verified, failed = judge.verify_replays(fleet)
        events_list = fleet.events()
        by_kind = judge.resume_times(events_list, faults)
        waits = judge.all_of(by_kind)
        rewound = [event["ticks"] for event in events_list if event["event"] == "rewound"]
        stale = sum(host.total().get("palmares_stale_writes_total", 0.0) for host in fleet.hosts)
        report |= {
            "stale_refused": int(stale),
            "verdicts_wrong": failed,
            "replays_verified": verified - failed,
            "gaps": len(waits),
            "resumed_p50_s": round(judge.quantile(waits, 0.5), 2),
            "resumed_p99_s": round(judge.quantile(waits, 0.99), 2),
            "resumed_max_s": round(waits[-1], 2) if waits else 0.0,
            "resumed_max_by_fault_s": {kind: round(found[-1], 2) for kind, found in by_kind.items()},
            "rewound_ticks_max": max(rewound, default=0),
            "objects": judge.objects(fleet),
            "hosts": hosts,
            "faults": dict(Counter(fault.kind for fault in faults)),
            "seed": seed,
            "lasted_s": round(lasted),
        }
    zero = ("acknowledged_lost", "counted_twice", "stale_accepted", "rejected", "stuck", "verdicts_wrong")
    holds = all(report[name] == 0 for name in zero) and report["acknowledged"] > 0
    if hosts > 1:
        holds = holds and report["resumed_p99_s"] < RESUMED_P99_S
        holds = holds and report["rewound_ticks_max"] <= REWOUND_TICKS
    return report, holds
