"""Many worlds as a `VecEnv` of stable-baselines3, stepped by native threads. Needs ``pip install 'palmares[learn]'``.

>>> from stable_baselines3 import PPO                                        # doctest: +SKIP
... import palmares.sb3
... env = palmares.sb3.PalmaresVecEnv("grasp", "softhand", 64, shaping=True, max_episode_steps=100)
... PPO("MultiInputPolicy", env, device="cpu").learn(100_000)

It has the statistics of episodes of SB3's `VecMonitor`: wrap it with `VecNormalize` and the like, not with
`VecMonitor`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as missing:
    raise ImportError("palmares.sb3 needs stable-baselines3: pip install 'palmares[learn]'") from missing

from palmares.gym.batch import BatchEnv

Observations = dict[str, np.ndarray[Any, Any]] | np.ndarray[Any, Any]


class PalmaresVecEnv(VecEnv):  # type: ignore[misc]
    """A `BatchEnv` as stable-baselines3 has vector environments: runs that are over begin anew at once.

    ``infos`` have the entries of `BatchEnv` for one environment, at an episode's end also
    ``terminal_observation``, ``TimeLimit.truncated`` and ``episode`` (``r`` reward, ``l`` steps, ``t`` s).

    Args:
        task: Name of the task, or the path of your own.
        hand: Name of the hand, or the path of your own.
        num_envs: Number of environments.
        keys: Fields of the observation, all when left out: those that an actor may see.
        flat: One vector (n,) of float32 instead of a dictionary, in the order of the keys.
        options: Further arguments of `BatchEnv`.

    Attributes:
        env: The `BatchEnv`.

    Raises:
        ValueError: An unknown key, or an argument that `BatchEnv` refuses.

    """

    def __init__(
        self,
        task: str = "grasp",
        hand: str = "softhand",
        num_envs: int = 8,
        *,
        keys: Sequence[str] | None = None,
        flat: bool = False,
        **options: Any,
    ) -> None:
        self.env = BatchEnv(task, hand, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        known = self.env.single_observation_space
        assert isinstance(known, spaces.Dict)
        self._keys = list(known) if keys is None else list(keys)
        for key in self._keys:
            if key not in known.spaces:
                raise ValueError(f"keys: found {key!r}; wanted some of {', '.join(known)}")
        self._flat = flat
        shapes = {key: known[key].shape or () for key in self._keys}
        space: spaces.Space[Any]
        if flat:
            size = sum(int(np.prod(shape)) for shape in shapes.values())
            space = spaces.Box(-np.inf, np.inf, (size,), dtype=np.float32)
        else:
            boxes = {key: spaces.Box(-np.inf, np.inf, shape, dtype=np.float32) for key, shape in shapes.items()}
            space = spaces.Dict(boxes)
        actions = self.env.single_action_space
        assert isinstance(actions, spaces.Box)
        action_space = spaces.Box(-1.0, 1.0, actions.shape, dtype=np.float32)
        self._actions = np.zeros((num_envs, *actions.shape))
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, dtype=np.int64)
        self._begun = time.perf_counter()
        self.render_mode = None
        super().__init__(num_envs, space, action_space)

    def reset(self) -> Observations:
        """Open a run in every environment."""
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observations, infos = self.env.reset(seed=seeds)
        self.reset_infos = [{"seed": int(seed)} for seed in infos["seed"]]
        self._reset_seeds()
        self._reset_options()
        self._returns[:], self._lengths[:] = 0.0, 0
        return self._chosen(observations)

    def step_async(self, actions: np.ndarray[Any, Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = np.asarray(actions, dtype=np.float64)

    def step_wait(self) -> tuple[Observations, np.ndarray[Any, Any], np.ndarray[Any, Any], list[dict[str, Any]]]:
        """Advance every environment."""
        observations, rewards, terminated, truncated, told = self.env.step(self._actions)
        dones = terminated | truncated
        self._returns += rewards
        self._lengths += 1
        names = [name for name in told if not name.startswith("_") and not name.startswith("final_")]
        infos: list[dict[str, Any]] = []
        for k in range(self.num_envs):
            info = {name: told[name][k] for name in names if told[f"_{name}"][k]}
            if dones[k]:
                final = {name: values[None] for name, values in told["final_obs"][k].items()}
                chosen = self._chosen(final)
                info["terminal_observation"] = (
                    {key: values[0] for key, values in chosen.items()}
                    if isinstance(chosen, dict)
                    else chosen[0]
                )
                info["TimeLimit.truncated"] = bool(truncated[k] and not terminated[k])
                info["episode"] = {
                    "r": float(self._returns[k]),
                    "l": int(self._lengths[k]),
                    "t": round(time.perf_counter() - self._begun, 6),
                }
            infos.append(info)
        self._returns[dones], self._lengths[dones] = 0.0, 0
        return self._chosen(observations), rewards.astype(np.float32), dones, infos

    def _chosen(self, observations: dict[str, np.ndarray[Any, Any]]) -> Observations:
        """Return the fields of the keys as float32."""
        parts = {key: observations[key].astype(np.float32) for key in self._keys}
        if not self._flat:
            return parts
        return np.concatenate([part.reshape(len(part), -1) for part in parts.values()], axis=1)

    def close(self) -> None:
        """End it."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment: it is one for all."""
        target = self if attr_name == "render_mode" else self.env
        return [getattr(target, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute, such as ``fraction``, of all environments.

        Raises:
            ValueError: `indices` are not all of them.

        """
        if len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError(f"{attr_name}: the environments share it; leave indices out")
        self.env.set_attr(attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Call a method of `BatchEnv` once; return its result for each environment."""
        result = getattr(self.env, method_name)(*args, **kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return False for each environment."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> list[np.ndarray[Any, Any] | None]:
        """Return a picture of each world, (height, width, 3) of uint8."""
        return list(self.env.batch.pictures(self.env.film, self.env.film_size, "film")["film"])
