"""Evaluation and learning on many machines with Ray. Needs ``pip install 'palmares[ray]'``.

>>> import palmares.ray                                                      # doctest: +SKIP
... report = palmares.ray.evaluate("my_controller.py", "balls", "softhand", seeds=range(1, 1001))
... report = palmares.ray.rollouts(policy, "balls", "softhand", seeds=range(1, 1001))
... actors = palmares.ray.batches(8, "balls", "softhand", worlds=32)
... palmares.ray.register_envs()                                             # for RLlib

Ray places the runs, handles lost machines and limits resources; its options are passed on unchanged. A run
depends on its seed alone, so that a report is the same for any number of workers and lost machines.
"""

from typing import TYPE_CHECKING, Any

try:
    import ray  # noqa: F401 - Ray, not this package
except ImportError as missing:
    raise ImportError("palmares.ray needs Ray: pip install 'palmares[ray]'") from missing

from palmares.ray.envs import register_envs
from palmares.ray.runs import calls, evaluate, pool

if TYPE_CHECKING:
    from palmares.ray.worlds import batches, rollouts

__all__ = ["batches", "calls", "evaluate", "pool", "register_envs", "rollouts"]


def __getattr__(name: str) -> Any:
    """Import `batches` and `rollouts`, which need the compiled part of the package, at first use."""
    if name in ("batches", "rollouts"):
        from palmares.ray import worlds

        return getattr(worlds, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
