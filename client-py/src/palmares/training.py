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


@dataclass(frozen=True)
class Training:
    """Shaped rewards, and runs that differ from the task's; docs/training.md explains them.

    Without arguments a run is the task's own, bit for bit. Shaping changes no bit of a run either. A run with
    randomised quantities or fewer objects has the status ``training`` and no replay.

    Args:
        shaping: Compute the shaped part of each step's reward, next to the change of the score.
        discount: γ of the learner, 0 to 1, which multiplies the potential after a step; that of the task when
            left out.
        randomise: Quantities drawn for every run: some of `QUANTITIES` from the ranges of the task, ``hand``
            or ``hand_NAME`` from those of the hand; ``True`` for all that the task declares. ``sensor_noise``
            needs sensors with ``noise="real"``.
        fraction: Part of the task's objects in the scene, above 0 and at most 1; at least one object is left.
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

    def __post_init__(self) -> None:
        if not isinstance(self.shaping, bool):
            raise ValueError(f"shaping: found {short(self.shaping)}; wanted True or False")
        if self.discount is not None and not (is_real(self.discount) and 0.0 <= self.discount <= 1.0):
            raise ValueError(f"discount: found {short(self.discount)}; wanted 0 to 1")
        if not (is_real(self.fraction) and 0.0 < self.fraction <= 1.0):
            raise ValueError(f"fraction: found {short(self.fraction)}; wanted a number above 0 and at most 1")
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
        return bool(self.randomise) or self.fraction < 1.0 or self.hand_sample is not None


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
