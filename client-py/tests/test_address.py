"""Addresses of a server, as `palmares serve` and the pages show them."""

from __future__ import annotations

from pathlib import Path

import pytest

import palmares
from palmares.net.address import addresses
from tests.real_server import RealServer, needs_server


@pytest.mark.parametrize(
    "url",
    [
        "cup.example:8080",
        "http://cup.example:8080/",
        "ws://cup.example:8080/v1/control",
        "ws://cup.example:8080/v1/control/",
        "ws://cup.example:8080/v1/watch",
    ],
)
def test_every_address_of_a_server_leads_to_it(url: str) -> None:
    found = addresses(url)
    assert found.http == "http://cup.example:8080"
    assert found.control == "ws://cup.example:8080/v1/control"
    assert found.watch == "ws://cup.example:8080/v1/watch"


def test_a_server_below_a_path_and_with_tls() -> None:
    found = addresses("wss://cup.example/hands/v1/control")
    assert (found.http, found.control) == ("https://cup.example/hands", "wss://cup.example/hands/v1/control")


@pytest.mark.parametrize("url", ["ftp://cup.example", "http://", "/v1/control"])
def test_other_addresses_are_refused(url: str) -> None:
    with pytest.raises(ValueError, match="is not the address of a server"):
        addresses(url)


@needs_server
def test_a_client_takes_the_address_that_the_server_prints(tmp_path: Path) -> None:
    with RealServer(tmp_path) as server:
        printed = server.url.replace("http://", "ws://") + "/v1/control"
        with palmares.Client(printed, team="crabs") as client:
            assert client.reset("grasp", "softhand", seed=1).tick == 0
