"""Tasks as `gymnasium` environments. Needs ``pip install 'palmares[gym]'``.

>>> import gymnasium, palmares.gym                                           # doctest: +SKIP
... env = gymnasium.make("palmares/Grasp-SoftHand-v1")                       # in this process
... env = gymnasium.make("palmares/Grasp-SoftHand-v1", url="http://127.0.0.1:8080")   # on a server
... envs = gymnasium.make_vec("palmares/Balls-SoftHand-v1", num_envs=64)     # on all cores

An id consists of a task (``Balls``, ``Shelf``, ``Grasp``, ``Pan``, ``Peg``) and a hand (``SoftHand``,
``ReFlex``, ``Pinch``); the arguments ``task`` and ``hand`` select others, also your own by their paths.
With ``palmares.gym:`` in front of an id, `gymnasium.make` imports this module itself.
"""

from typing import TYPE_CHECKING, Any

from palmares.gym.env import PalmaresEnv
from palmares.gym.fields import arrays_of
from palmares.gym.flat import FlatEnv
from palmares.gym.goals import Goal
from palmares.gym.hooks import Transition
from palmares.gym.ids import register
from palmares.gym.settings import Settings

if TYPE_CHECKING:
    from palmares.gym.batch import BatchEnv

__all__ = ["BatchEnv", "FlatEnv", "Goal", "PalmaresEnv", "Settings", "Transition", "arrays_of"]

register()


def __getattr__(name: str) -> Any:
    """Import `BatchEnv`, which needs the compiled part of the package, at its first use."""
    if name == "BatchEnv":
        from palmares.gym.batch import BatchEnv

        return BatchEnv
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
