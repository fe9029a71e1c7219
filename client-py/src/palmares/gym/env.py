"""A run as an episode, with observations and actions as dictionaries in SI units."""

from __future__ import annotations

from dataclasses import replace
from inspect import signature
from typing import TYPE_CHECKING, Any, cast

import gymnasium
from gymnasium import spaces
from msgspec import structs

from palmares.arguments import table, whole
from palmares.arrays import array
from palmares.client import LOCAL, Client
from palmares.errors import WorldFaultError
from palmares.gym.fields import (
    Arrays,
    action_space,
    arrays_of,
    arrays_of_scene,
    base_space,
    box,
    padded,
)
from palmares.gym.images import FILM, FILM_SIZE, spaces_of, view_of
from palmares.gym.infos import refuse_options, result_of
from palmares.gym.player import Player
from palmares.gym.seeds import any_seed, seed_of_episode
from palmares.gym.settings import OF_BATCH, Settings, settings_of, unexpected
from palmares.messages import Observation
from palmares.net.requests import names
from palmares.targets import joints, pose, twist
from palmares.wire import BaseTarget

if TYPE_CHECKING:
    from palmares.gym.starts import Starts
    from palmares.sim import World

REFUSED = OF_BATCH | {"observations", "goal", "reward", "observe", "action_scale"}
"""Settings that it does not have"""
CLIENTS = [name for name in signature(Client).parameters if name not in ("url", "training")]
"""Arguments of `Client` without `url` and `training`"""


