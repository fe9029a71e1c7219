"""Runs of one task with one hand, one after another, on a server or in this process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from palmares import own_task
from palmares.arguments import Noise, Sensing
from palmares.arrays import Array, array
from palmares.channels import channels_of
from palmares.client import LOCAL, Client
from palmares.errors import BadRequestError
from palmares.gym.images import cameras_of
from palmares.messages import Observation, Result
from palmares.scene import Scene
from palmares.training import Training
from palmares.wire import BaseTarget, HandInfo, TaskInfo

if TYPE_CHECKING:
    from palmares.gym.starts import Starts


class Player:
    """Plays runs of a task with a hand.

    Attributes:
        client: The session.
        hand: The hand.
        channels: The channels of its observations.
        cameras: The cameras of task and hand by name.
        hand_numbers: Names of the hand's uncertain numbers that are drawn for each run.
        specs: Ranges of actions.
        arm: The joints of the task's arm; empty without one.
        time_limit_s: Longest run.
        tick_s: Length of a tick.

    """

    def __init__(
        self,
        url: str | None,
        task: str,
        hand: str,
        sensing: Sensing,
        noise: Noise | None,
        training: Training | None,
        **client: Any,
    ) -> None:
        self._made_with = {"url": LOCAL if url is None else url, "training": training, **client}
        self._closed = False
        self.client = self._connected()
        welcome = self.client.welcome
        played, rules = self._hand_info(hand), self._task_info(task)
        self.hand = played
        self.channels = [
            channel for channel in channels_of(played) if sensing == "truth" or not channel.truth
        ]
        self.cameras = cameras_of(rules, played)
        self.specs = welcome.specs
        self.arm = rules.arm
        self.time_limit_s, self.tick_s = rules.time_limit_s, rules.tick_s
        self._task, self._hand, self._noise = task, hand, noise
        self._sensing: Sensing = sensing
        self.hand_numbers: tuple[str, ...] = ()
        if training is not None:
            from palmares import sim

            self.hand_numbers = tuple(sim.hand_numbers(task, hand, training))

    def _connected(self) -> Client:
        client = Client(**self._made_with)
        # The action space is a box; its corners exceed the limits of the norm.
        client.clipping.mute()
        return client

    def _task_info(self, task: str) -> TaskInfo:
        welcome = self.client.welcome
        known = [known.name for known in welcome.tasks]
        if self.client.is_local and task not in known:
            from palmares import sim

            return sim.welcome(own_tasks=[task]).tasks[-1]
        return welcome.task(own_task.name_of(task, known))

    def _hand_info(self, hand: str) -> HandInfo:
        welcome = self.client.welcome
        if self.client.is_local and all(hand != known.name for known in welcome.hands):
            from palmares import sim

            return sim.welcome(own_hands=[hand]).hands[-1]
        return welcome.hand(hand)

    def open(
        self, seed: int, cameras: Iterable[str], parameters: Mapping[str, ArrayLike] | None = None
    ) -> Observation:
        """Open a run; close an earlier one.

        Raises:
            ValueError: A parameter is invalid, or the run would be on a server.

        """
        if self._closed and self.client.is_local:
            # As gymnasium's own environments; on a server a session that has ended has ended.
            self.client, self._closed = self._connected(), False
        if parameters or self.client.is_local:
            self.client.parameters = parameters
        if self.client.tick is not None:
            self.client.abandon()
        try:
            return self.client.reset(
                self._task, self._hand, sensing=self._sensing, noise=self._noise, seed=seed, cameras=cameras
            )
        except BadRequestError as refused:
            if parameters:
                raise ValueError(str(refused).removeprefix("bad_request: ")) from None
            raise

    def place(self, starts: Starts, index: int, cameras: Iterable[str]) -> Observation:
        """Put the run of this process into a recorded state; return the observation."""
        world = self.client.world
        assert world is not None
        world.set_state(starts.rows(index, world.state().objects))
        return world.observe(cameras=cameras)

    def step(
        self, base: BaseTarget, hand: np.ndarray[Any, Any], ticks: int, cameras: Iterable[str]
    ) -> Observation:
        """Advance the world."""
        return self.client.step(base=base, hand=hand, repeat=ticks, cameras=cameras)

    def look(self, camera: str) -> Observation:
        """Return an observation with an image, on a server; this takes one tick."""
        return self.client.step(cameras=[camera])

    def result(self) -> Result:
        """Close the run and return its result."""
        return self.client.stop()

    def close(self) -> None:
        """End the session. In this process the next `open` begins another."""
        self.client.close()
        self._closed = True

    @property
    def shaping(self) -> float:
        """The shaped part of the last step's reward; 0 without shaping."""
        world = self.client.world
        return 0.0 if world is None or world.shaping is None else world.shaping

    @property
    def hand_drawn(self) -> Array:
        """(numbers,), the drawn numbers of the current run's hand, in the order of `hand_numbers`."""
        world = self.client.world
        return array([] if world is None else list(world.hand_drawn.values()))

    @property
    def training(self) -> Training:
        """Options for learners in later episodes."""
        return self.client.training or Training()

    @training.setter
    def training(self, training: Training) -> None:
        self.client.training = training

    @property
    def scene(self) -> Scene:
        """The scene of the current or last run."""
        return self.client.scene
