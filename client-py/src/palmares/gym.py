"""Practice as a `gymnasium` environment. Needs ``pip install 'palmares[gym]'``.

>>> env = PalmaresEnv("http://127.0.0.1:8080", task="balls", hand="softhand")      # doctest: +SKIP
... obs, info = env.reset(seed=1)
... obs, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, cast

import gymnasium
import numpy as np
from gymnasium import spaces

from palmares.arrays import Array, array
from palmares.client import Client
from palmares.messages import Observation, Specs
from palmares.targets import twist

Arrays: TypeAlias = dict[str, Array]


class PalmaresEnv(gymnasium.Env[Arrays, Arrays]):
    """A run as an episode. The reward of a step is the change of the score.

    An action has, within the limits in `Welcome.specs`:

    - ``twist`` (6,): linear (m/s) and angular (rad/s) velocity of the base, world frame
    - ``hand`` (motors,): σ of every motor

    An observation has:

    - ``base`` (13,): position (m), quaternion x y z w, linear (m/s) and angular (rad/s) velocity
    - ``motors`` (motors, 4): command, position, velocity (1/s) and tension of each
    - ``wrist`` (6,): force (N), torque (N·m)
    - ``objects`` (objects, 13), with ``sensing="truth"``: as ``base``, for each
    - ``joints`` (2, joints), with ``sensing="truth"``: position (rad), velocity (rad/s)
    - ``encoders`` (encoders,), ``touch`` (taxels, 3), if the hand has them: rad, N
    - ``depth.NAME`` (height, width), for each of `cameras`: m, 0 where there is no reading

    The number of objects is not known before a run is opened. So the space of ``objects`` is a `Sequence` of
    any length; with the argument `objects` it is a `Box` of fixed shape, which most learners need.

    Attributes:
        client: The session, for what gymnasium does not cover.
        observation: The last observation, typed; ``None`` before the first `reset`.

    Args:
        url: Where the server listens.
        task: Name of the task.
        hand: Name of the hand.
        sensing: ``truth`` for the full state, ``sensors`` for what real sensors give.
        noise: ``none`` or ``real``: how good the sensors are; left out, as the server has it.
        cameras: Names of cameras whose depth is part of every observation.
        ticks: Ticks per step, under the same action.
        objects: Number of objects in every scene of the task; another number is a `ValueError` at `reset`.
        client: Further arguments of `Client`, such as ``team``.

    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as gymnasium has it

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        *,
        task: str = "balls",
        hand: str = "softhand",
        sensing: Literal["sensors", "truth"] = "truth",
        noise: Literal["none", "real"] | None = None,
        cameras: Sequence[str] = (),
        ticks: int = 10,
        objects: int | None = None,
        **client: Any,
    ) -> None:
        self.client = Client(url, **client)
        self._task, self._hand, self._sensing, self._ticks = task, hand, sensing, ticks
        self._objects, self._noise, self._cameras = objects, noise, tuple(cameras)
        self._score = 0.0
        self.observation: Observation | None = None
        played = self.client.welcome.hand(hand)
        shapes = {"base": (13,), "motors": (len(played.motors), 4), "wrist": (6,)}
        if sensing == "truth":
            shapes["joints"] = (2, len(played.joints))
        if played.encoders:
            shapes["encoders"] = (len(played.encoders),)
        if played.taxels:
            shapes["touch"] = (len(played.taxels), 3)
        observations = {name: _unbounded(*shape) for name, shape in shapes.items()}
        if sensing == "truth":
            row = _unbounded(13)
            observations["objects"] = (
                spaces.Sequence(row, stack=True) if objects is None else _unbounded(objects, 13)
            )
        of_task = self.client.welcome.task(task).cameras
        taken = {camera.name for camera in of_task}
        known = {camera.name: camera for camera in of_task}
        for camera in played.cameras:
            known[f"hand_{camera.name}" if camera.name in taken else camera.name] = camera
        for name in self._cameras:
            if name not in known:
                raise ValueError(
                    f"no camera {name!r} in task {task!r} with {hand!r}: {', '.join(known) or 'none'}"
                )
            camera = known[name]
            observations[f"depth.{name}"] = spaces.Box(
                0.0, camera.far, (camera.height, camera.width), dtype=np.float64
            )
        actions = _action_space(self.client.welcome.specs, len(played.motors))
        self.action_space = cast(spaces.Space[Arrays], actions)
        self.observation_space = cast(spaces.Space[Arrays], spaces.Dict(observations))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Stop the open run, if any, and open another; `seed` sets this scene and those of later resets."""
        super().reset(seed=seed, options=options)
        if self.client.tick is not None:
            self.client.stop()
        if seed is None:
            seed = int(self.np_random.integers(2**53))
        obs = self.client.reset(
            self._task, self._hand, sensing=self._sensing, noise=self._noise, seed=seed, cameras=self._cameras
        )
        found = len(self.client.scene.free)
        if self._objects not in (None, found):
            raise ValueError(f"the scene has {found} objects, not {self._objects}")
        self.observation, self._score = obs, obs.score
        return arrays_of(obs), {"seed": seed}

    def step(self, action: Arrays) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action."""
        base = twist(action["twist"][:3], action["twist"][3:])
        obs = self.client.step(base=base, hand=action["hand"], repeat=self._ticks, cameras=self._cameras)
        reward, self._score = obs.score - self._score, obs.score
        self.observation = obs
        return arrays_of(obs), reward, obs.terminated, obs.truncated, {"tick": obs.tick, "score": obs.score}

    def close(self) -> None:
        """End the session."""
        self.client.close()


def arrays_of(obs: Observation) -> Arrays:
    """Return an observation as arrays; their shapes are in the docstring of `PalmaresEnv`."""
    hand, base = obs.hand, obs.hand.base
    motors = [(motor.command, motor.position, motor.velocity, motor.tension) for motor in hand.actuators]
    found = {
        "base": array([*base.position, *base.quat_xyzw, *base.linear, *base.angular]),
        "motors": array(motors, -1, 4),
        "wrist": array([*hand.wrist.force, *hand.wrist.torque]),
    }
    if hand.joints.size:
        found["encoders"] = hand.joints
    if hand.touch.size:
        found["touch"] = hand.touch
    for name, image in obs.cameras.items():
        found[f"depth.{name}"] = np.nan_to_num(image.depth, nan=0.0)
    if obs.truth is not None:
        truth = obs.truth
        found["objects"] = np.hstack([truth.positions, truth.quats_xyzw, truth.linear, truth.angular])
        found["joints"] = array([truth.joints.position, truth.joints.velocity])
    return found


def _unbounded(*shape: int) -> spaces.Space[Any]:
    return spaces.Box(-np.inf, np.inf, shape, dtype=np.float64)


def _action_space(specs: Specs, motors: int) -> spaces.Dict:
    ranges = [specs.action_field(name).range for name in ("base.linear", "base.angular")]
    low, high = np.repeat(ranges, 3, axis=0).T
    sigma_low, sigma_high = specs.action_field("hand").range
    return spaces.Dict(
        {
            "twist": spaces.Box(low, high, dtype=np.float64),
            "hand": spaces.Box(sigma_low, sigma_high, (motors,), dtype=np.float64),
        }
    )