class PalmaresEnv(gymnasium.Env[Arrays, Arrays]):
    """A run as an episode. The reward of a step is the change of the score, plus the shaped part if wanted.

    An action has, within the limits in `Welcome.specs`:

    - ``twist`` (6,): linear (m/s) and angular (rad/s) velocity of the base, world frame; or with
      ``base="pose"`` ``pose`` (7,): position (m) and quaternion x y z w that the base moves to; a quaternion
      of any length but zero; or with ``base="joints"`` ``joints`` (n,): positions of the joints of the task's
      arm, rad or m
    - ``hand`` (motors,): σ of every motor

    An observation has:

    - each channel of the hand (`HandInfo.channels`): ``base`` (13,), ``motors`` (motors, 4), ``wrist`` (6,),
      and, with a hand that has them, ``encoders`` (encoders,), ``touch`` (taxels, 3), ``acceleration`` (3,);
      docs/senses.md has their columns and units
    - ``time_left`` (1,): s until the time limit
    - ``arm`` (2, n): positions and velocities of the joints of the task's arm, if it has one
    - ``objects`` (objects, 13), with ``sensing="truth"``: as ``base``, for each
    - ``joints`` (2, joints), with ``sensing="truth"``: position (rad), velocity (rad/s)
    - ``object_kind`` (objects,), ``object_half_extents`` (objects, 3), ``object_mass`` (objects,), with
      ``sensing="truth"`` and a fixed number of `objects`: 0 sphere, 1 capsule, 2 cylinder, 3 box, 4 hull,
      5 several parts; m, in its own frame; kg
    - ``hand_drawn`` (numbers,), with ``sensing="truth"`` and where `randomise` draws the hand: the numbers of
      ``info["hand_drawn"]``
    - ``depth_NAME`` (height, width) of float32, for each ``NAME`` in `cameras`: m, 0 where there is no
      reading
    - ``rgb_NAME`` (height, width, 3) of uint8, for each ``NAME.rgb`` in `cameras`

    The number of objects is unknown before a run is opened. So the space of ``objects`` is a `Sequence` of
    any length; with the argument `objects` it is a `Box` of fixed shape, which most learners need.

    The info of a step has ``tick``, ``score``, ``events``, a list of the referee's `palmares.Event`, and
    ``is_success``: whether the task is complete. When the run is over, ``result`` has the count after the
    objects have settled: a dictionary of status, score, in_goal, outside, reason, fault, note, ticks,
    sim_time_s and state_hash, as in `palmares.Result`; with the last reward the sum is the final score. A
    world that fails ends its run: truncated, with the last observation before, and a `fault` in the result.
    The info of a reset has ``seed``, that of the scene. Where `randomise` draws the hand,
    ``info["hand_drawn"]`` has the drawn numbers (numbers,), in the order of `hand_numbers`, for a privileged
    critic.

    In this process an environment can be pickled and copied, also within an episode: the copy goes on with
    the same bits.

    Attributes:
        observation: The last observation, typed; ``None`` before the first `reset`.
        hand_numbers: Names of the hand's uncertain numbers that `randomise` draws for each episode.

    Args:
        url: Address of the server; ``None`` or ``local`` to play in this process.
        task: Name of the task, or the folder of your own. A server plays it if it was started with it.
        hand: Name of the hand; in this process also the path of your own.
        settings: The settings, without those of vectors and forms of observations.
        options: Fields of `Settings` and of its `training`; they replace those of `settings`. With `url` also
            arguments of `Client`, such as ``team``.

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
        settings: Settings | None = None,
        **options: Any,
    ) -> None:
        url = None if url == LOCAL else url
        chosen, client = settings_of(settings, options, REFUSED)
        mode, render_camera, sensing = chosen.render_mode, chosen.render_camera, chosen.sensing
        if mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: found {mode!r}; wanted None, 'rgb_array' or 'human'")
        if mode == "human" and url is None:
            raise ValueError("render_mode='human' opens a server's page: give the server's url as well")
        known = [] if url is None else CLIENTS
        unknown = [name for name in client if name not in known]
        if unknown:
            of_server = url is None and not REFUSED.intersection(unknown)
            where = "for a server only, with url" if of_server else "for other environments only"
            raise TypeError(unexpected(unknown, where, REFUSED, known))
        self.render_mode, self._url = mode, url
        if url is None:  # A process without a server has no page.
            self.metadata = {**self.metadata, "render_modes": ["rgb_array"]}
        elif chosen.render_size is not None or not isinstance(render_camera, str | None):
            raise ValueError("render_size and a View as render_camera need a world in this process: no url")
        self._player = Player(url, task, hand, sensing, chosen.noise, chosen.for_learners, **client)
        self._made = task, hand, chosen.noise or "none"
        self._shaping, self._base = chosen.shaping, chosen.base
        self._sensing = sensing
        self._ticks = whole("ticks", chosen.ticks, 1, self.client.welcome.limits.repeat)
        self._objects, self._cameras = chosen.objects, tuple(names(chosen.cameras))
        self._view = view_of(render_camera, self._player.cameras, local=url is None)
        self._render_size = chosen.render_size or (FILM_SIZE if self._view == FILM else None)
        step_s = self._ticks * self._player.tick_s
        self.metadata = {**self.metadata, "render_fps": max(1, round(1.0 / step_s))}
        self.hand_numbers = self._player.hand_numbers
        self._score = 0.0
        self._scene: Arrays = {}
        self._starts: Starts | None = None
        self._seeds: tuple[int, int] | None = None  # of the first episode, number of this one
        self.observation: Observation | None = None
        self.observation_space = cast(spaces.Space[Arrays], self._observations())
        motors = len(self._player.hand.motors)
        of_base = base_space(self._base, self._player.specs, self._player.arm)
        self.action_space = cast(spaces.Space[Arrays], action_space(self._base, of_base, motors))

    def _observations(self) -> spaces.Dict:
        objects = self._objects
        shapes = {channel.name: tuple(channel.shape) for channel in self._player.channels}
        shapes["time_left"] = (1,)
        if self._player.arm:
            shapes["arm"] = (2, len(self._player.arm))
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
        found |= spaces_of(self._cameras, self._player.cameras)
        return spaces.Dict(found)

    @property
    def fraction(self) -> float:
        """Part of the task's objects in the scene; a new value holds from the next `reset` on."""
        return self._player.training.fraction

    @fraction.setter
    def fraction(self, fraction: float) -> None:
        self._player.training = replace(self._player.training, fraction=fraction)

    @property
    def hidden(self) -> tuple[str, ...]:
        """Names of the hand's channels that no sensor reads."""
        return tuple(channel.name for channel in self._player.channels if channel.truth)

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

        Args:
            seed: Selects the scene.
            options: Only in this process. ``parameters``: numbers of this run, given rather than drawn, as of
                `palmares.sim.World.reset`. ``state``: a `palmares.sim.State` or `Snapshot`, or several of
                them, of which the scene's seed draws one; poses, velocities and motors of the run are those
                of it, and all other numbers those of the scene. They hold until another ``state`` is given;
                ``None`` ends them. ``info["start"]`` is the index of the drawn state.

        Raises:
            ValueError: An option is unknown, a state does not fit, or the seed is none, and nothing has
                changed; or a parameter is invalid, and no run is open.

        """
        refuse_options(options, ("parameters", "state"))
        starts = self._given_starts(options or {})
        super().reset(seed=seed, options=options)
        seeds = (any_seed() if seed is None else seed, 0)
        if seed is None and self._seeds is not None:
            seeds = self._seeds[0], self._seeds[1] + 1
        seed = seed_of_episode(*seeds)
        first = self.observation is None
        obs = self._player.open(seed, self._cameras, (options or {}).get("parameters"))
        self._seeds, self._starts, info = seeds, starts, {"seed": seed}
        if starts is not None:
            info["start"] = starts.drawn(seed)
            obs = self._player.place(starts, info["start"], self._cameras)
        found = len(self._player.scene.free)
        whole = self.fraction == 1.0
        if self._objects is not None and (found > self._objects or (whole and found < self._objects)):
            raise ValueError(f"the scene has {found} objects, not {self._objects}")
        fixed = self._sensing == "truth" and self._objects is not None
        self._scene = padded(arrays_of_scene(self._player.scene), self._objects) if fixed else {}
        if self._sensing == "truth" and self._player.hand_numbers:
            self._scene["hand_drawn"] = self._player.hand_drawn
        self.observation, self._score = obs, obs.score
        if first and self.render_mode == "human":
            self.render()
        return self._arrays(obs), info | self._privileged()

    def _given_starts(self, options: dict[str, Any]) -> Starts | None:
        """Return the states of the options, or those that hold."""
        if "state" not in options:
            return self._starts
        if options["state"] is None:
            return None
        if not self.client.is_local:
            raise ValueError(
                "options: found 'state' with url; only an environment of this process starts from states"
            )
        from palmares.gym.starts import starts_of

        return starts_of(options["state"], *self._made, self._player.training)

    def _privileged(self) -> dict[str, Any]:
        """Return what a critic may know and sensors do not."""
        return {"hand_drawn": self._player.hand_drawn} if self.hand_numbers else {}

    def step(self, action: Arrays) -> tuple[Arrays, float, bool, bool, dict[str, Any]]:
        """Advance the world under one action.

        Raises:
            ValueError: The action has a wrong shape, or is not finite; nothing has changed.
            BadActionError: The quaternion of a pose has no length; nothing has changed.

        """
        base: BaseTarget
        if self._base == "twist":
            velocity = table("twist", action["twist"], 6)
            base = twist(velocity[:3], velocity[3:])
        elif self._base == "pose":
            place = table("pose", action["pose"], 7)
            base = pose(place[:3], place[3:])
        else:
            base = joints(table("joints", action["joints"], len(self._player.arm)))
        try:
            obs, shaping = self._player.step(base, action["hand"], self._ticks, self._cameras), None
        except WorldFaultError:
            assert self.observation is not None
            ended = {"truncated": True, "reason": "world_fault", "events": []}
            obs, shaping = structs.replace(self.observation, **ended), 0.0
        info: dict[str, Any] = {
            "tick": obs.tick,
            "score": obs.score,
            "is_success": obs.terminated,
            "events": obs.events,
        }
        info |= self._privileged()
        if obs.done:
            result = self._player.result()
            info |= {"result": result_of(result), "tick": result.ticks, "score": result.score}
        reward, self._score = info["score"] - self._score, info["score"]
        if self._shaping:
            info["shaping"] = self._player.shaping if shaping is None else shaping
            if self._shaping is True:
                reward += info["shaping"]
        self.observation = obs
        return self._arrays(obs), reward, obs.terminated, obs.truncated, info

    def render(self) -> Any:
        """Return a picture (height, width, 3) of uint8, or open the server's page of its worlds."""
        if self.render_mode == "human":
            import webbrowser

            webbrowser.open(f"{self._url}/live")
            return None
        if self.render_mode != "rgb_array":
            return None
        if self.world is not None:
            return self.world.pictures(self._view, self._render_size, "film")["film"]
        return self._player.look(f"{self._view}.rgb").cameras[str(self._view)].rgb

    def close(self) -> None:
        """End the session; without a server `reset` begins another."""
        self._player.close()

    def _arrays(self, obs: Observation) -> Arrays:
        left = array([self._player.time_limit_s - obs.sim_time_s])
        # Copies: the caller may keep and change an observation.
        scene = {name: values.copy() for name, values in self._scene.items()}
        if obs.arm is not None:
            scene["arm"] = array([obs.arm.position, obs.arm.velocity])
        return padded(arrays_of(obs, self._player.channels), self._objects) | {"time_left": left} | scene
