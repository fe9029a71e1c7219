"""Where an environment plays: in a session of a server, or in this process."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, Protocol

import numpy as np

from palmares.client import Client
from palmares.messages import BaseTarget, Observation, Result
from palmares.scene import Scene

Sensing = Literal["sensors", "truth"]
Noise = Literal["none", "real"]


class Player(Protocol):
    """Runs of one task with one hand, one after the other.

    Attributes:
        shapes: Lengths of the hand's fields: ``motors``, ``joints``, ``encoders``, ``taxels``.
        cameras: Height, width and range (m) of each camera.
        limits: Largest speed (m/s) and angular speed (rad/s) of the base.

    """

    shapes: dict[str, int]
    cameras: dict[str, tuple[int, int, float]]
    limits: tuple[float, float]

    def open(self, seed: int, cameras: Iterable[str]) -> Observation:
        """Open a run; end an earlier one."""
        ...

    def step(
        self, base: BaseTarget, hand: np.ndarray[Any, Any], ticks: int, cameras: Iterable[str]
    ) -> Observation:
        """Advance the world."""
        ...

    def look(self, camera: str) -> Observation:
        """Take a picture; it may take a tick."""
        ...

    def result(self) -> Result:
        """End the run and count."""
        ...

    def close(self) -> None:
        """End."""
        ...

    @property
    def scene(self) -> Scene:
        """What stands in it."""
        ...

    @property
    def time_limit_s(self) -> float:
        """Longest run."""
        ...


class ServerPlayer:
    """Plays in a session of a server; see `Player`."""

    def __init__(
        self, url: str, task: str, hand: str, sensing: Sensing, noise: Noise | None, **client: Any
    ) -> None:
        self.client = Client(url, **client)
        welcome = self.client.welcome
        played, of_task = welcome.hand(hand), welcome.task(task).cameras
        self.shapes = {
            "motors": len(played.motors),
            "joints": len(played.joints),
            "encoders": len(played.encoders),
            "taxels": len(played.taxels),
        }
        taken = {camera.name for camera in of_task}
        self.cameras = {camera.name: (camera.height, camera.width, camera.far) for camera in of_task}
        for camera in played.cameras:
            name = f"hand_{camera.name}" if camera.name in taken else camera.name
            self.cameras[name] = (camera.height, camera.width, camera.far)
        ranges = [welcome.specs.action_field(name).range for name in ("base.linear", "base.angular")]
        self.limits = (ranges[0][1], ranges[1][1])
        self.time_limit_s = welcome.task(task).time_limit_s
        self._task, self._hand, self._sensing, self._noise = task, hand, sensing, noise

    def open(self, seed: int, cameras: Iterable[str]) -> Observation:
        """Open a run; stop an earlier one."""
        if self.client.tick is not None:
            self.client.stop()
        return self.client.reset(
            self._task, self._hand, sensing=self._sensing, noise=self._noise, seed=seed, cameras=cameras
        )

    def step(
        self, base: BaseTarget, hand: np.ndarray[Any, Any], ticks: int, cameras: Iterable[str]
    ) -> Observation:
        """Advance the world."""
        return self.client.step(base=base, hand=hand, repeat=ticks, cameras=cameras)

    def look(self, camera: str) -> Observation:
        """Take a picture, after one more tick: a server shows none between two."""
        return self.client.step(cameras=[camera])

    def result(self) -> Result:
        """Stop the run."""
        return self.client.stop()

    def close(self) -> None:
        """End the session."""
        self.client.close()

    @property
    def scene(self) -> Scene:
        """The scene of the run."""
        return self.client.scene


class WorldPlayer:
    """Plays in this process; see `Player`."""

    def __init__(self, task: str, hand: str, sensing: Sensing, noise: Noise | None) -> None:
        from palmares import sim
        from palmares._native import cameras, limits

        self._task, self._hand = task, hand
        self._sensing: Sensing = sensing
        self._noise: Noise = noise or "none"
        fields = sim.Batch(task, hand, 1, sensing=sensing, threads=1).fields
        self.shapes = {
            "motors": fields["motors"][0],
            "joints": fields["joints"][1] if "joints" in fields else 0,
            "encoders": fields["encoders"][0] if "encoders" in fields else 0,
            "taxels": fields["touch"][0] if "touch" in fields else 0,
        }
        self.cameras = {name: (height, width, far) for name, width, height, far in cameras(task, hand)}
        self.limits = limits()
        self.world: sim.World | None = None

    def _opened(self) -> Any:
        if self.world is None:
            raise RuntimeError("no run is open; call reset() first")
        return self.world

    def open(self, seed: int, cameras: Iterable[str]) -> Observation:
        """Open a run."""
        from palmares import sim

        self.world = sim.World(self._task, self._hand, seed, sensing=self._sensing, noise=self._noise)
        return self.world.observe(cameras=cameras)

    def step(
        self, base: BaseTarget, hand: np.ndarray[Any, Any], ticks: int, cameras: Iterable[str]
    ) -> Observation:
        """Advance the world."""
        obs: Observation = self._opened().step(base=base, hand=hand, repeat=ticks, cameras=cameras)
        return obs

    def look(self, camera: str) -> Observation:
        """Take a picture; nothing moves."""
        obs: Observation = self._opened().observe(cameras=[camera])
        return obs

    def result(self) -> Result:
        """End the run and count."""
        result: Result = self._opened().result()
        return result

    def close(self) -> None:
        """Forget the world."""
        self.world = None

    @property
    def scene(self) -> Scene:
        """The scene of the run."""
        scene: Scene = self._opened().scene
        return scene

    @property
    def time_limit_s(self) -> float:
        """Longest run."""
        limit: float = self._opened().run.time_limit_s
        return limit
