"""Actions in [−1, 1], as most learners want them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces

from palmares import own_task
from palmares.arguments import table
from palmares.arrays import Array, array
from palmares.clipping import Clipping
from palmares.gym.env import PalmaresEnv
from palmares.gym.fields import Arrays
from palmares.gym.forms import Form
from palmares.gym.hooks import Transition, copied, rewards_of
from palmares.gym.settings import OF_BATCH, Settings, settings_of

if TYPE_CHECKING:
    from palmares.sim import World

# Objects in every scene of the tasks that come with the program.
OBJECTS = {"balls": 10, "shelf": 10, "grasp": 1, "pan": 2, "peg": 2}


class FlatEnv(gymnasium.Env[Arrays, Array]):
    """A `PalmaresEnv` with actions (6 + motors,) in [−1, 1]; the ids of gymnasium make it.

    The first six are the base's velocity as parts of its limits, world frame; the others are the motors, −1
    open and 1 closed. With ``base="pose"`` an action is (7 + motors,): the position that the base moves to,
    as parts of 2 m from the origin of the world, and the quaternion x y z w, of any length but zero. With
    ``base="joints"`` it is (n + motors,): the n joints of the task's arm, −1 and 1 at the ends of their
    ranges.
    Without `url` it plays in this process. `objects` is set for the tasks of the program and for your own by
    their folder.

    An observation has one of these forms:

    - ``fields``: the fields of `PalmaresEnv`, each in its shape.
    - ``groups``: ``policy`` (n,), what the sensors read, with their errors if ``noise="real"``, and
      ``critic`` (m,), all fields: those of the sensors and of the truth. Both are float32.
    - ``goal``: ``observation`` (n,), all fields or with ``sensing="sensors"`` those of the sensors, and
      ``achieved_goal`` and ``desired_goal`` (3,), m: where the centre of the goal's object is and is wanted,
      as environments of Gymnasium-Robotics have it. All are float32. The reward is `compute_reward`, −1 or 0,
      and ``is_success`` says whether it is 0. A task that is complete then counts as truncated, because no
      goal ends an episode.

    Images of `cameras` stay fields of their own.

    Args:
        task: Name of the task, or the folder of your own.
        hand: Name of the hand, or the path of your own.
        url: Address of a server; left out, it plays in this process.
        settings: The settings, without those of vectors.
        options: Fields of `Settings` and of its `training`; they replace those of `settings`. With `url` also
            arguments of `Client`, such as ``team``.

    Attributes:
        inner: The `PalmaresEnv`, whose actions are a dictionary in SI units.
        layout: Columns of each field in the vectors of ``groups`` and ``goal``:
            ``layout["critic"]["objects"]`` is a slice.
        compute_reward: Takes achieved goals, desired goals (…, 3) and an info, which it ignores; returns the
            rewards (…,): 0 within the tolerance, and −1 elsewhere. Only with goals, as the next two.
        compute_terminated: Returns False.
        compute_truncated: Returns False.

    """

    compute_reward: Callable[[Any, Any, Any], Any]
    compute_terminated: Callable[[Any, Any, Any], bool]
    compute_truncated: Callable[[Any, Any, Any], bool]
    metadata = PalmaresEnv.metadata

    def __init__(
        self,
        task: str,
        hand: str,
        *,
        url: str | None = None,
        settings: Settings | None = None,
        **options: Any,
    ) -> None:
        chosen, others = settings_of(settings, options, OF_BATCH)
        if chosen.objects is None and "objects" not in options:
            chosen = replace(chosen, objects=_objects(task))
        self._form = Form(chosen)
        self._reward, self._before = chosen.reward, Arrays()
        of_fields = replace(
            chosen,
            sensing=self._form.sensing,
            observations="fields",
            goal=None,
            reward=None,
            observe=None,
            action_scale=1.0,
        )
        self.inner = PalmaresEnv(url, task=task, hand=hand, settings=of_fields, **others)
        self.render_mode, self.metadata = self.inner.render_mode, self.inner.metadata
        self.hand_numbers = self.inner.hand_numbers
        actions = cast(spaces.Dict, self.inner.action_space)
        of_base, sigma = cast(spaces.Box, actions[chosen.base]), cast(spaces.Box, actions["hand"])
        self._clipping = Clipping()
        self._base = chosen.base
        self._middle = array(0.5 * (of_base.low + of_base.high))
        self._half: Array = array(of_base.high) - self._middle
        length = len(self._half) + sigma.shape[0]
        self._action_scale = chosen.scale(length)
        self.action_space = spaces.Box(-1.0, 1.0, (length,), dtype=np.float64)
        self._form.open(cast(spaces.Dict, self.inner.observation_space), self.inner.hidden)
        self.observation_space = cast(spaces.Space[Arrays], self._form.space)
        self.layout, self._desired = self._form.layout, np.zeros(3)
        # Learners take an environment with these for one with goals.
        if self._form.goal is not None:
            self.compute_reward = self._form.reward
            self.compute_terminated = self.compute_truncated = self._form.never

    @property
    def fraction(self) -> float:
        """As `PalmaresEnv.fraction`."""
        return self.inner.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self.inner.fraction = fraction

    @property
    def world(self) -> World | None:
        """As `PalmaresEnv.world`."""
        return self.inner.world

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Open a run; see `PalmaresEnv.reset`."""
        super().reset(seed=seed, options=options)
        fields, info = self.inner.reset(seed=seed, options=options)
        if self._reward is not None:
            self._before = copied(fields)
        if self._form.goal is not None:
            self._desired = self._form.goal.drawn(info["seed"], self._form.place(fields))
        return self._form.made(fields, (), self._desired), info

    def step(self, action: Array) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action."""
        action = table("action", action, *cast(tuple[int], self.action_space.shape))
        self._clipping.check_unit(action, stacklevel=2)
        length = len(self._half)
        scaled = action * self._action_scale
        base, hand = scaled[:length] * self._half + self._middle, 0.5 * (scaled[length:] + 1.0)
        fields, reward, terminated, truncated, info = self.inner.step({self._base: base, "hand": hand})
        if self._reward is not None:
            reward = self._own_reward(fields, action, reward, terminated, truncated, info["events"])
        observation = self._form.made(fields, (), self._desired)
        if self._form.goal is not None:
            reward = self.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
            info["is_success"] = reward == 0.0
            terminated, truncated = False, terminated or truncated
        return observation, reward, terminated, truncated, info

    def _own_reward(
        self, fields: Arrays, action: Array, reward: float, terminated: bool, truncated: bool, events: Any
    ) -> float:
        assert self._reward is not None
        before, after = (
            {name: values[np.newaxis] for name, values in one.items()} for one in (self._before, fields)
        )
        own = np.array([reward])
        ends = np.array([terminated]), np.array([truncated])
        step = Transition(before, after, action[np.newaxis], own, [events], *ends)
        found = float(rewards_of(self._reward, step)[0])
        self._before = copied(fields)
        return found

    def render(self) -> Any:
        """As `PalmaresEnv.render`."""
        return self.inner.render()

    def close(self) -> None:
        """End the session."""
        self.inner.close()


def _objects(task: str) -> int | None:
    """Return the number of objects in a task's scenes; ``None`` for a task that only a server knows."""
    own: dict[str, Any] = {} if task in OBJECTS else own_task.read(task).get("objects", {})
    return OBJECTS.get(task, own.get("count"))
