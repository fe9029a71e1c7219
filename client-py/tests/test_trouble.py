"""Broken connections, killed servers, slow controllers: the client against the real server."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import palmares
from tests.real_server import RealServer, needs_server

pytestmark = needs_server


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with RealServer(tmp_path_factory.mktemp("data")) as server:
        yield server.url


@pytest.fixture(scope="module")
def thinker(url: str) -> Iterator[tuple[palmares.Client, palmares.Observation, float]]:
    """Yield a client that sends nothing while the other tests of this file run."""
    with palmares.Client(url, team="thinker") as client:
        client.reset("balls", "softhand", seed=2)
        yield client, client.step(), time.monotonic()


@pytest.mark.usefixtures("thinker")
def test_two_pulled_cables_in_a_run(url: str) -> None:
    with palmares.Client(url) as client:
        run_id = client.reset("balls", "softhand", seed=3).run_id
        ticks = [client.step(repeat=5).tick]
        for _ in range(2):
            client._link.abort()
            ticks.append(client.step(hand=[0.1]).tick)
        assert ticks == [5, 6, 7]
        result = client.stop()
        assert (result.run_id, result.ticks, result.reason) == (run_id, 7, "stopped")


def test_a_cable_pulled_while_the_world_computes(url: str) -> None:
    with palmares.Client(url) as client:
        run_id = client.reset("balls", "softhand", seed=3).run_id
        threading.Timer(0.005, client._link.abort).start()
        obs = client.step(hand=[0.2], repeat=100)
        # The step was made but its observation was lost, so one more tick; or the reply came just in time.
        assert obs.tick in (100, 101)
        assert obs.run_id == run_id
        assert obs.applied_action.hand == [0.2]
        client.stop()


def test_the_address_of_a_page_is_refused_with_the_right_one(url: str) -> None:
    wanted = f"nothing at /live/v1/control; give the address that `palmares serve` prints, such as {url}$"
    with pytest.raises(palmares.NoServerError, match=wanted):
        palmares.Client(f"{url}/live")


def test_a_killed_server_is_come_back_to(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server, palmares.Client(server.url) as client:
        client.reset("balls", "softhand", seed=4)
        client.step(repeat=3)
        server.kill()
        threading.Timer(0.5, server.start).start()
        with pytest.raises(palmares.RunLostError, match=r"open another with reset"):
            client.step()
        assert client.reset("balls", "softhand", seed=4).tick == 0
        client.step()
        assert client.stop().ticks == 1


def test_a_server_that_stays_away_is_given_up(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server:
        client = palmares.Client(server.url, reconnect_s=1.0)
        client.reset("balls", "softhand", seed=4)
        server.kill()
        began = time.monotonic()
        with pytest.raises(palmares.ConnectionLostError, match="did not come back within 1 s"):
            client.step()
        assert time.monotonic() - began >= 0.5
        client.close()
        server.start()


def test_a_controller_that_thinks_for_long_keeps_its_connection(
    thinker: tuple[palmares.Client, palmares.Observation, float],
) -> None:
    client, obs, since = thinker
    before = client._link._transport
    # Longer than the server keeps a silent connection.
    assert client.welcome.limits.ping_timeout_s is not None
    pause_s = client.welcome.limits.ping_timeout_s + 3.0
    time.sleep(max(0.0, pause_s - (time.monotonic() - since)))
    assert client.step().tick == obs.tick + 1
    assert client._link._transport is before
    client.stop()
