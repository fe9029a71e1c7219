"""The client's version, said in the greeting."""

from importlib.metadata import version

VERSION = version("palmares")
