"""Many episodes at once, on all cores, in this process."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from palmares.arguments import MAX_COUNT, MAX_SEED, mask_of, table, whole
from palmares.arrays import Array
from palmares.clipping import Clipping
from palmares.gym.ends import refuse_options
from palmares.gym.fields import Arrays, box, cameras_of, depth_space
from palmares.gym.training import Shaping, shaping_of, training_of
from palmares.net.requests import names
from palmares.sim import HANDS, TASKS, Batch, View, welcome
from palmares.sim.pictures import FILM


class BatchEnv(VectorEnv[Arrays, Array, Array]):
    """`num_envs` runs of one task and hand as a vector environment, stepped by native threads.

    Actions are (num_envs, 6 + motors) in [−1, 1], as those of `FlatEnv`. Observations and rewards are those
    of `PalmaresEnv` with a fixed number of objects, for each field an array (num_envs, …). The seed, *i* and
    *k* alone determine the scene of episode *k* of environment *i*, so that a training does not depend on the
    number of threads or on the ends of other episodes.

    ``infos`` of a step have the entries of `PalmaresEnv`: ``tick``, ``score``, ``is_success`` (num_envs,),
    ``events``, a list for each, and ``result`` for each run that is over; ``fault`` and ``note`` in it are of
    a failed world, as in `Batch.result`. With ``autoreset_mode=AutoresetMode.SAME_STEP`` they also have
    ``final_obs`` and ``final_info``, and with `shaping` ``shaping`` (num_envs,), the shaped part of the
    rewards. Where `randomise` draws the hand, infos of steps
    and resets have ``hand_drawn`` (num_envs, numbers), for a privileged critic: `Batch.hand_drawn`.

    Args:
        task: Name of the task.
        hand: Name of the hand.
        num_envs: Number of environments.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``.
        ticks: Ticks per step.
        threads: Threads that step; one for each core when left out.
        shaping: ``True`` adds the shaped part of the task's rewards to the reward and puts it into
            ``info["shaping"]``; ``"info"`` only puts it there. See docs/training.md, also for the next three.
        discount: γ of the learner; that of the task when left out.
        randomise: Quantities drawn for every episode: ``True`` for all, or names out of
            `palmares.training.QUANTITIES`, ``hand`` and ``hand_NAME``.
        fraction: Part of the task's objects in the scene; can be set between episodes.
        max_episode_steps: Steps after which an episode is truncated, as by gymnasium's `TimeLimit`; the
            task's time limit alone when left out.
        render_mode: With ``rgb_array`` `render` returns a picture of each environment.
        film: The camera that takes them: a camera of task or hand, a `palmares.sim.View`, or ``film``, a
            place from which fingers and objects of the first environment are seen.
        film_size: Their width and height.
        autoreset_mode: The call that resets a run that is over: the next step (``NEXT_STEP``), the same step
            (``SAME_STEP``), or ``reset(options={"reset_mask": …})`` (``DISABLED``).
        cameras: Names of cameras whose depth is part of every observation: ``depth.NAME`` (num_envs, height,
            width), as of `PalmaresEnv`.
        single: Arguments of a single environment, such as ``url``: a `TypeError` here.

    Attributes:
        batch: The worlds, for snapshots and state hashes.

    """

    def __init__(
        self,
        task: str = "balls",
        hand: str = "softhand",
        num_envs: int = 1,
        *,
        sensing: Literal["sensors", "truth"] = "truth",
        noise: Literal["none", "real"] = "none",
        cameras: Sequence[str] = (),
        ticks: int = 10,
        threads: int | None = None,
        shaping: Shaping | Literal["apart"] = False,
        discount: float | None = None,
        randomise: bool | Sequence[str] = False,
        fraction: float = 1.0,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        film: str | View = FILM,
        film_size: tuple[int, int] = (320, 240),
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **single: Any,
    ) -> None:
        if single:
            raise TypeError(
                f"a vector environment has no {', '.join(single)}; a server and another number of "
                "objects need a single environment, of gymnasium.make"
            )
        shaping = shaping_of(shaping)
        training = training_of(shaping, discount, randomise, fraction)
        self.batch = Batch(
            task, hand, num_envs, sensing=sensing, noise=noise, threads=threads, training=training
        )
        self._shaping = shaping
        # The action space is a box; its corners exceed the limits of the norm.
        self.batch.clipping.mute()
        self._clipping = Clipping()
        self.num_envs, self._ticks = self.batch.count, whole("ticks", ticks, 1, MAX_COUNT)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: found {render_mode!r}; wanted None or 'rgb_array'")
        self.render_mode, self.film, self.film_size = render_mode, film, film_size
        self.metadata = {
            "autoreset_mode": self.autoreset_mode,
            "render_modes": ["rgb_array"],
            "render_fps": round(1.0 / (self._ticks * self.batch.tick_s)),
        }
        self._cameras = tuple(names(cameras))
        found: dict[str, spaces.Space[Any]] = {name: box(*shape) for name, shape in self.batch.fields.items()}
        if self._cameras:
            own_hands, own_tasks = [] if hand in HANDS else [hand], [] if task in TASKS else [task]
            known = welcome(own_hands=own_hands, own_tasks=own_tasks)
            there = cameras_of(
                known.task(task) if task in TASKS else known.tasks[-1],
                known.hand(hand) if hand in HANDS else known.hands[-1],
            )
            found |= {f"depth.{name}": depth_space(there, name) for name in self._cameras}
        self.single_observation_space = spaces.Dict(found)
        length = self.batch.action_len
        self.single_action_space = spaces.Box(-1.0, 1.0, (length,), dtype=np.float64)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        specs = welcome().specs
        limits = [specs.action_field(name).range[1] for name in ("base.linear", "base.angular")]
        self._scale = np.concatenate([np.repeat(limits, 3), np.full(length - 6, 0.5)])
        self._shift = np.concatenate([np.zeros(6), np.full(length - 6, 0.5)])
        self._roots = np.zeros(num_envs, dtype=np.uint64)
        self._episodes = np.zeros(num_envs, dtype=np.uint64)
        self._over = np.zeros(num_envs, dtype=bool)
        most = max_episode_steps
        self._most_steps = None if most is None else whole("max_episode_steps", most, 1, MAX_COUNT)
        self._steps = np.zeros(num_envs, dtype=np.int64)

    @property
    def fraction(self) -> float:
        """Part of the task's objects in the scene; a new value holds for later episodes."""
        return self.batch.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self.batch.fraction = fraction

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Arrays, dict[str, Any]]:
        """Open a run in every environment, or in those of ``options["reset_mask"]`` (num_envs,).

        Args:
            seed: One seed, to which each environment adds its index, or one for each: it selects the scene,
                and determines those of later episodes. Left out, each environment goes to its next episode.
            options: Only ``reset_mask``.

        Raises:
            ValueError: A seed, the mask or an option is invalid; nothing has changed.

        """
        refuse_options(options, ("reset_mask",))
        mask = np.ones(self.num_envs, dtype=bool)
        if options and "reset_mask" in options:
            mask = mask_of("reset_mask", options["reset_mask"], self.num_envs)
        if seed is None and not self.batch.opened:
            drawn = np.random.SeedSequence().generate_state(1, np.uint64)[0] >> np.uint64(12)
            seed = int(drawn)
        if seed is not None and (isinstance(seed, str) or not isinstance(seed, Iterable)):
            first = whole("seed", seed, 0, MAX_SEED)
            seed = [first + k for k in range(self.num_envs)]
        given = [None] * self.num_envs if seed is None else list(seed)
        if len(given) != self.num_envs:
            raise ValueError(f"seed: found {len(given)}; wanted one, or one for each of {self.num_envs}")
        chosen = [self._next(k, given[k]) if mask[k] else 0 for k in range(self.num_envs)]
        observations = self._with_depths(self.batch.reset(chosen, mask))
        self._over[mask], self._steps[mask] = False, 0
        return observations, {"seed": np.array(self.batch.seeds), "_seed": mask} | self._privileged()

    def _with_depths(self, observations: Arrays) -> Arrays:
        """Return the observations with the images of the cameras."""
        if self._cameras:
            depths = self.batch.depths(self._cameras)
            observations |= {f"depth.{name}": depths[name] for name in self._cameras}
        return observations

    def _privileged(self) -> dict[str, Any]:
        """Return what a critic may know and sensors do not."""
        if not self.batch.hand_numbers:
            return {}
        return {"hand_drawn": self.batch.hand_drawn, "_hand_drawn": np.ones(self.num_envs, dtype=bool)}

    def _next(self, k: int, seed: int | None) -> int:
        """Return the seed of the next scene of environment `k`."""
        if seed is not None:
            self._roots[k], self._episodes[k] = whole(f"seed[{k}]", seed, 0, MAX_SEED), 0
            return int(seed)
        self._episodes[k] += np.uint64(1)
        mixed = np.random.SeedSequence([int(self._roots[k]), k, int(self._episodes[k])])
        return int(mixed.generate_state(1, np.uint64)[0] >> np.uint64(11))

    def step(
        self, actions: Array
    ) -> tuple[Arrays, Array, np.ndarray[Any, Any], np.ndarray[Any, Any], dict[str, Any]]:
        """Advance every environment by `ticks`."""
        if not self.batch.opened:
            raise RuntimeError("no runs are open; call reset() first")
        actions = table("actions", actions, self.num_envs, self.batch.action_len)
        self._clipping.check_unit(actions, stacklevel=2)
        scaled = actions * self._scale + self._shift
        ended = self._over.copy()
        if self.autoreset_mode is AutoresetMode.DISABLED and ended.any():
            which = ", ".join(map(str, np.flatnonzero(ended)))
            raise RuntimeError(f"the runs of {which} are over: reset(options={{'reset_mask': …}}) first")
        if ended.any():  # NEXT_STEP: they are only reset in this step.
            self.batch.reset([self._next(k, None) if ended[k] else 0 for k in range(self.num_envs)], ended)
        stepped = self.batch.step(scaled, self._ticks, ~ended)
        rewards, terminated, truncated = stepped.rewards, stepped.terminated, stepped.truncated
        rewards[ended] = 0.0
        observations = self._with_depths(stepped.observations)
        self._steps = np.where(ended, 0, self._steps + 1)
        finished = terminated | truncated
        if self._most_steps is not None:
            truncated = truncated | (~terminated & (self._steps >= self._most_steps))
        every = np.ones(self.num_envs, dtype=bool)
        infos: dict[str, Any] = {
            "tick": np.array(self.batch.ticks),
            "score": self.batch.scores,
            "is_success": terminated.copy(),
            "events": self._events(),
        }
        infos |= {f"_{name}": every.copy() for name in list(infos)}
        if stepped.shaping is not None:
            shaping = np.where(ended, 0.0, stepped.shaping)
            infos |= {"shaping": shaping, "_shaping": every.copy()}
            if self._shaping is True:
                rewards += shaping
        self._over = terminated | truncated
        for k in np.flatnonzero(finished):
            infos = self._add_info(infos, {"result": self.batch.result(int(k))}, int(k))
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            told = [name for name in infos if not name.startswith("_")]
            for k in np.flatnonzero(self._over):
                final = {name: values[k].copy() for name, values in observations.items()}
                last = {name: infos[name][k] for name in told if infos[f"_{name}"][k]}
                infos = self._add_info(infos, {"final_obs": final, "final_info": last}, int(k))
            seeds = [self._next(k, None) if self._over[k] else 0 for k in range(self.num_envs)]
            observations = self._with_depths(self.batch.reset(seeds, self._over))
            self._steps[self._over] = 0
            self._over = np.zeros(self.num_envs, dtype=bool)
        return observations, rewards, terminated, truncated, infos | self._privileged()

    def _events(self) -> np.ndarray[Any, Any]:
        """Return the referee's events of the last step, a list for each environment."""
        events = np.empty(self.num_envs, dtype=object)
        for k in range(self.num_envs):
            events[k] = self.batch.events(k)
        return events

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return an attribute, or the result of a method, of every environment: it is one for all of them."""
        value = getattr(self, name)
        if callable(value):
            value = value(*args, **kwargs)
        return (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every environment."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute, such as ``fraction``, of all environments.

        Raises:
            AttributeError: There is no such attribute.
            ValueError: The values differ between environments, which share it.

        """
        if not hasattr(self, name):
            raise AttributeError(f"{name}: there is no such attribute")
        several = list(values) if isinstance(values, list | tuple | np.ndarray) else [values]
        if len(several) not in (1, self.num_envs) or any(value != several[0] for value in several):
            raise ValueError(f"{name}: found {values}; wanted one value for all {self.num_envs} environments")
        setattr(self, name, several[0])

    def render(self) -> tuple[np.ndarray[Any, Any], ...] | None:
        """Return a picture (height, width, 3) of uint8 of each environment."""
        if self.render_mode is None:
            return None
        return tuple(self.batch.pictures(self.film, self.film_size, "film")["film"])

    def close_extras(self, **_: Any) -> None:
        """Do nothing: nothing is open."""
