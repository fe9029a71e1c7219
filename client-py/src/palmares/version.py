"""The client's version, which `hello` sends to the server."""

from importlib.metadata import version

VERSION = version("palmares")
