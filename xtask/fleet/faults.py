"""The faults, drawn by a seed."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from fleet.fleet import Fleet
from fleet.host import Host
from fleet.services import DATABASE, PROXY, STORE, freeze


@dataclass
class Fault:
    """A fault that happened; nobody can serve between `began_s` and `healed_s`."""

    kind: str
    host: str
    began_s: float
    healed_s: float


Happen = Callable[[Fleet, Host, random.Random], None]


def kill(fleet: Fleet, host: Host, draw: random.Random) -> None:
    """Kill a host, and start it again after a moment."""
    host.kill()
    time.sleep(draw.uniform(0.2, 1.5))
    host.begin()
    # A single host is the service.
    host.wait_until_ready() if len(fleet.hosts) == 1 else threading.Event().wait(1.0)


def stop(_fleet: Fleet, host: Host, draw: random.Random) -> None:
    """Stop a host for longer than its lease, or shorter."""
    host.freeze(draw.uniform(2.3, 4.5))


def cut_database(fleet: Fleet, host: Host, draw: random.Random) -> None:
    """Cut a host from the database."""
    fleet.network.cut(host.name, DATABASE)
    time.sleep(draw.uniform(1.0, 5.0))
    fleet.network.heal(host.name, DATABASE)


def cut_clients(fleet: Fleet, host: Host, draw: random.Random) -> None:
    """Cut a host from the proxy."""
    fleet.network.cut(host.name, PROXY)
    time.sleep(draw.uniform(1.0, 5.0))
    fleet.network.heal(host.name, PROXY)


def database_restart(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Stop the database in order, and start it again."""
    assert fleet.postgres
    fleet.postgres.end("fast")
    time.sleep(draw.uniform(0.0, 3.0))
    fleet.postgres.begin()


def database_crash(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Let the database crash, and start it again."""
    assert fleet.postgres
    fleet.postgres.end("immediate")
    time.sleep(draw.uniform(0.0, 3.0))
    fleet.postgres.begin()


def database_stop(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Cut the database from every host: nothing is refused, all is silent."""
    for host in fleet.hosts:
        fleet.network.cut(host.name, DATABASE)
    time.sleep(draw.uniform(1.0, 4.0))
    for host in fleet.hosts:
        fleet.network.heal(host.name, DATABASE)


def store_away(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Cut the object store from every host."""
    for host in fleet.hosts:
        fleet.network.cut(STORE, host.name)
    time.sleep(draw.uniform(2.0, 6.0))
    for host in fleet.hosts:
        fleet.network.heal(STORE, host.name)


def store_stop(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Stop the object store: it accepts connections and does not answer."""
    assert fleet.store
    freeze(fleet.store.process, draw.uniform(2.0, 4.0))


def disk_full(_fleet: Fleet, host: Host, draw: random.Random) -> None:
    """Fill the disk of a host."""
    host.fill_disk(draw.uniform(1.0, 3.0))


def proxy_restart(fleet: Fleet, _host: Host, draw: random.Random) -> None:
    """Kill the proxy, and start it again."""
    assert fleet.proxy
    fleet.proxy.kill()
    time.sleep(draw.uniform(0.0, 1.0))
    fleet.proxy.begin()


# Kind, weight, whether it needs an object store, whether clients are without service until it is healed.
KINDS: dict[str, tuple[Happen, int, bool, bool]] = {
    "kill": (kill, 6, False, False),
    "stop": (stop, 6, False, False),
    "cut_database": (cut_database, 5, False, False),
    "cut_clients": (cut_clients, 4, False, False),
    "database_restart": (database_restart, 3, False, True),
    "database_crash": (database_crash, 3, False, True),
    "database_silent": (database_stop, 2, False, True),
    "store_away": (store_away, 2, True, False),
    "store_silent": (store_stop, 1, True, False),
    "disk_full": (disk_full, 2, False, False),
    "proxy_restart": (proxy_restart, 2, False, True),
}


def draw_fault(fleet: Fleet, draw: random.Random, only: list[str]) -> Fault:
    """Let a random fault happen and end."""
    single = len(fleet.hosts) == 1
    possible = [kind for kind, (_, _, store, _) in KINDS.items() if fleet.store or not store]
    possible = [kind for kind in possible if not only or kind in only]
    kind = draw.choices(possible, [KINDS[k][1] for k in possible])[0]
    host = draw.choice(fleet.hosts)
    happen, _, _, outage = KINDS[kind]
    began = time.monotonic()
    happen(fleet, host, draw)
    healed = time.monotonic()
    # Elsewhere there is service at once.
    return Fault(kind, host.name, began, healed if outage or single else began)
