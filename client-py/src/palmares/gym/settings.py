"""Settings of environments: each declared once."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
from gymnasium.vector import AutoresetMode

from palmares.arguments import Noise, Sensing, check_sensing, is_real, one_of, short
from palmares.arrays import Array
from palmares.gym.goals import Goal
from palmares.gym.hooks import Observe, Reward
from palmares.targets import BaseKind
from palmares.training import Training

if TYPE_CHECKING:
    from palmares.sim import View

Observations: TypeAlias = Literal["fields", "groups", "goal"]
Shaping: TypeAlias = bool | Literal["info"]

OF_BATCH = frozenset({"threads", "max_episode_steps", "autoreset_mode"})
"""Settings of a `BatchEnv` only"""


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How an environment is played; every constructor also takes each of these as a keyword argument.

    The fields of `training` are keyword arguments, too, such as ``randomise=True`` and ``fraction=0.3``.

    Args:
        sensing: ``truth`` for the full state, ``sensors`` for the readings of the sensors alone.
        noise: ``none`` or ``real``: errors of the sensors. Left out, it is ``none``, and on a server the
            server's own.
        observations: Form of the observations of `FlatEnv` and `BatchEnv`.
        reward: Your own reward, in place of the task's: takes a `Transition` of N environments and returns N
            rewards. The score stays the task's.
        observe: Your own observation: takes the fields (N, …) and returns (N, n), which is the field
            ``observed``, the only one beside images. It is called once with zeros, to learn n.
        goal: Where an object is wanted, with ``observations="goal"``; 10 cm above its place when left out.
        cameras: Cameras with an image in every observation: ``NAME`` for its depth, ``NAME.rgb`` for colours.
            Colours of a `BatchEnv` need ``noise="none"``.
        ticks: Ticks per step, under the same action; in a single environment at most `Limits.repeat`, 100.
        base: What actions say of the base: ``twist``, ``pose`` or, in a task with an arm, ``joints``.
        action_scale: Part of its range that each number of an action of `FlatEnv` and `BatchEnv` has, above 0
            and at most 1: one for all, or one for each. With 0.25 the actions −1 and 1 are a quarter of the
            largest velocity.
        objects: Number of objects in every scene, in a single environment; another number is a `ValueError`
            at `reset`. A `FlatEnv` knows that of the task.
        shaping: ``True`` adds the shaped part of the task's rewards to the reward and puts it into
            ``info["shaping"]``; ``"info"`` only puts it there. docs/training.md explains it and the next.
        training: γ of the learner and how episodes vary. ``fraction`` can be set between episodes.
        render_mode: With ``rgb_array`` `render` returns a picture of each environment. With ``human``, only
            of a single environment on a server, the first `reset` opens the page of its worlds.
        render_camera: Camera of `render`: a name of task or hand, or in this process a `palmares.sim.View`.
            Left out, a place from which fingers and objects (of the first environment) are seen, and on a
            server the first camera.
        render_size: Width and height of the pictures, only in this process; those of the camera when left
            out, or 320 × 240.
        max_episode_steps: Steps after which an episode of a `BatchEnv` is truncated, as by gymnasium's
            `TimeLimit`; only the task's time limit when left out.
        threads: Threads that step a `BatchEnv`; one for each core when left out.
        autoreset_mode: The call that resets a run of a `BatchEnv` that is over: the next step
            (``NEXT_STEP``), the same step (``SAME_STEP``), or ``reset(options={"reset_mask": …})``
            (``DISABLED``).

    Raises:
        ValueError: A setting is invalid, or two of them contradict each other.

    """

    sensing: Sensing = "truth"
    noise: Noise | None = None
    observations: Observations = "fields"
    reward: Reward | None = None
    observe: Observe | None = None
    goal: Goal | None = None
    cameras: Sequence[str] = ()
    ticks: int = 10
    base: BaseKind = "twist"
    action_scale: float | Sequence[float] = 1.0
    objects: int | None = None
    shaping: Shaping = False
    training: Training = field(default_factory=Training)
    render_mode: str | None = None
    render_camera: str | View | None = None
    render_size: tuple[int, int] | None = None
    max_episode_steps: int | None = None
    threads: int | None = None
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP

    def __post_init__(self) -> None:
        one_of("observations", self.observations, get_args(Observations))
        one_of("base", self.base, get_args(BaseKind))
        check_sensing(self.sensing, "none" if self.noise is None else self.noise)
        object.__setattr__(self, "action_scale", _scale(self.action_scale))
        if self.shaping not in (True, False, "info"):
            raise ValueError(f"shaping: found {self.shaping!r}; wanted True, False or 'info'")
        if self.goal is not None and self.observations != "goal":
            raise ValueError(f"goal: found {self.goal}; wanted None, or observations='goal' with it")
        if self.observations == "goal" and self.shaping is True:
            raise ValueError("shaping: found True; wanted False or 'info': the reward is that of the goal")
        if self.observe is not None and self.observations != "fields":
            raise ValueError(
                f"observe: found a function with observations={self.observations!r}; wanted 'fields'"
            )
        if self.reward is not None and self.observations == "goal":
            raise ValueError(
                "reward: found a function with observations='goal', whose reward is that of the goal"
            )
        for name in ("reward", "observe"):
            if getattr(self, name) is not None and not callable(getattr(self, name)):
                raise ValueError(f"{name}: found {short(getattr(self, name))}; wanted a function or None")
        if self.observations == "groups" and self.sensing == "sensors":
            raise ValueError(
                "observations: found 'groups' with sensing='sensors'; wanted sensing='truth' for the critic; "
                "the policy has the sensors alone in any case"
            )
        if not isinstance(self.training, Training) or self.training.shaping:
            found = short(self.training)
            raise ValueError(f"training: found {found}; wanted a palmares.Training; shaping is a setting")

    @property
    def for_learners(self) -> Training | None:
        """The options of `palmares.sim`; ``None`` for runs as a server can play them, too."""
        training = replace(self.training, shaping=bool(self.shaping))
        return training if training.shaping or training.varies else None

    def scale(self, length: int) -> Array:
        """Return `action_scale` for each number of an action.

        Raises:
            ValueError: It has another length.

        """
        found = np.array(self.action_scale, dtype=np.float64)
        if found.shape not in ((), (length,)):
            raise ValueError(f"action_scale: found {len(found)} numbers; wanted one, or {length}")
        return np.full(length, found)


