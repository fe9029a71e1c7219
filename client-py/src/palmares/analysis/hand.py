"""A hand: matrices, equilibria, grasps, closing, ejection, design."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palmares._native import HandModel
from palmares.analysis.contacts import Array, Contact, Numbers, pose_of
from palmares.analysis.design import Forces, Optimum, Postures, Variable
from palmares.analysis.grasp import Grasp
from palmares.analysis.linear import LinearHand, Tendons, fixed
from palmares.arguments import one_of, table
from palmares.reproducible import matmul, mean
from palmares.rotation import matrix_of
from palmares.sim import World
from palmares.views import Brief


@dataclass(frozen=True, repr=False)
class Rest(Brief):
    """A hand at rest."""

    q: Array
    """Coordinates"""
    tension: Array
    """Tensions"""
    base: Array
    """Pose of the base"""
    links: Array
    """Pose of every link in the world, links × 7: of the frame of its URDF link, also for the root"""
    method: str
    """``closed_form`` or ``newton``"""
    beyond_closed_form: tuple[str, ...]
    """Reasons why the closed form does not apply"""
    reactions: Array
    """Force on the link at each held point, N, world frame: of a spring of 1e5 N/m, at most 100 N"""
    gaps: Array
    """Distance of each held point from its place, m"""


@dataclass(frozen=True, repr=False)
class Inverse(Brief):
    """Where base and fingers are for points to be at places, of N goals."""

    base: Array
    """Pose of the base, (N, 7)"""
    q: Array
    """Coordinates, (N, n)"""
    sigma: Array
    """σ, (N, motors); as at the start along joints"""
    gaps: Array
    """Distance of each point from its place, (N, points), m; infinite for a goal whose hand never rests"""


@dataclass(frozen=True, repr=False)
class Closing(Brief):
    """A free hand while its motors wind. `progress` is 0 at the start and 1 at the end."""

    sigma: Array
    """σ, samples × motors"""
    q: Array
    """Coordinates, samples × n"""
    tension: Array
    """Tensions, samples × m"""
    order: tuple[str, ...]
    """Coordinates; the one that reaches the first fraction of its travel first comes first"""
    travel: Array
    """Motion of each of the hand's coordinates from start to end, rad or m"""
    reached: Array
    """Progress at which each of the coordinates reaches each fraction, n × fractions; NaN for those that
    stay"""


@dataclass(frozen=True, repr=False)
class Ejection(Brief):
    """What a closing hand does with objects, sizes × places."""

    fate: NDArray[np.str_]
    """``held``; ``ejected`` while it closes; ``dropped`` under the load; ``missed``; ``overlaps`` at the
    start; ``fault``"""
    moved: Array
    """Distance of the object from its place at the end, m"""
    links: NDArray[np.int64]
    """Number of links that touch it at the end"""


