"""Many episodes at once, on all cores, in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from palmares.arguments import MAX_COUNT, MAX_SEED, mask_of, table, whole
from palmares.arrays import Array
from palmares.clipping import Clipping
from palmares.gym.fields import Arrays, base_space, box
from palmares.gym.forms import Form
from palmares.gym.hooks import Transition, copied, rewards_of
from palmares.gym.images import FILM, FILM_SIZE, cameras_of, spaces_of, view_of
from palmares.gym.infos import events_of, refuse_options, row_of
from palmares.gym.seeds import any_seed, seed_of_episode
from palmares.gym.settings import Settings, settings_of, unexpected
from palmares.gym.starts import Starts, starts_of
from palmares.net.requests import names
from palmares.sim import HANDS, TASKS, Batch, welcome

Mask = NDArray[np.bool_]


class BatchEnv(VectorEnv[Arrays, Array, NDArray[Any]]):
    """`num_envs` runs of one task and hand as a vector environment, stepped by native threads.

    Actions, observations and rewards are those of `FlatEnv`, for each field an array (num_envs, …). The seed,
    *i* and *k* alone determine the scene of episode *k* of environment *i*, so that a training does not
    depend on the number of threads or on the ends of other episodes.

    ``infos`` have the entries of `PalmaresEnv`, as gymnasium has them: an array (num_envs, …) of each, and
    ``_NAME`` (num_envs,), where it is given. So ``infos["result"]["score"]`` are the scores of the runs that
    are over. A step that resets an environment has its ``seed``. With
    ``autoreset_mode=AutoresetMode.SAME_STEP`` a step has, beside the entries of the last step of an episode,
    ``final_obs`` and ``final_info``.

    It can be pickled and copied, also within episodes: the copy goes on with the same bits, in this process
    or another.

    Args:
        task: Name of the task.
        hand: Name of the hand.
        num_envs: Number of environments.
        settings: The settings.
        options: Fields of `Settings` and of its `training`; they replace those of `settings`. Arguments of a
            single environment, such as ``url``, are a `TypeError`.

    Attributes:
        batch: The worlds, for snapshots and state hashes.
        hand_numbers: As `PalmaresEnv.hand_numbers`.
        layout: As `FlatEnv.layout`.
        compute_reward: As `FlatEnv.compute_reward`.

    """

    compute_reward: Callable[[Any, Any, Any], Any]

    def __init__(
        self,
        task: str = "balls",
        hand: str = "softhand",
        num_envs: int = 1,
        *,
        settings: Settings | None = None,
        **options: Any,
    ) -> None:
        chosen, single = settings_of(settings, options, ("objects",))
        if single:
            where = "for a single environment only, of gymnasium.make"
            raise TypeError(unexpected(single, where, ("objects",)))
        if chosen.render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: found {chosen.render_mode!r}; wanted None or 'rgb_array'")
        cameras, noise = names(chosen.cameras), chosen.noise or "none"
        colours = [name for name in cameras if name.endswith(".rgb")]
        if colours and noise != "none":
            raise ValueError(
                f"cameras: found {colours} with noise={noise!r}; wanted noise='none': only an environment of "
                "gymnasium.make has the errors of colours"
            )
        self._form = Form(chosen)
        self._made = task, hand, noise
        self.batch = Batch(
            task,
            hand,
            num_envs,
            sensing=self._form.sensing,
            noise=noise,
            threads=chosen.threads,
            training=chosen.for_learners,
            base=chosen.base,
        )
        self._shaping, self._base, self._reward = chosen.shaping, chosen.base, chosen.reward
        self._before = Arrays()
        # The action space is a box; its corners exceed the limits of the norm.
        self.batch.clipping.mute()
        self._clipping = Clipping()
        self.num_envs, self._ticks = self.batch.count, whole("ticks", chosen.ticks, 1, MAX_COUNT)
        self.hand_numbers = self.batch.hand_numbers
        self.autoreset_mode, self.render_mode = AutoresetMode(chosen.autoreset_mode), chosen.render_mode
        self.metadata = {
            "autoreset_mode": self.autoreset_mode,
            "render_modes": ["rgb_array"],
            "render_fps": max(1, round(1.0 / (self._ticks * self.batch.tick_s))),
        }
        known = welcome(own_tasks=[] if task in TASKS else [task], own_hands=[] if hand in HANDS else [hand])
        task_info = known.task(task) if task in TASKS else known.tasks[-1]
        hand_info = known.hand(hand) if hand in HANDS else known.hands[-1]
        there = cameras_of(task_info, hand_info)
        self._view = view_of(chosen.render_camera, there, local=True)
        self._render_size = chosen.render_size or (FILM_SIZE if self._view == FILM else None)
        images = [name.partition(".") for name in cameras]
        self._depths = [name for name, _, kind in images if kind != "rgb"]
        self._colours = [name for name, _, kind in images if kind == "rgb"]
        fields: dict[str, spaces.Space[Any]] = dict(spaces_of(cameras, there))
        fields |= {name: box(*shape) for name, shape in self.batch.fields.items()}
        hidden = [channel.name for channel in hand_info.channels if channel.truth]
        self._form.open(spaces.Dict(fields), hidden)
        self.layout = self._form.layout
        length = self.batch.action_len
        self.single_observation_space = cast(spaces.Space[Arrays], self._form.space)
        self.single_action_space = spaces.Box(-1.0, 1.0, (length,), dtype=np.float64)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        of_base = base_space(self._base, known.specs, task_info.arm)
        motors, middle = np.full(length - len(of_base.low), 0.5), 0.5 * (of_base.low + of_base.high)
        self._action_scale = chosen.scale(length)
        self._scale, self._shift = np.append(of_base.high - middle, motors), np.append(middle, motors)
        self._roots = np.zeros(num_envs, dtype=np.uint64)
        self._episodes = np.zeros(num_envs, dtype=np.uint64)
        self._over = np.zeros(num_envs, dtype=bool)
        longest = chosen.max_episode_steps
        self._most_steps = None if longest is None else whole("max_episode_steps", longest, 1, MAX_COUNT)
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._desired = np.zeros((num_envs, 3))
        self._starts: Starts | None = None
        if self._form.goal is not None:
            self.compute_reward = self._form.reward

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
            options: ``reset_mask``, and ``parameters``: numbers given for these runs rather than drawn, as of
                `palmares.sim.Batch.reset`. A later reset without them, also by itself, has none. ``state``:
                recorded states, as of `palmares.gym.FlatEnv.reset`, for these runs and all later ones.

        Raises:
            ValueError: A seed, the mask, a parameter, a state or an option is invalid; nothing has changed.

        """
        refuse_options(options, ("reset_mask", "parameters", "state"))
        mask = np.ones(self.num_envs, dtype=bool)
        if options and "reset_mask" in options:
            mask = mask_of("reset_mask", options["reset_mask"], self.num_envs)
        if seed is None and not self.batch.opened:
            seed = any_seed()
        if seed is not None and (isinstance(seed, str) or not isinstance(seed, Iterable)):
            first = whole("seed", seed, 0, MAX_SEED)
            seed = [first + k for k in range(self.num_envs)]
        given = [None] * self.num_envs if seed is None else list(seed)
        if len(given) != self.num_envs:
            raise ValueError(f"seed: found {len(given)}; wanted one, or one for each of {self.num_envs}")
        given = [one if one is None else whole(f"seed[{k}]", one, 0, MAX_SEED) for k, one in enumerate(given)]
        before, self._starts = self._starts, self._given_starts(options or {})
        try:
            fields, infos = self._opened(mask, given, (options or {}).get("parameters"))
        except ValueError:
            self._starts = before
            raise
        return self._observed(fields), infos | self._privileged()

    def _given_starts(self, options: dict[str, Any]) -> Starts | None:
        """Return the states of the options, or those that hold."""
        if "state" not in options:
            return self._starts
        return (
            None
            if options["state"] is None
            else starts_of(options["state"], *self._made, self.batch.training)
        )

    def _opened(
        self,
        mask: Mask,
        seeds: Sequence[int | None] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
    ) -> tuple[Arrays, dict[str, Any]]:
        """Open the next runs of the environments of `mask`; return the fields and the infos."""
        given = [None] * self.num_envs if seeds is None else seeds
        before = self._roots.copy(), self._episodes.copy()
        chosen = [self._next(k, given[k]) if mask[k] else 0 for k in range(self.num_envs)]
        try:
            fields = self.batch.reset(chosen, mask, parameters)
        except ValueError:
            self._roots, self._episodes = before
            raise
        self._over[mask], self._steps[mask] = False, 0
        found = np.array(self.batch.seeds)
        infos = {"seed": np.where(mask, found, 0), "_seed": mask.copy()}
        if self._starts is not None:
            start = np.array([self._starts.drawn(found[k]) if mask[k] else 0 for k in range(self.num_envs)])
            fields = self.batch.set_state(self._starts.rows(start, self.batch.state().objects), mask)
            infos |= {"start": start, "_start": mask.copy()}
        if self._reward is not None:
            self._before = copied(fields)
        if self._form.goal is not None:
            places = self._form.place(fields)
            for k in np.flatnonzero(mask):
                self._desired[k] = self._form.goal.drawn(found[k], places[k])
        return fields, infos

    def _next(self, k: int, seed: int | None) -> int:
        """Return the seed of the next scene of environment `k`."""
        if seed is not None:
            self._roots[k], self._episodes[k] = seed, 0
        else:
            self._episodes[k] += np.uint64(1)
        return seed_of_episode(int(self._roots[k]), int(self._episodes[k]))

    def _privileged(self) -> dict[str, Any]:
        """Return what a critic may know and sensors do not."""
        if not self.hand_numbers:
            return {}
        return {"hand_drawn": self.batch.hand_drawn, "_hand_drawn": np.ones(self.num_envs, dtype=bool)}

    def _observed(self, fields: Arrays) -> Arrays:
        """Return the observation of fields."""
        if self._depths:
            found = self.batch.depths(self._depths)
            fields |= {f"depth_{name}": found[name].astype(np.float32) for name in self._depths}
        for name in self._colours:
            fields[f"rgb_{name}"] = self.batch.pictures(name, None, "rgb")["rgb"]
        return self._form.made(fields, (self.num_envs,), self._desired)

    def step(self, actions: Array) -> tuple[Arrays, Array, Mask, Mask, dict[str, Any]]:
        """Advance every environment by `ticks`.

        Args:
            actions: (num_envs, 6 + motors), (num_envs, 7 + motors) with ``base="pose"``, (num_envs, n +
                motors) with ``base="joints"``.

        Returns:
            Observations, rewards (num_envs,), terminated (num_envs,), truncated (num_envs,), infos.

        Raises:
            ValueError: The actions have a wrong shape, or are not finite; nothing has changed.
            RuntimeError: There was no `reset`; nothing has changed.

        """
        if not self.batch.opened:
            raise RuntimeError("no runs are open; call reset() first")
        actions = table("actions", actions, self.num_envs, self.batch.action_len)
        self._clipping.check_unit(actions, stacklevel=2)
        begun, infos = self._over.copy(), {}
        if self.autoreset_mode is AutoresetMode.DISABLED and begun.any():
            which = ", ".join(map(str, np.flatnonzero(begun)))
            raise RuntimeError(f"the runs of {which} are over: reset(options={{'reset_mask': …}}) first")
        if begun.any():  # NEXT_STEP: they are only reset in this step.
            infos = self._opened(begun)[1]
        went = ~begun
        if self._base == "pose" and begun.any():  # Their actions are ignored, also quaternions of no length.
            actions = np.where(begun[:, np.newaxis], 1.0, actions)
        scaled = actions * self._action_scale
        stepped = self.batch.step(scaled * self._scale + self._shift, self._ticks, went)
        self._steps[went] += 1
        rewards = np.where(went, stepped.rewards, 0.0)
        terminated, truncated = stepped.terminated, stepped.truncated
        finished = terminated | truncated
        after = copied(stepped.observations) if self._reward is not None else {}
        observations = self._observed(stepped.observations)
        info = {
            "tick": np.where(went, self.batch.ticks, 0),
            "score": np.where(went, self.batch.scores, 0.0),
            "is_success": terminated.copy(),
            "events": self._events(),
        }
        if stepped.shaping is not None:
            info["shaping"] = np.where(went, stepped.shaping, 0.0)
            if self._shaping is True:
                rewards += info["shaping"]
        if self._form.goal is not None:
            goals = observations["achieved_goal"], observations["desired_goal"]
            reached = self._form.reward(*goals, info)
            rewards = np.where(went, reached, 0.0)
            info["is_success"] = went & (reached == 0.0)
            terminated, truncated = np.zeros_like(terminated), finished
        if self._most_steps is not None:
            truncated = truncated | (~terminated & (self._steps >= self._most_steps))
        if self._reward is not None:
            step = Transition(
                self._before, after, actions, rewards, list(info["events"]), terminated, truncated
            )
            rewards = np.where(went, rewards_of(self._reward, step), 0.0)
            self._before = after
        for name, values in info.items():
            infos |= {name: values, f"_{name}": went.copy()}
        infos |= self._privileged()
        for k in map(int, np.flatnonzero(finished)):
            infos = self._add_info(infos, {"result": self.batch.result(k)}, k)
        self._over = terminated | truncated
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            ended = list(map(int, np.flatnonzero(self._over)))
            last = [row_of(infos, k) for k in ended]
            for k, info in zip(ended, last, strict=True):
                final = {name: values[k].copy() for name, values in observations.items()}
                infos = self._add_info(infos, {"final_obs": final, "final_info": info}, k)
            fields, begins = self._opened(self._over.copy())
            observations, infos = self._observed(fields), infos | begins | self._privileged()
        return observations, rewards, terminated, truncated, infos

    def _events(self) -> NDArray[Any]:
        """Return the referee's events of the last step, a list for each environment."""
        events = np.empty(self.num_envs, dtype=object)
        for k in range(self.num_envs):
            events[k] = events_of(self.batch.events(k))
        return events

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return an attribute, or the result of a method, of every environment: it is one for all of them.

        Raises:
            AttributeError: There is no such attribute.

        """
        value = getattr(self, name)
        if name == "render":
            return self.render() or (None,) * self.num_envs
        if callable(value):
            value = value(*args, **kwargs)
        return (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every environment.

        Raises:
            AttributeError: There is no such attribute.

        """
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

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return a picture (height, width, 3) of uint8 of each environment."""
        if self.render_mode is None:
            return None
        return tuple(self.batch.pictures(self._view, self._render_size, "film")["film"])

    def close_extras(self, **_: Any) -> None:
        """Do nothing: nothing is open."""
