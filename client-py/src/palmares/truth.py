"""The full state of a world, as typed structs. Units are SI; quaternions are x, y, z, w.

An observation has hundreds of numbers, and thousands of observations may come per second. So the numbers
are kept as the tables that came over the wire, and become arrays when they are first read.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import msgspec

from palmares import wire
from palmares.arrays import Array, Vec3
from palmares.scene import Placed, named
from palmares.views import Brief, Rows, Viewed, first, vector


class BodyState(Viewed, Placed, wire.BodyState, kw_only=True):
    """Pose and velocity of a body in the world frame."""

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed body."""
        return type(self).__name__, [
            ("position", f"{vector(self.position)} m"),
            ("quat_xyzw", vector(self.quat_xyzw)),
            ("linear", f"{vector(self.linear)} m/s"),
            ("angular", f"{vector(self.angular)} rad/s"),
        ]


class ObjectState(BodyState, kw_only=True, gc=False):
    """A free object."""

    id: int
    """Index in the scene."""
    name: str

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed object."""
        return f"ObjectState of {self.name}", super()._lines()[1]


class Contact(Brief, msgspec.Struct, kw_only=True, gc=False):
    """A contact: force (N, world frame) on body `b` by body `a` at `position` (m)."""

    a: str
    b: str
    position: Vec3
    force: Vec3


class Truth(Viewed, wire.Truth, kw_only=True, dict=True):
    """The full state; only with ``sensing="truth"``. Each part is decoded when it is first read."""

    def _lines(self) -> tuple[str, Rows]:
        """Return the title and the lines of a printed truth."""
        places = zip(self.names, self.positions.tolist(), strict=True)
        rows = first([(name, f"{vector(at)} m") for name, at in places], "objects")
        rows.append(("joints", vector(self.joints.position.tolist()) + " rad"))
        pressed = [(f"{it.a} on {it.b}", f"{vector(it.force)} N") for it in self.contacts]
        return f"Truth of {len(self.positions)} objects, {len(pressed)} contacts", rows + first(
            pressed, "contacts"
        )

    @cached_property
    def positions(self) -> Array:
        """Centres of all objects in scene order, shape (n, 3), m."""
        return self._objects.position

    @cached_property
    def quats_xyzw(self) -> Array:
        """Orientations of all objects in scene order, shape (n, 4)."""
        return self._objects.quat_xyzw

    @cached_property
    def linear(self) -> Array:
        """Velocities of all objects' origins, shape (n, 3), m/s."""
        return self._objects.linear

    @cached_property
    def angular(self) -> Array:
        """Angular velocities of all objects, shape (n, 3), rad/s."""
        return self._objects.angular

    @cached_property
    def objects(self) -> list[ObjectState]:
        """All objects one by one, in scene order."""
        tables = (self.positions, self.quats_xyzw, self.linear, self.angular)
        states = zip(*(table.tolist() for table in tables), strict=True)
        return [
            ObjectState(
                id=k,
                name=self._name(k),
                position=tuple(position),
                quat_xyzw=tuple(quat),
                linear=tuple(linear),
                angular=tuple(angular),
            )
            for k, (position, quat, linear, angular) in enumerate(states)
        ]

    def object(self, name: str) -> ObjectState:
        """Return the object with this name, such as ``ball_3``; `KeyError` lists the names there are."""
        return named("object", name, self.objects)

    @cached_property
    def contacts(self) -> list[Contact]:
        """All contacts."""
        table = self._contacts
        positions, forces = table.position.tolist(), table.force.tolist()
        return [
            Contact(a=a, b=b, position=tuple(position), force=tuple(force))
            for a, b, position, force in zip(table.a, table.b, positions, forces, strict=True)
        ]

    @property
    def names(self) -> list[str]:
        """Names of all objects in scene order."""
        return [self._name(k) for k in range(len(self.positions))]

    @property
    def contact_count(self) -> int:
        """Number of contacts."""
        return len(self._contacts.a)

    def name_objects(self, names: Sequence[str]) -> None:
        """Set the names of the objects, in scene order; the client calls this."""
        self.__dict__["_names"] = names

    def _name(self, k: int) -> str:
        names: Sequence[str] = self.__dict__.get("_names", ())
        return names[k] if k < len(names) else f"object_{k}"
