"""Practice as a `gymnasium` environment. Needs ``pip install 'palmares[gym]'``.

>>> env = PalmaresEnv("http://127.0.0.1:8080", task="balls", hand="softhand")      # doctest: +SKIP
... obs, info = env.reset(seed=1)
... obs, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias, cast

import gymnasium
import numpy as np
from gymnasium import spaces

from palmares.client import Client
from palmares.messages import Observation
from palmares.rotation import Array
from palmares.targets import twist
from palmares.truth import BodyState

Numbers: TypeAlias = dict[str, Array]
LINEAR_M_S, ANGULAR_RAD_S = 2.0, 3.0


class PalmaresEnv(gymnasium.Env[Numbers, Numbers]):
    """A run as an episode. The reward of a step is what it adds to the score.

    Actions are ``twist`` (m/s and rad/s of the base, world frame) and ``hand`` (σ of every motor). An
    observation has:

    - ``base``: position, quaternion x y z w, linear and angular velocity
    - ``motors``: command, position, velocity and tension of each
    - ``wrist``: force, torque
    - ``objects``, with ``sensing="truth"``: as ``base``, for each
    - ``joints``, with ``sensing="truth"``: position, velocity

    A first run is opened and closed to see how many objects there are.

    Attributes:
        client: The session, for all that an environment has no word for.
        observation: The last observation, typed.

    Args:
        url: Where the server listens.
        task: Name of the task.
        hand: Name of the hand.
        sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
        ticks: Ticks of 10 ms per step, under the same action.
        client: What else `Client` takes, such as ``team``.

    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as gymnasium has it

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        *,
        task: str = "balls",
        hand: str = "softhand",
        sensing: Literal["sensors", "truth"] = "truth",
        ticks: int = 10,
        **client: Any,
    ) -> None:
        self.client = Client(url, **client)
        self._task, self._hand, self._sensing, self._ticks = task, hand, sensing, ticks
        self._score = 0.0
        first = self.client.reset(task, hand, sensing=sensing)
        self.observation = first
        self.client.stop()
        most = np.array([LINEAR_M_S] * 3 + [ANGULAR_RAD_S] * 3)
        motors = (len(first.hand.actuators),)
        actions: dict[str, spaces.Space[Any]] = {"twist": spaces.Box(-most, most, dtype=np.float64)}
        actions["hand"] = spaces.Box(0.0, 1.0, motors, dtype=np.float64)
        observations: dict[str, spaces.Space[Any]] = {
            name: spaces.Box(-np.inf, np.inf, numbers.shape, dtype=np.float64)
            for name, numbers in numbers_of(first).items()
        }
        self.action_space = cast(spaces.Space[Numbers], spaces.Dict(actions))
        self.observation_space = cast(spaces.Space[Numbers], spaces.Dict(observations))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Stop the run that is open, if any, and open another; `seed` chooses the scene, and all after it."""
        super().reset(seed=seed, options=options)
        if self.client.tick is not None:
            self.client.stop()
        if seed is None:
            seed = int(self.np_random.integers(2**53))
        obs = self.client.reset(self._task, self._hand, sensing=self._sensing, seed=seed)
        self.observation, self._score = obs, obs.score
        return numbers_of(obs), {"seed": seed}

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action."""
        base = twist(action["twist"][:3], action["twist"][3:])
        obs = self.client.step(base=base, hand=action["hand"], repeat=self._ticks)
        reward, self._score = obs.score - self._score, obs.score
        self.observation = obs
        return numbers_of(obs), reward, obs.terminated, obs.truncated, {"tick": obs.tick, "score": obs.score}

    def close(self) -> None:
        """End the session."""
        self.client.close()


def numbers_of(obs: Observation) -> Numbers:
    """Return an observation as arrays."""
    hand = obs.hand
    motors = [(motor.command, motor.position, motor.velocity, motor.tension) for motor in hand.actuators]
    numbers = {
        "base": np.array(_body(hand.base)),
        "motors": np.array(motors).reshape(-1, 4),
        "wrist": np.array([*hand.wrist.force, *hand.wrist.torque]),
    }
    if obs.truth is not None:
        truth = obs.truth
        numbers["objects"] = np.hstack([truth.positions, truth.quats_xyzw, truth.linear, truth.angular])
        numbers["joints"] = np.array([truth.joints.position, truth.joints.velocity])
    return numbers


def _body(body: BodyState) -> tuple[float, ...]:
    return (*body.position, *body.quat_xyzw, *body.linear, *body.angular)
