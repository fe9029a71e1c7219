"""Exported URDFs have the kinematics and the mass matrix of the hand in MuJoCo."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'palmares[dev]'")
from palmares import sim  # noqa: E402
from palmares._native import main as program  # noqa: E402
from palmares.analysis import Hand  # noqa: E402
from palmares.arrays import Array  # noqa: E402
from tests.test_export_mujoco import BUILT_IN, OWN  # noqa: E402

POSTURES = 3
MOST_M = 1e-9
MOST_RAD = 1e-9
MOST_OF_MASS = 1e-6
"""Part of the largest entry of the mass matrix: differences of poses give it here to about 1e-9."""

STEP_RAD = 1e-4


class Urdf:
    """The exported file, without the shapes, in MuJoCo and as its inertias."""

    def __init__(self, file: Path) -> None:
        self.robot = ElementTree.parse(file).getroot()
        for link in self.robot.iter("link"):
            for shape in [*link.findall("visual"), *link.findall("collision")]:
                link.remove(shape)
        settings = ElementTree.SubElement(ElementTree.SubElement(self.robot, "mujoco"), "compiler")
        # A link without mass between two hinges of a rolling joint has next to none.
        settings.attrib.update(fusestatic="false", boundmass="1e-12", boundinertia="1e-15")
        self.model = mujoco.MjModel.from_xml_string(ElementTree.tostring(self.robot, encoding="unicode"))
        self.data = mujoco.MjData(self.model)

    def laws(self) -> dict[str, tuple[str, float, float]]:
        """Return coordinate, ratio and offset of each joint that moves."""
        found: dict[str, tuple[str, float, float]] = {}
        waiting = [joint for joint in self.robot.findall("joint") if joint.get("type") != "fixed"]
        while waiting:
            for joint in waiting:
                name, mimic = joint.attrib["name"], joint.find("mimic")
                if mimic is None:
                    found[name] = (name, 1.0, 0.0)
                elif mimic.attrib["joint"] in found:
                    leader, ratio, offset = found[mimic.attrib["joint"]]
                    own, more = float(mimic.get("multiplier", 1)), float(mimic.get("offset", 0))
                    found[name] = (leader, own * ratio, own * offset + more)
            waiting = [joint for joint in waiting if joint.attrib["name"] not in found]
        return found

    def move(self, hand: Hand, q: Array) -> Array:
        """Move all joints to coordinates q, and return the derivatives of MuJoCo's by them."""
        slopes = np.zeros((self.model.nv, len(hand.coordinates)))
        for name, (leader, ratio, offset) in self.laws().items():
            joint, k = self.model.joint(name), hand.coordinates.index(leader)
            self.data.qpos[joint.qposadr[0]] = ratio * q[k] + offset
            slopes[joint.dofadr[0], k] = ratio
        mujoco.mj_forward(self.model, self.data)
        return slopes

    def mass_matrix(self, slopes: Array) -> Array:
        """Return MuJoCo's mass matrix for the coordinates of the hand."""
        whole = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, whole)
        reduced: Array = slopes.T @ whole @ slopes
        return reduced

    @cache  # noqa: B019
    def inertias(self, link: str) -> list[tuple[float, Array, Array]]:
        """Return mass, centre of mass and inertia of a link and of those fixed to it, in its frame."""
        found = []
        place, turn = {link: np.zeros(3)}, {link: np.eye(3)}
        fixed = [joint for joint in self.robot.findall("joint") if joint.get("type") == "fixed"]
        for _ in range(len(fixed) + 1):
            for joint in fixed:
                parent, end = (child(joint, tag).attrib["link"] for tag in ("parent", "child"))
                if parent in place and end not in place:
                    xyz, rotation = origin(joint)
                    place[end], turn[end] = place[parent] + turn[parent] @ xyz, turn[parent] @ rotation
        for element in self.robot.iter("link"):
            name, inertial = element.attrib["name"], element.find("inertial")
            if name not in place or inertial is None:
                continue
            com, axes = origin(inertial)
            mass, moments = float(child(inertial, "mass").attrib["value"]), child(inertial, "inertia").attrib
            about = np.array([[float(moments["i" + "".join(sorted(a + b))]) for a in "xyz"] for b in "xyz"])
            axes = turn[name] @ axes
            found.append((mass, place[name] + turn[name] @ com, axes @ about @ axes.T))
        return found


def child(element: ElementTree.Element, tag: str) -> ElementTree.Element:
    """Return the child with this tag."""
    found = element.find(tag)
    assert found is not None, f"{element.attrib} has no <{tag}>"
    return found


