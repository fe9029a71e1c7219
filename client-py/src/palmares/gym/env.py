"""A run as an episode, with observations and actions as dictionaries in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, cast

import gymnasium
from gymnasium import spaces

from palmares.arguments import one_of, table, whole
from palmares.arrays import array
from palmares.client import LOCAL, Client
from palmares.gym.ends import refuse_options, result_of
from palmares.gym.fields import Arrays, action_space, arrays_of, arrays_of_scene, box, depth_space, padded
from palmares.gym.player import Player
from palmares.gym.training import Shaping, shaping_of, training_of
from palmares.messages import Observation
from palmares.net.requests import names
from palmares.targets import twist

if TYPE_CHECKING:
    from palmares.sim import View, World


class PalmaresEnv(gymnasium.Env[Arrays, Arrays]):
    """A run as an episode. The reward of a step is the change of the score, plus the shaped part if wanted.

    An action has, within the limits in `Welcome.specs`:

    - ``twist`` (6,): linear (m/s) and angular (rad/s) velocity of the base, world frame
    - ``hand`` (motors,): σ of every motor

    An observation has:

    - each channel of the hand (`HandInfo.channels`): ``base`` (13,), ``motors`` (motors, 4), ``wrist`` (6,),
      and, with a hand that has them, ``encoders`` (encoders,), ``touch`` (taxels, 3), ``acceleration`` (3,);
      docs/senses.md has their columns and units
    - ``time_left`` (1,): s until the time limit
    - ``objects`` (objects, 13), with ``sensing="truth"``: as ``base``, for each
    - ``joints`` (2, joints), with ``sensing="truth"``: position (rad), velocity (rad/s)
    - ``object_kind`` (objects,), ``object_half_extents`` (objects, 3), ``object_mass`` (objects,), with
      ``sensing="truth"`` and a fixed number of `objects`: 0 sphere, 1 capsule, 2 cylinder, 3 box, 4 hull,
      5 several parts; m, in its own frame; kg
    - ``hand_drawn`` (numbers,), with ``sensing="truth"`` and where `randomise` draws the hand: the numbers of
      ``info["hand_drawn"]``
    - ``depth.NAME`` (height, width), for each of `cameras`: m, 0 where there is no reading

    The number of objects is unknown before a run is opened. So the space of ``objects`` is a `Sequence` of
    any length; with the argument `objects` it is a `Box` of fixed shape, which most learners need.

    The info of a step has ``tick``, ``score``, ``events``, the referee's, and ``is_success``: whether the
    task is complete. When an episode is over, ``result`` has the count after the objects have settled:
    status, score, in_goal, outside, reason, ticks, … as `palmares.Result`; with the last reward the sum is
    the final score. Where `randomise` draws the hand, ``info["hand_drawn"]`` has the drawn numbers by name,
    for a privileged critic.

    Attributes:
        observation: The last observation, typed; ``None`` before the first `reset`.

    Args:
        url: Address of the server; ``None`` or ``local`` to play in this process.
        task: Name of the task, or the folder of your own. A server plays it if it was started with it.
        hand: Name of the hand; in this process also the path of your own.
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``: errors of the sensors; that of the server when left out.
        cameras: Names of cameras whose depth is part of every observation.
        ticks: Ticks per step, under the same action; at most `Limits.repeat`, 100.
        objects: Number of objects in every scene of the task; another number is a `ValueError` at `reset`.
        shaping: ``True`` adds the shaped part of the task's rewards to the reward and puts it into
            ``info["shaping"]``; ``"info"`` only puts it there. See docs/training.md, also for the next three.
        discount: γ of the learner; that of the task when left out.
        randomise: Quantities drawn for every episode: ``True`` for all, or names out of
            `palmares.training.QUANTITIES`, ``hand`` and ``hand_NAME``.
        fraction: Part of the task's objects in the scene; can be set between episodes.
        render_mode: With ``rgb_array`` `render` returns a picture. With ``human``, only on a server, the
            first `reset` opens the server's page of its worlds.
        film: The camera that takes it: a camera of task or hand; in this process also a `palmares.sim.View`,
            or ``film``, a place from which fingers and objects are seen. Left out, that place, and on a
            server the task's first camera.
        film_size: Its width and height, in this process; 320 × 240 when left out. A server has those of the
            camera.
        client: Further arguments of `Client`, such as ``team``.

    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as gymnasium has it
        "render_modes": ["rgb_array", "human"],
        "render_fps": 10,
    }

    def __init__(
        self,
        url: str | None = "http://127.0.0.1:8080",
        *,
        task: str = "balls",
        hand: str = "softhand",
        sensing: Literal["sensors", "truth"] = "truth",
        noise: Literal["none", "real"] | None = None,
        cameras: Sequence[str] = (),
        ticks: int = 10,
        objects: int | None = None,
        shaping: Shaping | Literal["apart"] = False,
        discount: float | None = None,
        randomise: bool | Sequence[str] = False,
        fraction: float = 1.0,
        render_mode: str | None = None,
        film: str | View | None = None,
        film_size: tuple[int, int] | None = None,
        **client: Any,
    ) -> None:
        url = None if url == LOCAL else url
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: found {render_mode!r}; wanted None, 'rgb_array' or 'human'")
        if render_mode == "human" and url is None:
            raise ValueError("render_mode='human' opens a server's page: give the server's url as well")
        if url is not None and not (film_size is None and (film is None or isinstance(film, str))):
            raise ValueError("film, film_size: a server has its cameras in their sizes: give the name of one")
        self.film, self.film_size = film, film_size or (320, 240)
        if url is None and client:
            raise TypeError(f"for a server only: {', '.join(client)}")
        self.render_mode, self._url = render_mode, url
        if url is None:  # A process without a server has no page.
            self.metadata = {**self.metadata, "render_modes": ["rgb_array"]}
        one_of("sensing", sensing, ("sensors", "truth"))
        if noise is not None:
            one_of("noise", noise, ("none", "real"))
        shaping = shaping_of(shaping)
        training = training_of(shaping, discount, randomise, fraction)
        self._player = Player(url, task, hand, sensing, noise, training, **client)
        self._shaping = shaping
        self._task, self._hand, self._sensing = task, hand, sensing
        self._ticks = whole("ticks", ticks, 1, self.client.welcome.limits.repeat)
        self._objects, self._cameras = objects, tuple(names(cameras))
        self._score = 0.0
        self._scene: Arrays = {}
        self.observation: Observation | None = None
        self.observation_space = cast(spaces.Space[Arrays], self._observations())
        motors = len(self._player.hand.motors)
        self.action_space = cast(spaces.Space[Arrays], action_space(self._player.limits, motors))

    def _observations(self) -> spaces.Dict:
        objects = self._objects
        shapes = {channel.name: tuple(channel.shape) for channel in self._player.channels}
        shapes["time_left"] = (1,)
        found: dict[str, spaces.Space[Any]] = {}
        if self._sensing == "truth":
            shapes["joints"] = (2, len(self._player.hand.joints))
            if self._player.hand_numbers:
                shapes["hand_drawn"] = (len(self._player.hand_numbers),)
            if objects is None:
                found["objects"] = spaces.Sequence(box(13), stack=True)
            else:
                shapes |= {
                    "objects": (objects, 13),
                    "object_kind": (objects,),
                    "object_half_extents": (objects, 3),
                    "object_mass": (objects,),
                }
        found |= {name: box(*shape) for name, shape in shapes.items()}
        found |= {f"depth.{name}": depth_space(self._player.cameras, name) for name in self._cameras}
        return spaces.Dict(found)

    @property
    def fraction(self) -> float:
        """Part of the task's objects in the scene; a new value holds from the next `reset` on."""
        return self._player.training.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self._player.training = replace(self._player.training, fraction=fraction)

    @property
    def client(self) -> Client:
        """The session, for what gymnasium does not cover."""
        return self._player.client

    @property
    def world(self) -> World | None:
        """The world of this process; ``None`` on a server, and before the first `reset`."""
        return self._player.client.world

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Stop the open run, if any, and open another; `seed` sets this scene and those of later resets.

        Raises:
            ValueError: There are `options`, or the seed is none; nothing has changed.

        """
        refuse_options(options)
        super().reset(seed=seed, options=options)
        if seed is None:
            seed = int(self.np_random.integers(2**53))
        first = self.observation is None
        obs = self._player.open(seed, self._cameras)
        found = len(self._player.scene.free)
        whole = self.fraction == 1.0
        if self._objects is not None and (found > self._objects or (whole and found < self._objects)):
            raise ValueError(f"the scene has {found} objects, not {self._objects}")
        fixed = self._sensing == "truth" and self._objects is not None
        self._scene = padded(arrays_of_scene(self._player.scene), self._objects) if fixed else {}
        if self._sensing == "truth" and self._player.hand_numbers:
            self._scene["hand_drawn"] = array(list(self._player.hand_drawn.values()))
        self.observation, self._score = obs, obs.score
        if first and self.render_mode == "human":
            self.render()
        return self._arrays(obs), {"seed": seed} | self._privileged()

    def _privileged(self) -> dict[str, Any]:
        """Return what a critic may know and sensors do not."""
        drawn = self._player.hand_drawn
        return {"hand_drawn": drawn} if drawn else {}

    def step(self, action: Arrays) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action.

        Raises:
            WorldFaultError: The world failed; `fault` is the cause. `reset` opens another run.

        """
        velocity = table("twist", action["twist"], 6)
        base = twist(velocity[:3], velocity[3:])
        obs = self._player.step(base, action["hand"], self._ticks, self._cameras)
        score = obs.score
        info: dict[str, Any] = {"tick": obs.tick, "events": obs.events, "is_success": obs.terminated}
        info |= self._privileged()
        if obs.done:
            result = self._player.result()
            info["result"], score = result_of(result, None), result.score
        info["score"] = score
        reward, self._score = score - self._score, score
        if self._shaping:
            info["shaping"] = shaping = self._player.shaping
            if self._shaping is True:
                reward += shaping
        self.observation = obs
        return self._arrays(obs), reward, obs.terminated, obs.truncated, info

    def render(self) -> Any:
        """Return an image (height, width, 3) of uint8, or open the server's page of its worlds."""
        if self.render_mode == "human":
            import webbrowser

            webbrowser.open(f"{self._url}/live")
            return None
        if self.render_mode != "rgb_array":
            return None
        world = self._player.client.world
        if world is not None:
            return world.pictures(self.film or "film", self.film_size, "film")["film"]
        camera = cast(str, self.film) or next(iter(self._player.cameras))
        return self._player.look(f"{camera}.rgb").cameras[camera].rgb

    def close(self) -> None:
        """End the session."""
        self._player.close()

    def _arrays(self, obs: Observation) -> Arrays:
        left = array([self._player.time_limit_s - obs.sim_time_s])
        # Copies: the caller may keep and change an observation.
        scene = {name: values.copy() for name, values in self._scene.items()}
        return padded(arrays_of(obs, self._player.channels), self._objects) | {"time_left": left} | scene
