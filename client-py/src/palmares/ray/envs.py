"""The environments of `palmares.gym` for RLlib."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import gymnasium


def register_envs() -> list[str]:
    """Register every task and hand with RLlib and Tune, under the ids of gymnasium; return the ids.

    >>> palmares.ray.register_envs()                                      # doctest: +SKIP
    ... config = PPOConfig().environment("palmares/Grasp-SoftHand-v1", env_config={"ticks": 20})

    RLlib's own models need one vector: an observation is the fields of `palmares.gym.FlatEnv` in the order of
    their names. With ``"flatten": False`` in `env_config` it is the dictionary. All other entries of
    `env_config` are arguments of `FlatEnv`, such as ``sensing`` and ``ticks``.

    Raises:
        ImportError: gymnasium or Ray Tune is missing.

    """
    from palmares.gym.ids import names

    try:
        from ray.tune.registry import register_env
    except ImportError as missing:
        raise ImportError(f"register_envs needs Tune: pip install 'ray[tune]' ({missing})") from missing
    for name, kind in names().items():
        register_env(name, functools.partial(make, kind))
    return list(names())


def make(kind: dict[str, str], config: dict[str, Any]) -> gymnasium.Env[Any, Any]:
    """Return an environment of a task and a hand, configured by RLlib's `env_config`."""
    from gymnasium.wrappers import FlattenObservation

    from palmares.gym import FlatEnv

    options = dict(config)
    flatten = options.pop("flatten", True)
    env = FlatEnv(**kind | options)
    return FlattenObservation(env) if flatten else env
