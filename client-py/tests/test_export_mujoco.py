"""Exported hands rest in MuJoCo where they rest here."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'palmares[dev]'")
from palmares.analysis import Hand  # noqa: E402

BUILT_IN = [
    "allegro",
    "barrett_bh282",
    "ihy",
    "inspire_rh56",
    "leap",
    "pinch",
    "rbo2",
    "robotiq_2f85",
    "robotiq_3f",
    "shadow",
    "softhand",
    "softhand2",
    "softhand_skin",
    "softhand_strong",
    "yale_model_o",
    "yale_t42",
]
"""All but the ReFlex, whose moment arms change with the angle: its export says so."""

SIGMA = [0.02, 0.05, 0.1, 0.15, 0.2]
MOST_RAD = 5e-4

INERTIAL = (
    "<inertial><origin xyz='0 0 {z}'/><mass value='{mass}'/>"
    "<inertia ixx='2e-5' iyy='2e-5' izz='2e-5' ixy='0' ixz='0' iyz='0'/></inertial>"
)


def link(name: str, size: str, z: float = 0.0, mass: float = 0.05) -> str:
    """Return a link of one box."""
    box = f"<origin xyz='0 0 {z}'/><geometry><box size='{size}'/></geometry>"
    return f"<link name='{name}'>{INERTIAL.format(z=z, mass=mass)}<collision>{box}</collision></link>"


def joint(name: str, parent: str, child: str, xyz: str, more: str = "") -> str:
    """Return a hinge about x."""
    return (
        f"<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}'/><axis xyz='1 0 0'/><limit lower='-0.2' upper='1.2' effort='1' velocity='4'/>"
        f"<dynamics damping='0.01'/>{more}</joint>"
    )


def mount(parent: str, child: str, xyz: str) -> str:
    """Return a fixed joint."""
    return (
        f"<joint name='mount' type='fixed'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}'/></joint>"
    )


def urdf(content: str) -> str:
    """Return a robot with a palm."""
    return f"<robot name='own'>{link('palm', '0.06 0.08 0.03', mass=0.2)}{content}</robot>"


FINGER = link("a", "0.015 0.015 0.05", 0.03) + joint("j", "palm", "a", "0 0.03 0.02")
TIP = link("b", "0.012 0.012 0.03", 0.02)


def mjcf(tail: str, joints: str = "range='0 1.2' damping='0.02'") -> str:
    """Return a finger of three joints and a thumb."""
    geom = "<geom type='capsule' size='0.006' fromto='0 0 0.008 0 0 0.03' mass='0.02'/>"
    finger = ""
    for name, at in (("distal", "0 0 0.038"), ("middle", "0 0 0.038"), ("proximal", "0.02 0 0.02")):
        finger = f"<body name='{name}_link' pos='{at}'><joint name='{name}'/>{geom}{finger}</body>"
    joint = "<joint name='thumb' axis='0 -1 0'/>"
    thumb = f"<body name='thumb_link' pos='-0.02 0 0.02'>{joint}{geom}</body>"
    return (
        f"<mujoco model='own'><compiler angle='radian' autolimits='true'/>"
        f"<default><joint axis='0 1 0' {joints}/></default><worldbody><body name='palm'>"
        f"<geom type='box' size='0.03 0.05 0.015' mass='0.3'/>{finger}{thumb}</body></worldbody>"
        f"{tail}</mujoco>"
    )


def servos(*names: str) -> str:
    """Return servos of joints."""
    law = "kp='2' kv='0.05' ctrlrange='0 1.2' forcerange='-1 1'"
    all_of_them = "".join(f"<position name='m_{name}' joint='{name}' {law}/>" for name in names)
    return f"<actuator>{all_of_them}</actuator>"


SPRUNG = "range='-0.2 1.2' damping='0.02' stiffness='0.05'"
CABLE = (
    "<tendon><fixed name='cable'><joint joint='proximal' coef='0.01'/><joint joint='middle' coef='0.008'/>"
    "<joint joint='distal' coef='0.006'/></fixed>{more}</tendon>{equality}<actuator><position name='winch' "
    "tendon='cable' kp='2000' kv='5' ctrlrange='0 0.02' forcerange='0 20'/></actuator>"
)
OWN = {
    "a_finger_inside_the_palm.urdf": urdf(
        link("a", "0.015 0.015 0.06", 0.025) + joint("j", "palm", "a", "0 0.03 0.015")
    ),
    "two_joints.urdf": urdf(FINGER + TIP + joint("k", "a", "b", "0 0 0.06")),
    "a_follower.urdf": urdf(
        FINGER + TIP + joint("k", "a", "b", "0 0 0.06", "<mimic joint='j' multiplier='0.7' offset='0.1'/>")
    ),
    "a_part_on_a_fixed_joint.urdf": urdf(
        FINGER + link("cap", "0.05 0.07 0.02", 0.01) + mount("palm", "cap", "0 0 0.015")
    ),
    "a_nail_on_a_fixed_joint.urdf": urdf(
        FINGER + link("nail", "0.02 0.02 0.02") + mount("a", "nail", "0 0 0.01")
    ),
    "a_curve.xml": mjcf(
        "<equality><joint joint1='distal' joint2='middle' polycoef='0 0.3 0.4 0 0'/></equality>"
        + servos("proximal", "middle", "thumb")
    ),
    "a_narrow_range.xml": mjcf(
        "<tendon><fixed name='rolling' range='-0.001 0.001'><joint joint='middle' coef='0.007'/>"
        "<joint joint='distal' coef='-0.008'/></fixed></tendon>" + servos("proximal", "middle", "thumb")
    ),
    "a_tied_row.xml": mjcf(
        "<tendon><fixed name='row' range='-0.0002 0.0002'><joint joint='proximal' coef='0.01'/>"
        "<joint joint='middle' coef='-0.005'/><joint joint='distal' coef='-0.01'/></fixed></tendon>"
        + servos("proximal", "middle", "thumb")
    ),
    "a_cable.xml": mjcf(CABLE.format(more="", equality=""), SPRUNG),
    "two_fingers_on_a_cable.xml": mjcf(
        CABLE.format(
            more="<fixed name='other'><joint joint='thumb' coef='0.02'/></fixed>",
            equality="<equality><tendon tendon1='cable' tendon2='other'/></equality>",
        ),
        SPRUNG,
    ),
}


def program(*arguments: str) -> None:
    """Run the program; its exit code 2 says that the import has problems, which none of these has."""
    command = [sys.executable, "-m", "palmares", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def rests_alike(name: str, folder: Path) -> None:
    """Compare where all joints rest, wherever no finger touches another."""
    program("hand", "export", name, "--format", "mjcf", "--out", str(folder))
    hand, model = Hand(name), mujoco.MjModel.from_xml_path(str(folder / "hand.xml"))
    place = {joint: model.joint(joint).qposadr[0] for joint in hand.coordinates}
    compared = 0
    for sigma in SIGMA:
        data = mujoco.MjData(model)
        data.ctrl[:] = sigma
        mujoco.mj_step(model, data, round(4 / model.opt.timestep))
        if data.ncon > 0:
            continue
        compared += 1
        rest = hand.rest(sigma)
        found = np.array([data.qpos[place[joint]] for joint in hand.coordinates])
        off = np.abs(found - rest.q)
        worst = hand.coordinates[int(off.argmax())]
        assert off.max() < MOST_RAD, f"{name} at σ = {sigma}: {worst} is {off.max()} rad off"
    assert compared >= 3, f"{name} touches itself in MuJoCo at {len(SIGMA) - compared} of {len(SIGMA)} σ"


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_built_in_hand_rests_alike(name: str, tmp_path: Path) -> None:
    rests_alike(name, tmp_path / "exported")


@pytest.mark.parametrize("file", OWN)
def test_an_imported_hand_rests_alike(file: str, tmp_path: Path) -> None:
    source = tmp_path / file
    source.write_text(OWN[file])
    program("hand", "import", str(source), "--out", str(tmp_path / "hand"))
    rests_alike(str(tmp_path / "hand"), tmp_path / "exported")


def test_the_list_is_whole() -> None:
    folders = {path.parent.name for path in (Path(__file__).parents[2] / "models/hands").glob("*/hand.urdf")}
    assert folders - set(BUILT_IN) == {"reflex"}
