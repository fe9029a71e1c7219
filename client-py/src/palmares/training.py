"""Options for learners: shaped rewards and varied runs, only in this process."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from palmares import own_task
from palmares.arguments import is_real, short, whole

QUANTITIES = ("mass", "friction", "size", "sensor_noise", "hand_pose", "object_poses")
"""Quantities for which ``[training.randomise]`` of a ``task.toml`` may declare ranges"""
HAND = "hand"
"""All that is in ``[uncertain]`` of a ``hand.toml``; ``hand_NAME`` is one entry of it"""
MOST_SAMPLES = 1_000_000
MOST_DELAY = 100


@dataclass(frozen=True)
class Training:
    """Shaped rewards, and runs that differ from the task's; docs/training.md explains them.

    Without arguments a run is the task's own, bit for bit. Shaping changes no bit of a run either. A run with
    randomised quantities, fewer objects or a longer step has the status ``training`` and no replay.

    Args:
        shaping: Compute the shaped part of each step's reward, next to the change of the score.
        discount: γ of the learner, 0 to 1, which multiplies the potential after a step; that of the task when
            left out.
        randomise: Quantities drawn for every run: some of `QUANTITIES` from the ranges of the task, ``hand``
            or ``hand_NAME`` from those of the hand; ``True`` for all that the task declares. ``sensor_noise``
            needs sensors with ``noise="real"``.
        fraction: Part of the task's objects in the scene, above 0 and at most 1; at least one object is left.
        step_ms: Longest step of the integration, ms, from the task's own to 10: the tick is divided into the
            fewest equal steps that are no longer. Fewer steps are quicker and less exact.
        action_delay: Least and most ticks between an action and its arrival, 0 to 100; one number is drawn
            evenly for each run.
        action_noise: Standard deviation of a normal error of every tick in what arrives, 0 to 1: a part of
            the base's largest speeds, and of 1 for σ. Pose targets have none.
        hand_sample: ``(k, n)``: the hand's uncertain numbers of all runs are those of sample k, from 0 on, of
            a Latin hypercube of n samples; `palmares.evaluate` plays controllers over them.

    Raises:
        ValueError: An argument is out of range. A quantity that the task does not declare is a `ValueError`
            when its world is made.

    """

    shaping: bool = False
    discount: float | None = None
    randomise: bool | Sequence[str] = False
    fraction: float = 1.0
    hand_sample: tuple[int, int] | None = None
    step_ms: float | None = None
    action_delay: tuple[int, int] = (0, 0)
    action_noise: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.shaping, bool):
            raise ValueError(f"shaping: found {short(self.shaping)}; wanted True or False")
        if self.discount is not None and not (is_real(self.discount) and 0.0 <= self.discount <= 1.0):
            raise ValueError(f"discount: found {short(self.discount)}; wanted 0 to 1")
        if not (is_real(self.fraction) and 0.0 < self.fraction <= 1.0):
            raise ValueError(f"fraction: found {short(self.fraction)}; wanted a number above 0 and at most 1")
        object.__setattr__(self, "action_delay", _delay(self.action_delay))
        if not (is_real(self.action_noise) and 0.0 <= self.action_noise <= 1.0):
            raise ValueError(f"action_noise: found {short(self.action_noise)}; wanted 0 to 1")
        if self.step_ms is not None and not (is_real(self.step_ms) and self.step_ms > 0.0):
            raise ValueError(f"step_ms: found {short(self.step_ms)}; wanted a number of ms above 0")
        if self.hand_sample is not None:
            object.__setattr__(self, "hand_sample", _sample(self.hand_sample))
        if isinstance(self.randomise, bool):
            return
        if isinstance(self.randomise, str) or not isinstance(self.randomise, Iterable):
            raise ValueError(f"randomise: found {short(self.randomise)}; wanted True, or a sequence of names")
        object.__setattr__(self, "randomise", tuple(self.randomise))
        for name in self.randomise:
            of_hand = isinstance(name, str) and (name == HAND or name.startswith(f"{HAND}_"))
            if name not in QUANTITIES and not of_hand:
                known = ", ".join(QUANTITIES)
                raise ValueError(f"randomise: found {short(name)}; wanted some of {known}, hand, hand_NAME")

    @property
    def varies(self) -> bool:
        """Whether runs differ from the task's."""
        return (
            bool(self.randomise)
            or self.fraction < 1.0
            or self.hand_sample is not None
            or self.step_ms is not None
            or self.changes_actions
        )

    @property
    def changes_actions(self) -> bool:
        """Whether actions arrive late or with errors."""
        return self.action_delay != (0, 0) or self.action_noise > 0.0


def _delay(pair: Any) -> tuple[int, int]:
    """Return the least and the most ticks."""
    if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
        raise ValueError(f"action_delay: found {short(pair)}; wanted (least, most) ticks")
    most = whole("action_delay[1]", pair[1], 0, MOST_DELAY)
    return whole("action_delay[0]", pair[0], 0, most), most


def _sample(pair: Any) -> tuple[int, int]:
    """Return a sample and the number of samples."""
    if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
        raise ValueError(f"hand_sample: found {short(pair)}; wanted (k, n)")
    count = whole("hand_sample[1]", pair[1], 1, MOST_SAMPLES)
    return whole("hand_sample[0]", pair[0], 0, count - 1), count


def checked(training: Any, task: str = "") -> None:
    """Check the argument `training` for a task.

    Raises:
        ValueError: It is no `Training`, or the task of a user declares nothing to randomise.

    """
    if not isinstance(training, Training | None):
        raise ValueError(f"training: found {short(training)}; wanted a palmares.Training, or None")
    if training is not None and training.randomise is True:
        own = own_task.read(task)
        if own and not own.get("training", {}).get("randomise"):
            raise ValueError(f"randomise: {task} declares nothing: there is no [training.randomise] in it")