OF_RUNS = tuple(one.name for one in fields(Training) if one.name != "shaping")
NAMES = (*(one.name for one in fields(Settings)), *OF_RUNS)
"""All keyword arguments that are settings"""


def _scale(given: Any) -> float | tuple[float, ...]:
    """Return `action_scale` as a number, or as a tuple of them."""
    several = (given,) if is_real(given) else given
    if isinstance(several, Iterable) and not isinstance(several, str):
        found = tuple(several)
        if found and all(is_real(one) and 0.0 < one <= 1.0 for one in found):
            return float(given) if is_real(given) else tuple(float(one) for one in found)
    raise ValueError(
        f"action_scale: found {short(given)}; wanted a number above 0 and at most 1, or one for each number "
        "of an action"
    )


def settings_of(
    settings: Settings | None, options: dict[str, Any], refused: Collection[str]
) -> tuple[Settings, dict[str, Any]]:
    """Return the settings of an environment, and the keyword arguments that are none.

    Args:
        settings: Those given, or the defaults.
        options: Keyword arguments; they replace what is in `settings`.
        refused: Names of settings that this environment does not have.

    """
    base = settings or Settings()
    if not isinstance(base, Settings):
        raise TypeError(f"settings: found {settings!r}; wanted a palmares.gym.Settings")
    others = {name: value for name, value in options.items() if name not in NAMES or name in refused}
    others |= {name: getattr(base, name) for name in refused if getattr(base, name) != getattr(PLAIN, name)}
    own = {name: value for name, value in options.items() if name not in others}
    if own.get("shaping") == "apart":
        warnings.warn(
            'shaping="apart" is called shaping="info" now; the next version refuses "apart"',
            DeprecationWarning,
            stacklevel=3,
        )
        own["shaping"] = "info"
    runs = {name: own.pop(name) for name in OF_RUNS if name in own}
    if runs:
        own["training"] = replace(own.get("training", base.training), **runs)
    return replace(base, **own), others


PLAIN = Settings()
"""The defaults"""


def unexpected(
    given: Iterable[str], elsewhere: str, refused: Collection[str], more: Iterable[str] = ()
) -> str:
    """Return the text of a `TypeError` about unknown keyword arguments.

    Args:
        given: The arguments.
        elsewhere: Where they may be known.
        refused: Names of settings that this environment does not have.
        more: Names that it has beside the settings.

    """
    known = [*(name for name in NAMES if name not in refused), *more]
    near = [match for name in given for match in get_close_matches(name, known, 1)]
    hint = f"did you mean {' and '.join(map(repr, near))}? " if near else ""
    names, wanted = ", ".join(map(repr, given)), ", ".join(known)
    return f"unexpected keyword argument {names}: unknown, or {elsewhere}; {hint}wanted some of {wanted}"
