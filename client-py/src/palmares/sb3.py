"""Many worlds as a `VecEnv` of stable-baselines3. Needs ``pip install 'palmares[learn]'``.

>>> from stable_baselines3 import PPO                                        # doctest: +SKIP
... import palmares.sb3
... env = palmares.sb3.PalmaresVecEnv("grasp", "softhand", 64, shaping=True, max_episode_steps=100)
... PPO("MultiInputPolicy", env, device="cpu").learn(100_000)

It has the statistics of episodes of SB3's `VecMonitor`: wrap it with `VecNormalize` and the like, not with
`VecMonitor`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as missing:
    raise ImportError("palmares.sb3 needs stable-baselines3: pip install 'palmares[learn]'") from missing

from palmares.gym.batch import BatchEnv
from palmares.gym.infos import refuse_options, row_of

Observations = dict[str, NDArray[Any]] | NDArray[Any]


class PalmaresVecEnv(VecEnv):  # type: ignore[misc]
    """A `BatchEnv` as stable-baselines3 has vector environments: runs that are over begin anew at once.

    Numbers of an observation are float32, colours uint8. ``infos`` have the entries of `BatchEnv` for one
    environment, at an episode's end also ``terminal_observation``, ``TimeLimit.truncated`` and ``episode``
    (``r`` reward, ``l`` steps, ``t`` s).

    Args:
        task: Name of the task, or the path of your own.
        hand: Name of the hand, or the path of your own.
        num_envs: Number of environments.
        keys: Fields of the observation, all when left out.
        flat: One vector (n,) of float32 instead of a dictionary, in the order of the keys.
        info_keywords: Entries of the last info of an episode that ``episode`` has, too, as those of
            ``VecMonitor``: with ``("score",)`` ``model.ep_info_buffer`` has the scores.
        options: Further arguments of `BatchEnv`, such as ``shaping``, ``observations`` and
            ``max_episode_steps``.

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
        info_keywords: Sequence[str] = (),
        **options: Any,
    ) -> None:
        self.env = BatchEnv(task, hand, num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        known = self.env.single_observation_space
        assert isinstance(known, spaces.Dict)
        self._keys = list(known) if keys is None else list(keys)
        for key in self._keys:
            if key not in known.spaces:
                raise ValueError(f"keys: found {key!r}; wanted some of {', '.join(known)}")
        self._flat, self._info_keywords = flat, tuple(info_keywords)
        boxes = {key: _single_precision(known[key]) for key in self._keys}
        space: spaces.Space[Any] = spaces.Dict(boxes)
        if flat:
            size = sum(math.prod(box.shape or ()) for box in boxes.values())
            space = spaces.Box(-np.inf, np.inf, (size,), dtype=np.float32)
        actions = self.env.single_action_space
        assert isinstance(actions, spaces.Box)
        action_space = spaces.Box(-1.0, 1.0, actions.shape, dtype=np.float32)
        self._actions = np.zeros((num_envs, *actions.shape))
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, dtype=np.int64)
        self._begun = time.perf_counter()
        super().__init__(num_envs, space, action_space)

    def reset(self) -> Observations:
        """Open a run in every environment.

        ``set_options`` takes ``parameters``: numbers given for these runs rather than drawn, as of
        `palmares.gym.PalmaresEnv.reset`, for all environments or, in a list, for each; and ``state``:
        recorded states for these runs and all later ones, the same for all environments.

        Raises:
            ValueError: Another option, a parameter that is invalid or that some environments lack, or states
                that do not fit or differ between environments.

        """
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observations, infos = self.env.reset(seed=seeds, options=self._given())
        self.reset_infos = [row_of(infos, k) for k in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        self._returns[:], self._lengths[:] = 0.0, 0
        return self._chosen(observations)

    def _given(self) -> dict[str, Any] | None:
        """Return the options of `set_options` as `BatchEnv` has them."""
        for options in self._options:
            refuse_options(options, ("parameters", "state"))
        states = [options for options in self._options if options and "state" in options]
        if states and (
            len(states) < self.num_envs or any(it["state"] is not states[0]["state"] for it in states)
        ):
            raise ValueError("state: found another for some environments; wanted one dictionary for all")
        rows = [(options or {}).get("parameters") or {} for options in self._options]
        names = {name for row in rows for name in row}
        for name in names:
            if missing := [k for k, row in enumerate(rows) if name not in row]:
                raise ValueError(
                    f"parameters: found no {name!r} for environments {missing}; wanted it for all"
                )
        given = {name: np.stack(np.broadcast_arrays(*(row[name] for row in rows))) for name in sorted(names)}
        chosen = {"parameters": given} if given else {}
        return (chosen | ({"state": states[0]["state"]} if states else {})) or None

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = np.asarray(actions, dtype=np.float64)

    def step_wait(self) -> tuple[Observations, NDArray[Any], NDArray[Any], list[dict[str, Any]]]:
        """Advance every environment."""
        observations, rewards, terminated, truncated, info = self.env.step(self._actions)
        dones = terminated | truncated
        self._returns += rewards
        self._lengths += 1
        ends = {name: info.pop(name) for name in ("final_obs", "final_info") if name in info}
        infos = [row_of(info, k) for k in range(self.num_envs)]
        for k in np.flatnonzero(dones):
            last = self._chosen({name: values[None] for name, values in ends["final_obs"][k].items()})
            infos[k] |= {
                "terminal_observation": {key: values[0] for key, values in last.items()}
                if isinstance(last, dict)
                else last[0],
                "TimeLimit.truncated": bool(truncated[k] and not terminated[k]),
                "episode": {
                    "r": float(self._returns[k]),
                    "l": int(self._lengths[k]),
                    "t": round(time.perf_counter() - self._begun, 6),
                }
                | self._of_keywords(infos[k]),
            }
        self._returns[dones], self._lengths[dones] = 0.0, 0
        return self._chosen(observations), rewards.astype(np.float32), dones, infos

    def _of_keywords(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return the entries of an info that the statistics of its episode have."""
        for name in self._info_keywords:
            if name not in info:
                raise ValueError(f"info_keywords: found {name!r}; wanted some of {', '.join(info)}")
        return {name: info[name] for name in self._info_keywords}

    def _chosen(self, observations: dict[str, NDArray[Any]]) -> Observations:
        """Return the fields of the keys."""
        parts = {key: observations[key] for key in self._keys}
        if not self._flat:
            return {
                key: part if part.dtype == np.uint8 else part.astype(np.float32)
                for key, part in parts.items()
            }
        flat = [part.reshape(len(part), -1) for part in parts.values()]
        return np.concatenate(flat, axis=1).astype(np.float32)

    def close(self) -> None:
        """End it."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment: it is one for all."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute, such as ``fraction``, of all environments.

        Raises:
            AttributeError: There is no such attribute.
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
        """Return whether each environment has a wrapper of gymnasium: only ``Monitor``, in effect.

        So `evaluate_policy` takes the statistics of episodes that it has itself, without a warning.
        """
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def get_images(self) -> list[NDArray[Any] | None]:
        """Return a picture of each world, (height, width, 3) of uint8; needs ``render_mode="rgb_array"``."""
        return list(self.env.render() or [None] * self.num_envs)


def _single_precision(box: spaces.Space[Any]) -> spaces.Space[Any]:
    """Return the space of an observation's field."""
    assert isinstance(box, spaces.Box)
    return box if box.dtype == np.uint8 else spaces.Box(-np.inf, np.inf, box.shape, dtype=np.float32)
