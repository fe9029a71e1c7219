"""One version for the server, the wheel and the client."""

import tomllib
from pathlib import Path

import palmares


def test_the_version_is_that_of_the_workspace() -> None:
    manifest = tomllib.loads((Path(__file__).parents[2] / "Cargo.toml").read_text())
    assert palmares.__version__ == manifest["workspace"]["package"]["version"]
