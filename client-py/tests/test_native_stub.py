"""The stub of the compiled part names what is in it, with as many arguments."""

from __future__ import annotations

import ast
from inspect import getattr_static
from pathlib import Path
from typing import Any

from palmares import _native, sim

STUB = ast.parse(Path(sim.__file__).with_name("..").joinpath("_native.pyi").read_text())
Found = dict[str, int | None]


def declared(body: list[ast.stmt], prefix: str = "") -> Found:
    """Return the number of arguments of each name of the stub; None where it is any, or for a value."""
    found: Found = {}
    for node in body:
        if isinstance(node, ast.ClassDef):
            found |= declared(node.body, f"{node.name}.")
        elif isinstance(node, ast.FunctionDef):
            given = node.args
            count = len(given.posonlyargs) + len(given.args) - (prefix != "")
            found[prefix + node.name] = None if given.vararg else count
        elif isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation) != "TypeAlias":
            found[prefix + ast.unparse(node.target)] = None
    return found


def compiled(of: Any, prefix: str = "") -> Found:
    """Return the same of what was compiled."""
    found: Found = {}
    for name in vars(of):
        value = getattr_static(of, name)
        if isinstance(value, type):
            found |= compiled(value, f"{name}.") | {f"{name}.__init__": arguments(value)}
        elif not name.startswith("__") or name == "__bytes__":
            found[prefix + name] = arguments(value)
    return found


def arguments(of: Any) -> int | None:
    signature = getattr(of, "__text_signature__", None)
    if signature is None:
        return None
    return len([name for name in signature.strip("()").split(", ") if name not in ("", "/", "$self")])


def test_the_stub_has_every_name_and_its_arguments() -> None:
    stub, module = declared(STUB.body), compiled(_native)
    assert len(module) > 100
    assert stub.keys() == module.keys()
    assert {name: count for name, count in stub.items() if count not in (None, module[name])} == {}
