"""Methods of observations, results and greetings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

from palmares import views
from palmares.scene import named

if TYPE_CHECKING:
    from palmares.messages import CameraImage, FieldSpec, HandInfo, Observation, Result, TaskInfo


class ObservationMethods:
    """Methods of `Observation`."""

    __slots__ = ()
    terminated: bool
    truncated: bool
    _cameras: list[CameraImage]

    @property
    def cameras(self) -> dict[str, CameraImage]:
        """The images of the cameras that were requested, by name."""
        return {image.camera: image for image in self._cameras}

    @property
    def done(self) -> bool:
        """True when the run cannot go on: stop it to get the result."""
        return self.terminated or self.truncated

    def __repr__(self) -> str:
        return views.text(*views.observation(cast("Observation", self)))

    def _repr_html_(self) -> str:
        return views.html(*views.observation(cast("Observation", self)))


class ResultMethods:
    """Methods of `Result`."""

    __slots__ = ()
    status: str

    @property
    def voided(self) -> bool:
        """True when the run does not count, by a fault of the server or a decision of the organizer."""
        return self.status == "voided"

    def __repr__(self) -> str:
        return views.text(*views.result(cast("Result", self)))

    def _repr_html_(self) -> str:
        return views.html(*views.result(cast("Result", self)))


class FieldSpecMethods:
    """Methods of `FieldSpec`."""

    __slots__ = ()
    minimum: float | None
    maximum: float | None

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest value of each entry; infinite where there is no limit."""
        return (
            -math.inf if self.minimum is None else self.minimum,
            math.inf if self.maximum is None else self.maximum,
        )


class SpecsMethods:
    """Methods of `Specs`."""

    __slots__ = ()
    action: list[FieldSpec]

    def action_field(self, name: str) -> FieldSpec:
        """Return a field of an action, such as ``base.linear``; `KeyError` lists the names there are."""
        return named("field of actions", name, self.action)


class WelcomeMethods:
    """Methods of `Welcome`."""

    __slots__ = ()
    tasks: list[TaskInfo]
    hands: list[HandInfo]

    def task(self, name: str) -> TaskInfo:
        """Return the constants of a task; `KeyError` lists the tasks there are."""
        return named("task", name, self.tasks)

    def hand(self, name: str) -> HandInfo:
        """Return motors and joints of a hand; `KeyError` lists the hands there are."""
        return named("hand", name, self.hands)