class Hand:
    """A hand, by its name or the path of your own: a folder, an archive or a URDF."""

    def __init__(self, name: str) -> None:
        self._native = HandModel(str(name))
        self.name: str = self._native.name
        self.links, self.coordinates, self.tendons, self.motors = map(tuple, self._native.names())
        self.q0, self.lower, self.upper = self._native.ranges()

    @property
    def E(self) -> Array:  # noqa: N802
        """Stiffness of the springs, n × n."""
        return self._native.springs()

    def R(self, q: Numbers | None = None) -> Array:  # noqa: N802
        """Return the moment arms of all tendons at q (default: q₀), m × n."""
        return self._native.arms(self.q0 if q is None else q)

    @property
    def W(self) -> Array:  # noqa: N802
        """Wound length of each tendon per σ of each motor, m × motors."""
        return self._native.winding()

    @property
    def K(self) -> Array:  # noqa: N802
        """Stiffness of each tendon, m."""
        return self._native.tendon_stiffness()

    def poses(self, q: Numbers, base: Numbers | None = None) -> Array:
        """Return the pose of every link in the world at coordinates q, links × 7."""
        return self._native.link_poses(pose_of("base", base), q)

    def rest(
        self,
        sigma: float | Numbers,
        *,
        base: Numbers | None = None,
        forces: Iterable[tuple[str, Numbers, Numbers]] = (),
        held: Iterable[tuple[str, Numbers, Numbers]] = (),
    ) -> Rest:
        """Return the equilibrium at σ (one for all motors, or one each).

        Args:
            sigma: Motor positions, 0 to 1.
            base: Pose of the base in the world.
            forces: Forces on links: name, point in the link's frame, force in the world's, N.
            held: Points of links that are held at a place: name, point in the link's frame, place in the
                world.

        Raises:
            ValueError: There is no equilibrium, or none was found.

        """
        pose = pose_of("base", base)
        found = self._native.rest(self._sigma(sigma), pose, list(forces), list(held))
        return Rest(base=np.array(pose), **found)

    def rests(self, sigma: ArrayLike, *, base: Numbers | None = None) -> dict[str, Array]:
        """Return the equilibria of the free hand at many σ, computed on all cores.

        Args:
            sigma: (N, motors), 0 to 1.
            base: Pose of the base in the world.

        Returns:
            ``q`` (N, n), ``tension`` (N, m), ``links`` (N, links, 7), as in `Rest`.

        Raises:
            ValueError: A wrong shape, or a σ without equilibrium.

        """
        given = np.asarray(sigma, dtype=np.float64)
        if given.ndim != 2:
            raise ValueError(f"sigma: found shape {given.shape}; wanted (N, {len(self.motors)})")
        return self._native.rests(np.ascontiguousarray(given), pose_of("base", base))

    def inverse(
        self,
        points: Sequence[tuple[str, Numbers]],
        places: ArrayLike,
        *,
        along: Literal["motors", "joints"] = "motors",
        base: ArrayLike | None = None,
        sigma: ArrayLike | None = None,
        move_base: bool = True,
    ) -> Inverse:
        """Bring points of links to places: inverse kinematics of N goals at once, on all cores.

        Levenberg and Marquardt's method from the start, then from postures all over the motors' ranges, until
        the points are at their places; the result is the nearest that was found.

        Args:
            points: Link's name and point in its frame, m.
            places: (N, points, 3), or (points, 3) for one goal, in the world, m.
            along: ``motors``: the hand closes by itself, its joints where the free hand rests; ``joints``:
                each joint moves within its range.
            base: Pose of the base at the start, (7,) or (N, 7); the world's when left out.
            sigma: σ at the start, (motors,) or (N, motors); 0.5 when left out.
            move_base: Whether the base moves, too.

        Raises:
            ValueError: There is no such link, or a wrong shape.

        """
        one_of("along", along, ("motors", "joints"))
        goals = np.asarray(places, dtype=np.float64)
        if goals.ndim == 2:
            goals = goals[np.newaxis]
        count = len(goals)
        goals = table("places", goals, count, len(points), 3)
        bases = np.array([0, 0, 0, 0, 0, 0, 1.0]) if base is None else np.asarray(base, dtype=np.float64)
        start = np.full(len(self.motors), 0.5) if sigma is None else np.asarray(sigma, dtype=np.float64)
        bases = table("base", np.broadcast_to(bases, (count, 7)), count, 7)
        start = table("sigma", np.broadcast_to(start, (count, len(self.motors))), count, len(self.motors))
        given = goals.tolist(), bases.tolist(), start.tolist()
        return Inverse(**self._native.inverse(list(points), *given, along, bool(move_base)))

    def linear(self, rest: Rest, tendons: Tendons = "compliant") -> LinearHand:
        """Return the linear behaviour of the free hand at an equilibrium: synergies and stiffness."""
        return LinearHand(**self._native.compliant(rest.q, rest.tension, fixed(tendons), None))

    def grasp(
        self,
        rest: Rest | float | Numbers,
        contacts: Sequence[Contact],
        *,
        object: Numbers | None = None,  # noqa: A002
        forces: Numbers | None = None,
    ) -> Grasp:
        """Return a grasp with virtual contacts.

        Args:
            rest: The posture: an equilibrium, or σ.
            contacts: Contacts on links, in the links' frames; with an empty link in the world, where no joint
                moves them.
            object: The object's frame in the world; by default the middle of the contacts, with the world's
                axes.
            forces: Contact forces λ of the posture. They add the geometric stiffness of hand and object.

        """
        if not contacts:
            raise ValueError("contacts: found none; wanted at least one")
        at = rest if isinstance(rest, Rest) else self.rest(rest)
        contacts = [contact if contact.link else self._on_root(contact, at) for contact in contacts]
        if object is None:
            probe = self._native.grasp(at.base, at.q, list(contacts), pose_of("object", None), None)
            object = mean(probe["points"])  # noqa: A001
        return Grasp(self._native, at.base, at.q, at.tension, contacts, pose_of("object", object), forces)

    def _on_root(self, contact: Contact, rest: Rest) -> Contact:
        """Return a contact in the world as one on the root link, which no joint moves."""
        turn = matrix_of(rest.links[0, 3:]).T
        return replace(
            contact,
            link=self.links[0],
            point=matmul(turn, np.array(contact.point) - rest.links[0, :3]),
            normal=matmul(turn, contact.normal),
            tangent=None if contact.tangent is None else matmul(turn, contact.tangent),
        )

    def close(
        self,
        start: float | Numbers = 0.0,
        end: float | Numbers = 1.0,
        *,
        steps: int = 50,
        fractions: Sequence[float] = (0.1, 0.5, 0.9),
        base: Numbers | None = None,
    ) -> Closing:
        """Return the closing of the free hand from one σ to another, and the order of its joints."""
        ends = self._sigma(start), self._sigma(end)
        return Closing(**self._native.close(pose_of("base", base), *ends, steps, list(fractions)))

    def ejection(
        self,
        shape: Literal["sphere", "cylinder", "box"],
        sizes: Sequence[float] | Sequence[Sequence[float]],
        places: Sequence[Numbers],
        *,
        sigma: float | Numbers = 1.0,
        mass: float = 0.1,
        friction: float = 0.8,
        close_s: float = 1.0,
        hold_s: float = 0.2,
        loads: Sequence[Numbers] = ((0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)),
    ) -> Ejection:
        """Simulate the closing on objects of several sizes at several places, on all cores.

        The object floats while the hand closes; then each load pulls on it. The base is at the world's
        origin.

        Args:
            shape: Kind of the object.
            sizes: Radius of a sphere; (radius, half length) of a cylinder along z; half lengths of a box, m.
            places: Positions, or poses, of its middle.
            sigma: σ at the end.
            mass: kg.
            friction: Coulomb coefficient of its surface.
            close_s: Time in which the motors close.
            hold_s: Time after that, and time of each load.
            loads: Forces, N.

        """
        played = [(shape, _three(size), pose_of("places", place)) for size in sizes for place in places]
        found = self._native.eject(
            played, mass, friction, close_s, hold_s, self._sigma(sigma), [_three(load) for load in loads]
        )
        form = (len(sizes), len(places))
        return Ejection(
            fate=np.array([fate for fate, _, _ in found]).reshape(form),
            moved=np.array([moved for _, moved, _ in found]).reshape(form),
            links=np.array([links for _, _, links in found], dtype=np.int64).reshape(form),
        )

    def optimise(
        self, variables: Sequence[Variable], goals: Sequence[Postures | Forces], *, steps: int = 200
    ) -> Optimum:
        """Change R, E and q₀ within bounds until the goals are met as well as possible.

        The hand itself stays as it is.

        The method is Levenberg and Marquardt's, projected on the bounds, with the gradients of the closed
        form.

        Raises:
            ValueError: A tendon's moment arms vary, or a variable or goal does not fit the hand.

        """
        return Optimum(**self._native.optimise(list(variables), list(goals), steps))

    def differences(
        self, variables: Sequence[Variable], goals: Sequence[Postures | Forces]
    ) -> tuple[Array, Array]:
        """Return the differences from goals now, and their gradients, differences × variables."""
        return self._native.differences(list(variables), list(goals))

    def _sigma(self, sigma: float | Numbers) -> list[float]:
        numbers = [float(x) for x in np.atleast_1d(sigma)]
        return numbers * len(self.motors) if len(numbers) == 1 else numbers

    def __repr__(self) -> str:
        return f"<Hand {self.name}: {len(self.coordinates)} coordinates, {len(self.tendons)} tendons>"


def held(world: World, object: str) -> Grasp:  # noqa: A002
    """Return the grasp of a world's hand on an object, with the contacts and forces of the last step.

    The object's frame has its axes, at its centre of mass.

    Raises:
        ValueError: There is no such object.

    """
    found = world.held(object)
    parts = ("links", "points", "normals", "models", "frictions", "arms", "tangents")
    contacts = [Contact(*row) for row in zip(*(found[part] for part in parts), strict=True)]
    forces: list[float] = []
    for contact, force, moment in zip(contacts, found["forces"], found["moments"], strict=True):
        forces += [*force, moment] if contact.model == "soft_finger" else [*force]
    hand = HandModel(world.hand)
    return Grasp(hand, found["base"], found["q"], found["tension"], contacts, found["object"], forces)


def _three(given: float | Numbers) -> list[float]:
    numbers = [float(x) for x in np.atleast_1d(given)]
    return [*numbers, *([0.0] * (3 - len(numbers)))]
