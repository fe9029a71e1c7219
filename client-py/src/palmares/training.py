"""Options for learners: shaped rewards and varied runs, only in this process."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from palmares import own_task
from palmares.arguments import is_real, short

QUANTITIES = ("mass", "friction", "size", "sensor_noise", "hand_pose", "object_poses")
"""Quantities for which ``[training.randomise]`` of a ``task.toml`` may declare ranges"""


@dataclass(frozen=True)
class Training:
    """Shaped rewards, and runs that differ from the task's; docs/training.md explains them.

    Without arguments a run is the task's own, bit for bit. Shaping changes no bit of a run either. A run with
    randomised quantities or fewer objects has the status ``training`` and no replay.

    Args:
        shaping: Compute the shaped part of each step's reward, next to the change of the score.
        discount: γ of the learner, 0 to 1, which multiplies the potential after a step; that of the task when
            left out.
        randomise: Quantities drawn for every run from the ranges of the task: some of `QUANTITIES`, or
            ``True`` for all that the task declares. ``sensor_noise`` needs sensors with ``noise="real"``.
        fraction: Part of the task's objects in the scene, above 0 and at most 1; at least one object is left.

    Raises:
        ValueError: An argument is out of range. A quantity that the task does not declare is a `ValueError`
            when its world is made.

    """

    shaping: bool = False
    discount: float | None = None
    randomise: bool | Sequence[str] = False
    fraction: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.shaping, bool):
            raise ValueError(f"shaping: found {short(self.shaping)}; wanted True or False")
        if self.discount is not None and not (is_real(self.discount) and 0.0 <= self.discount <= 1.0):
            raise ValueError(f"discount: found {short(self.discount)}; wanted 0 to 1")
        if not (is_real(self.fraction) and 0.0 < self.fraction <= 1.0):
            raise ValueError(f"fraction: found {short(self.fraction)}; wanted a number above 0 and at most 1")
        if isinstance(self.randomise, bool):
            return
        if isinstance(self.randomise, str) or not isinstance(self.randomise, Iterable):
            raise ValueError(f"randomise: found {short(self.randomise)}; wanted True, or a sequence of names")
        object.__setattr__(self, "randomise", tuple(self.randomise))
        for name in self.randomise:
            if name not in QUANTITIES:
                known = ", ".join(QUANTITIES)
                raise ValueError(f"randomise: found {name!r}; wanted some of {known}")

    @property
    def varies(self) -> bool:
        """Whether runs differ from the task's."""
        return bool(self.randomise) or self.fraction < 1.0


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
