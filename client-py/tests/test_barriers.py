"""A hand that is driven into furniture at full speed stays on its side, however thin it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palmares import Observation, pose, twist

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

DOWN = [0.0, 1.0, 0.0, 0.0]
SIDEWAYS = [0.5, 0.5, 0.5, 0.5]
# Position of the inner wall, m.
WALL_X = 0.25


@pytest.mark.parametrize(
    ("task", "hand", "start", "rotation", "velocity", "axis", "least", "most"),
    [
        ("balls", "softhand", [-0.1, 0, 0.3], DOWN, [2, 0, 0], 0, 0.0, WALL_X),
        ("balls", "reflex", [-0.1, 0, 0.3], DOWN, [2, 0, 0], 0, 0.0, WALL_X),
        ("balls", "reflex", [0.35, 0.5, 0.3], DOWN, [0, 0, -2], 2, 0.1, 0.3),
        ("balls", "softhand", [0.35, 0.5, 0.3], DOWN, [0, 0, -2], 2, 0.1, 0.3),
        ("shelf", "reflex", [0, 0.6, 1.3], DOWN, [0, 0, -2], 2, 1.1, 1.3),
        ("shelf", "softhand", [-0.5, 0.6, 0.85], SIDEWAYS, [2, 0, 0], 0, -0.5, -0.4),
    ],
)
def test_no_hand_gets_through_furniture(
    task: str,
    hand: str,
    start: list[float],
    rotation: list[float],
    velocity: list[float],
    axis: int,
    least: float,
    most: float,
) -> None:
    world = sim.World(task, hand, seed=3)
    closed = [1.0] * len(world.step().hand.actuators)
    world.step(base=pose(start, rotation), hand=closed, repeat=200)
    obs = world.step(base=twist(velocity, [0, 0, 0]), hand=closed, repeat=200)
    assert least <= obs.hand.base.position[axis] <= most
    assert world.result().score == 0


URDF = """\
<robot name="plate">
  <link name="palm">
    <inertial>
      <mass value="0.5"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/>
    </inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="{size}"/></geometry></collision>
  </link>
  <link name="finger">
    <inertial>
      <mass value="0.02"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/>
    </inertial>
  </link>
  <joint name="j" type="revolute">
    <parent link="palm"/><child link="finger"/><origin xyz="0 0 0.02"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1.2" effort="1" velocity="10"/><dynamics damping="0.004"/>
  </joint>
  <transmission name="t">
    <type>transmission_interface/AdaptiveSynergyTransmission</type>
    <actuator name="m"/>
    <joint name="j">
      <mechanicalReduction>0.003</mechanicalReduction>
      <mechanicalElasticity>0.08</mechanicalElasticity>
      <offset>0</offset>
    </joint>
  </transmission>
</robot>
"""
SETTINGS = """\
name = "plate"
inertia = "from_geometry"
friction = 1.0
[motors.m]
scaling = 0.006
speed_limit = 2.0
[tendons.t]
stiffness = 1e5
force_limit = 60.0
"""


def lowest_object(obs: Observation) -> float:
    """Return the least height of an object's centre, m."""
    assert obs.truth is not None
    return float(np.asarray(obs.truth.positions)[:, 2].min())


@pytest.mark.parametrize("thickness_m", ["1e-9", "1e-3"])
@pytest.mark.parametrize("flat", [True, False])
def test_a_plate_of_any_thickness_is_stopped(tmp_path: Path, thickness_m: str, flat: bool) -> None:
    size = f"0.29 0.29 {thickness_m}" if flat else f"{thickness_m} 0.29 0.2"
    (tmp_path / "hand.urdf").write_text(URDF.format(size=size))
    (tmp_path / "hand.toml").write_text(SETTINGS)
    world = sim.World("balls", str(tmp_path), seed=3)
    before = lowest_object(world.step())
    world.step(base=pose([0, 0, 0.35], DOWN), hand=[0], repeat=200)
    obs = world.step(base=twist([0, 0, -2], [0, 0, 0]), hand=[0], repeat=200)
    # On the balls, 0.1 m high; on its edge it comes between them, down to the ground.
    lowest = obs.hand.base.position[2] - (0.1 if flat else 0.2)
    assert lowest > (0.09 if flat else -0.002)
    assert lowest_object(obs) > before - 0.002