def origin(element: ElementTree.Element) -> tuple[Array, Array]:
    """Return place and rotation of an element's <origin>."""
    found = element.find("origin")
    numbers = {} if found is None else found.attrib
    xyz = np.array([float(x) for x in numbers.get("xyz", "0 0 0").split()])
    roll, pitch, yaw = (float(x) for x in numbers.get("rpy", "0 0 0").split())
    return xyz, about(2, yaw) @ about(1, pitch) @ about(0, roll)


def about(axis: int, angle: float) -> Array:
    """Return the rotation about an axis of the frame."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[i, i] = rotation[j, j] = np.cos(angle)
    rotation[j, i], rotation[i, j] = np.sin(angle), -np.sin(angle)
    return rotation


def matrices(poses: Array) -> tuple[Array, Array]:
    """Return places and rotation matrices of poses, x y z and quaternion x y z w."""
    x, y, z, w = poses[:, 3:].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return poses[:, :3], np.moveaxis(np.array(rows), 2, 0)


def mass_matrix(hand: Hand, urdf: Urdf, q: Array) -> Array:
    """Return the mass matrix from the hand's poses: the sum of m Jv'Jv + Jw'I Jw over its links."""
    n = len(q)
    _, turned = matrices(hand.poses(q))
    moved = [[matrices(hand.poses(q + sign * STEP_RAD * np.eye(n)[k])) for sign in (1, -1)] for k in range(n)]
    whole = np.zeros((n, n))
    for k, link in enumerate(hand.links):
        spins = []
        for (_, forward), (_, back) in moved:
            turn = (forward[k] - back[k]) / (2 * STEP_RAD) @ turned[k].T
            spins.append([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        jw = np.array(spins).T / 2
        for mass, com, inertia in urdf.inertias(link):
            points = [[place[k] + turn[k] @ com for place, turn in pair] for pair in moved]
            jv = np.array([(forward - back) / (2 * STEP_RAD) for forward, back in points]).T
            whole += mass * jv.T @ jv + jw.T @ turned[k] @ inertia @ turned[k].T @ jw
    return whole


def moves_alike(name: str, folder: Path) -> None:
    """Compare poses of all links, their masses, and the mass matrix at random angles."""
    assert program(["palmares", "hand", "export", name, "--format", "urdf", "--out", str(folder)]) == 0
    hand, urdf = Hand(name), Urdf(folder / "hand.urdf")
    for link in sim.describe_hand(name)["links"]:
        parts = urdf.inertias(link["name"])
        mass = sum(mass for mass, _, _ in parts)
        assert mass == pytest.approx(link["mass"], rel=1e-6), f"{name}: mass of {link['name']}"
        if mass > 0:
            com = sum(mass * com for mass, com, _ in parts) / mass
            assert np.allclose(com, link["com"], atol=1e-9), f"{name}: centre of mass of {link['name']}"
    base = urdf.model.body(hand.links[0])
    random = np.random.default_rng(1)
    for _ in range(POSTURES):
        q = random.uniform(np.maximum(hand.lower, -3), np.minimum(hand.upper, 3))
        slopes = urdf.move(hand, q)
        places, turns = matrices(hand.poses(q))
        root = urdf.data.xmat[base.id].reshape(3, 3)
        for k, link in enumerate(hand.links):
            body = urdf.model.body(link).id
            here = turns[0].T @ (places[k] - places[0])
            there = root.T @ (urdf.data.xpos[body] - urdf.data.xpos[base.id])
            assert np.abs(here - there).max() < MOST_M, f"{name}: place of {link}"
            off = turns[0].T @ turns[k] - root.T @ urdf.data.xmat[body].reshape(3, 3)
            assert np.abs(off).max() < MOST_RAD, f"{name}: rotation of {link}"
        ours, theirs = mass_matrix(hand, urdf, q), urdf.mass_matrix(slopes)
        off = np.abs(ours - theirs).max() / np.abs(theirs).max()
        assert off < MOST_OF_MASS, f"{name}: the mass matrix is {off} of its largest entry off"


@pytest.mark.parametrize("name", [*BUILT_IN, "reflex"])
def test_a_built_in_hand_moves_alike(name: str, tmp_path: Path) -> None:
    moves_alike(name, tmp_path / "exported")


@pytest.mark.parametrize("file", ["a_follower.urdf", "a_part_on_a_fixed_joint.urdf", "a_cable.xml"])
def test_an_imported_hand_moves_alike(file: str, tmp_path: Path) -> None:
    source = tmp_path / file
    source.write_text(OWN[file])
    assert program(["palmares", "hand", "import", str(source), "--out", str(tmp_path / "hand")]) == 0
    moves_alike(str(tmp_path / "hand"), tmp_path / "exported")
