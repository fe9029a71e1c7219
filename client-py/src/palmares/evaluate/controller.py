"""Loading of controllers from files and modules."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any


class ControllerError(Exception):
    """The controller cannot be loaded or played."""


@contextlib.contextmanager
def loaded(controller: str) -> Iterator[Callable[..., Any]]:
    """Give the function `run` of a controller, for the duration of the context.

    A file is read again every time, with the modules in its folder, which it can import as when Python runs
    it. Afterwards they are unloaded, so that nothing is left for the next run or for another controller with
    modules of the same names. A module given by its name is imported as usual.

    Args:
        controller: A Python file, or the name of a module.

    Raises:
        ControllerError: The file does not exist, or has no function `run`.

    """
    if not is_file(controller):
        yield _run_of(controller, importlib.import_module(controller))
        return
    path = Path(controller).resolve()
    if not path.is_file():
        raise ControllerError(f"{controller}: no such file")
    folder, known = str(path.parent), set(sys.modules)
    sys.path.insert(0, folder)
    try:
        # A controller named like a loaded module, such as `random.py`, gets another name.
        name = path.stem if path.stem not in known else f"controller_{path.stem}"
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            raise ControllerError(f"{controller}: not a Python file")
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        yield _run_of(controller, module)
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(folder)
        for name in beside(path.parent, known):
            del sys.modules[name]


def is_file(controller: str) -> bool:
    """Return whether the controller is a file, and not the name of a module."""
    return controller.endswith(".py") or os.sep in controller or Path(controller).is_file()


def beside(folder: Path, known: set[str]) -> list[str]:
    """Return the names of the modules imported from a folder or its packages, without the `known` ones."""
    found = []
    for name in [name for name in sys.modules if name not in known]:
        top = name.split(".")[0]
        if top not in known and _home(sys.modules.get(top)) == folder:
            found.append(name)
    return found


def parameters(controller: str) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of the controller's `run`, by their names.

    Raises:
        ControllerError: It cannot be loaded, or has no function `run`.

    """
    try:
        with loaded(controller) as run:
            signature = inspect.signature(run)
            _check(controller, signature)
            return signature.parameters
    except ControllerError:
        raise
    except (Exception, SystemExit) as error:
        raise ControllerError(f"{controller}: {type(error).__name__}: {error}") from error


def _check(controller: str, signature: inspect.Signature) -> None:
    """Refuse a `run` with parameters that the evaluation does not pass."""
    passed = {word: "" for word in ("task", "hand") if word in signature.parameters}
    try:
        signature.bind(None, 0, **passed)
    except TypeError as wrong:
        raise ControllerError(
            f"{controller}: its function is `run{signature}`; wanted `run(client, seed)`, which may have "
            f"parameters `task` and `hand` as well ({wrong})"
        ) from None


def _run_of(controller: str, module: ModuleType) -> Callable[..., Any]:
    run = getattr(module, "run", None)
    if not callable(run):
        raise ControllerError(f"{controller}: has no function `run(client, seed)`")
    return run  # type: ignore[no-any-return]


def _home(module: ModuleType | None) -> Path | None:
    """Return the folder of a module or package."""
    file = getattr(module, "__file__", None)
    if file is not None:
        path = Path(file).resolve()
        return path.parent.parent if path.stem == "__init__" else path.parent
    folders = list(getattr(module, "__path__", []))  # A package without an __init__.py.
    return Path(folders[0]).resolve().parent if folders else None
