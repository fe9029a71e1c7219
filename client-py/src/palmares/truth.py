"""The full state of a world, as typed structs. Units are SI; quaternions are x, y, z, w.

An observation has hundreds of numbers, and thousands of observations may come per second. So the numbers
are kept as the tables that came over the wire, and become arrays when they are first read.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, TypeAlias

import msgspec

from palmares.arrays import Array, array
from palmares.scene import Placed, Vec3, named


class BodyState(Placed, kw_only=True, gc=False):
    """Pose and velocity of a body in the world frame."""

    linear: Vec3
    """Velocity of the origin, m/s."""
    angular: Vec3
    """rad/s"""


class ObjectState(BodyState, kw_only=True, gc=False):
    """A free object."""

    id: int
    """Index in the scene."""
    name: str


Table: TypeAlias = bytearray | list[Any]
"""Numbers as they come over the wire: binary in MessagePack, lists in JSON; `array` reads both."""


class Joints(msgspec.Struct, kw_only=True, dict=True):
    """Joint coordinates of the hand, in its joint order."""

    _position: Table = msgspec.field(name="position")
    _velocity: Table = msgspec.field(name="velocity")

    @cached_property
    def position(self) -> Array:
        """Shape (n,), rad."""
        return array(self._position)

    @cached_property
    def velocity(self) -> Array:
        """Shape (n,), rad/s."""
        return array(self._velocity)


class Contact(msgspec.Struct, kw_only=True, gc=False):
    """A contact: force (N, world frame) on body `b` by body `a` at `position` (m)."""

    a: str
    b: str
    position: Vec3
    force: Vec3


class ObjectTables(msgspec.Struct, kw_only=True, gc=False):
    """The objects as they come over the wire; `Truth` gives them as arrays or one by one."""

    position: Table
    quat_xyzw: Table
    linear: Table
    angular: Table


class ContactTables(msgspec.Struct, kw_only=True, gc=False):
    """The contacts as they come over the wire; `Truth.contacts` gives them one by one."""

    a: list[str]
    b: list[str]
    position: Table
    force: Table


class Truth(msgspec.Struct, kw_only=True, dict=True):
    """The full state; only with ``sensing="truth"``. Each part is decoded when it is first read."""

    _objects: ObjectTables = msgspec.field(name="objects")
    joints: Joints
    """Joint coordinates of the hand."""
    _contacts: ContactTables = msgspec.field(name="contacts")
    _equilibrium: Table = msgspec.field(name="predicted_equilibrium")

    @cached_property
    def positions(self) -> Array:
        """Centres of all objects in scene order, shape (n, 3), m."""
        return array(self._objects.position, -1, 3)

    @cached_property
    def quats_xyzw(self) -> Array:
        """Orientations of all objects in scene order, shape (n, 4)."""
        return array(self._objects.quat_xyzw, -1, 4)

    @cached_property
    def linear(self) -> Array:
        """Velocities of all objects' origins, shape (n, 3), m/s."""
        return array(self._objects.linear, -1, 3)

    @cached_property
    def angular(self) -> Array:
        """Angular velocities of all objects, shape (n, 3), rad/s."""
        return array(self._objects.angular, -1, 3)

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
        positions, forces = (array(column, -1, 3).tolist() for column in (table.position, table.force))
        return [
            Contact(a=a, b=b, position=tuple(position), force=tuple(force))
            for a, b, position, force in zip(table.a, table.b, positions, forces, strict=True)
        ]

    @cached_property
    def predicted_equilibrium(self) -> Array:
        """Joint angles of the untouched hand at the same motor position, shape (n,), rad; may be empty."""
        return array(self._equilibrium)

    @property
    def names(self) -> list[str]:
        """Names of all objects in scene order."""
        return [self._name(k) for k in range(len(self.positions))]

    @property
    def contact_count(self) -> int:
        """How many contacts there are."""
        return len(self._contacts.a)

    def name_objects(self, names: Sequence[str]) -> None:
        """Set the names of the objects, in scene order; the client calls this."""
        self.__dict__["_names"] = names

    def _name(self, k: int) -> str:
        names: Sequence[str] = self.__dict__.get("_names", ())
        return names[k] if k < len(names) else f"object_{k}"
