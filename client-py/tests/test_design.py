"""`palmares hand design`: known optima are found again, and the result is a hand that can be used."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("palmares.sim", reason="the package has no compiled part")

from palmares.analysis import Hand
from palmares.arrays import Array
from palmares.design import Candidate, Designed, find, maker, read
from palmares.design.goals import Measured, PosturesMissed
from palmares.design.hand_files import HandFiles
from palmares.design.making import copy_of, files_of, usable, write
from palmares.design.places import Place
from palmares.design.result import name_of, named
from palmares.design.search import folded, halton, search
from palmares.design.spans import toml_spans
from palmares.program import hand_design
from palmares.reproducible import dot
from palmares.sim import World

ROOT = Path(__file__).parents[2]
T42 = ROOT / "models/hands/yale_t42"
FINGER = """
[[goals]]
kind = "forces"
name = "at {angle}"
sigma = [0.9, 0.0]
posture = [0.3, {angle}, -0.8, 0.1]
contacts = [
    {{ link = "left_proximal", point = [0, 0, {k1}], normal = [0, -1, 0] }},
    {{ link = "left_distal", point = [0, 0, {k2}], normal = [0, -1, 0] }},
]
"""
RADIUS = """
[[unknowns]]
name = "distal radius"
in = "arm.left_tendon.left_distal_joint"
range = [0.001, 0.01]
"""
K1, K2, L1, R1 = 0.03, 0.025, 0.062, 0.0105


def of_finger(folder: Path, text: str, evaluations: int) -> Candidate:
    """Return the best design of a T42 whose springs are negligible against its tendons."""
    shutil.copytree(T42, folder / "finger")
    files = files_of(folder / "finger")
    for joint in ("left_proximal_joint", "left_distal_joint", "right_proximal_joint", "right_distal_joint"):
        files = Place(f"stiffness.{joint}").write(files, 1e-8)
    write(files, folder / "finger")
    (folder / "design.toml").write_text('hand = "finger"\n' + text)
    with maker(read(folder / "design.toml")) as made:
        return find(made, evaluations).ranked[0]


def forces(r1: float, r2: float, l1: float, angle: float) -> tuple[float, float]:
    """Return the forces of both phalanges for a tension of 1 N, without springs.

    Birglen, Laliberté and Gosselin, *Underactuated Robotic Hands* (2008), section 3.2.
    """
    f2 = r2 / K2
    return (r1 - (K2 + l1 * math.cos(angle)) * f2) / K1, f2


def test_equal_forces_of_two_phalanges_need_the_ratio_of_the_closed_form(tmp_path: Path) -> None:
    angle = 0.6
    both = RADIUS.replace("distal", "proximal").replace("[0.001, 0.01]", "[0.008, 0.013]") + RADIUS
    best = of_finger(tmp_path, both + FINGER.format(angle=angle, k1=K1, k2=K2), 80)
    found = best.values[1] / best.values[0]
    # f1 = f2 solved for r2/r1.
    expected = K2 / (K1 + K2 + L1 * math.cos(angle))
    assert forces(1.0, expected, L1, angle)[0] == pytest.approx(forces(1.0, expected, L1, angle)[1])
    print(f"ratio of radii: found {found:.5f}, expected {expected:.5f}")
    assert found == pytest.approx(expected, rel=0.02)


def test_a_length_is_that_of_the_closed_form(tmp_path: Path) -> None:
    angle, r2 = 0.6, 0.0055
    proximal = '[[unknowns]]\nname = "proximal"\nin = "length.left_proximal"\nrange = [0.01, 0.09]\n'
    near = FINGER.format(angle=angle, k1=0.01, k2=K2)
    best = of_finger(tmp_path, proximal + near, 40)
    # Contacts stay at their points of the links; f1 = f2 solved for l1.
    expected = (K2 * R1 / r2 - 0.01 - K2) / math.cos(angle)
    print(f"length: found {best.values[0]:.5f} m, expected {expected:.5f} m")
    assert best.values[0] == pytest.approx(expected, rel=0.02)


def test_the_compromise_of_two_postures_is_that_of_a_fine_grid(tmp_path: Path) -> None:
    angles = (0.1, 1.2)
    goals = "".join(FINGER.format(angle=angle, k1=K1, k2=K2) for angle in angles)
    best = of_finger(tmp_path, RADIUS + goals, 40)

    def missed(r2: float) -> float:
        cost = 0.0
        for angle in angles:
            both = forces(R1, r2, L1, angle)
            size = math.sqrt(dot(both, both) / 2)
            cost += math.sqrt(((both[0] / size - 1) ** 2 + (both[1] / size - 1) ** 2) / 2)
        return cost

    grid = np.linspace(0.001, 0.01, 20001).tolist()
    expected = min(grid, key=missed)
    print(f"radius: found {best.values[0]:.6f} m, expected {expected:.6f} m")
    assert best.values[0] == pytest.approx(expected, rel=0.02)
    assert best.score == pytest.approx(-missed(best.values[0]), abs=1e-3)


JAW = """<robot name="jaw">
  <link name="palm">
    <inertial><mass value="0.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><origin xyz="0 0 0.01"/><geometry><box size="0.04 0.1 0.02"/></geometry></collision>
  </link>{}
</robot>"""
SIDE = """
  <link name="{name}">
    <inertial><mass value="0.05"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><origin xyz="0 0 0.04"/><geometry><box size="0.03 0.01 0.07"/></geometry></collision>
  </link>
  <joint name="{name}_slide" type="prismatic"> <!-- kept -->
    <parent link="palm"/><child link="{name}"/><origin xyz="0 {y} 0.02"/><axis xyz="0 {way} 0"/>
    <limit lower="0" upper="0.04" effort="5" velocity="0.1"/>
  </joint>"""
OF_JAW = """
hand = "jaw"
[[unknowns]]
name = "effort"
in = ["joint.left_slide.limit.effort", "joint.right_slide.limit.effort"]
range = [2, 20]
[[goals]]
kind = "pull_out"
shape = "box"
sizes = [[0.02, 0.02, 0.02]]
places = [[0, 0, 0.07]]
directions = [[0, 0, 1]]
most = 30
friction = 0.5
close_s = 0.5
at_most = 12.3
weight = 1
"""


def jaw(folder: Path) -> Path:
    """Write two parallel jaws and a design of them; return the design file."""
    (folder / "jaw").mkdir()
    sides = SIDE.format(name="left", y=0.05, way=-1) + SIDE.format(name="right", y=-0.05, way=1)
    (folder / "jaw/hand.urdf").write_text(JAW.format(sides))
    settings = 'name = "jaw"\ninertia = "from_geometry"\nservo_joints = "all"\nfriction = 0.5\n'
    (folder / "jaw/hand.toml").write_text(settings)
    (folder / "design.toml").write_text(OF_JAW)
    return folder / "design.toml"


def test_the_pull_out_force_of_two_jaws_is_that_of_coulomb_and_a_limit_is_kept(tmp_path: Path) -> None:
    with maker(read(jaw(tmp_path))) as made:
        resolution = 30 / 2**6
        # Two faces with the force F each: the object slips above 2 μ F, with μ of 0.5 above F.
        assert made.before.measured[0].value == pytest.approx(5.0, abs=resolution)
        found = find(made, 24)
        best = found.ranked[0]
    print(f"effort {best.values[0]} N, pull-out {best.measured[0].value} N")
    assert best.missed == 0.0
    # The largest load of the bisection below the limit, and the force that holds it.
    largest = math.floor(12.3 / resolution) * resolution
    assert best.measured[0].value == largest
    assert best.values[0] == pytest.approx(largest, abs=1.5 * resolution)
    assert any(it.missed > 0.0 and it.score > best.score for it in found.tried)


HELD = """
hand = "jaw"
[[unknowns]]
name = "length"
in = ["length.left", "length.right"]
range = [0.06, 0.09]
[[goals]]
kind = "epsilon"
shape = "box"
size = [0.02, 0.02, 0.02]
places = [[0, 0, {height}]]
friction = 0.5
close_s = 0.5
"""


@pytest.mark.parametrize(("height", "held"), [(0.075, True), (0.15, False)])
def test_epsilon_is_that_of_flat_jaws_and_0_out_of_reach(tmp_path: Path, height: float, held: bool) -> None:
    jaw(tmp_path).write_text(HELD.format(height=height))
    with maker(read(tmp_path / "design.toml")) as made:
        epsilon = made.before.measured[0].value
    # Of a total normal force of 1 N, friction of μ = 0.5 resists at most 0.5 N along the faces.
    assert 0.1 < epsilon <= 0.5 if held else epsilon == 0.0


DRAWN = """
hand = "jaw"
[[unknowns]]
name = "effort"
in = ["joint.left_slide.limit.effort", "joint.right_slide.limit.effort"]
range = [2, 20]
[[goals]]
kind = "probability"
objects = "056_tennis_ball"
tries = 48
[[goals]]
kind = "probability"
name = "open"
objects = "056_tennis_ball"
tries = 4
closed = [0, 0]
"""


def test_some_drawn_grasps_last_and_none_of_a_hand_that_stays_open(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    jaw(tmp_path).write_text(DRAWN)
    with maker(read(tmp_path / "design.toml")) as made:
        closing, never = (it.value for it in made.before.measured)
    assert 0.0 < closing <= 1.0
    assert (48 * closing).is_integer()
    assert never == 0.0


def design_of_the_guide() -> str:
    """Return the design file of docs/analysis.md."""
    found = re.findall(r"```toml\n(hand = .*?)```", (ROOT / "docs/analysis.md").read_text(), re.DOTALL)
    assert len(found) == 1
    return str(found[0])


def palmares(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "palmares", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, encoding="utf-8")


def test_the_guide_designs_a_t42_that_is_better_than_a_grid_and_can_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "design.toml").write_text(design_of_the_guide())
    design = read(tmp_path / "design.toml")
    out = tmp_path / "my-hand"
    options = ["--out", str(out), "--evaluations", "10", "--quiet"]
    assert hand_design.main([str(design.path), *options]) == 0
    said = capsys.readouterr().out
    # The guide prints the same with more evaluations.
    assert "fates                             0.66667            1  more, weight 1" in said
    assert said.splitlines()[-2] in (ROOT / "docs/analysis.md").read_text()
    # Nine ratios of the pulleys, by Hand.ejection itself.
    goal = tomllib.loads(design_of_the_guide())["goals"][0]
    assert goal["rpy"] == pytest.approx([0, math.pi / 2, 0])
    places = [[*place, 0, math.sqrt(0.5), 0, math.sqrt(0.5)] for place in goal["places"]]
    parts = []
    with maker(replace(design, hand=str(T42))) as made:
        unknown = design.unknowns[0]
        for radius in np.linspace(unknown.low, unknown.high, 9).tolist():
            files = made.files
            for place in unknown.places:
                files = place.write(files, radius)
            offset = 0.301923 - 0.1 * (radius - 0.0055) / 0.026
            for motor in ("left_motor", "right_motor"):
                files = Place(f"motors.{motor}.offset").write(files, offset)
            write(files, made.folder)
            fate = (
                Hand(str(made.folder))
                .ejection(
                    goal["shape"],
                    goal["sizes"],
                    places,
                    loads=goal["loads"],
                    close_s=goal["close_s"],
                    hold_s=goal["hold_s"],
                )
                .fate
            )
            parts.append(float((fate == "held").mean()))
    best = made.design.goals[0].measure(str(out)).value
    print(f"held: grid {[round(it, 3) for it in parts]}, before {made.before.score:.3f}, design {best:.3f}")
    assert best >= max(parts) > made.before.score
    # The folder is a hand.
    checked = palmares("hand", "check", str(out))
    assert checked.returncode == 0, checked.stdout + checked.stderr
    world = World("grasp", str(out), seed=1)
    assert world.step(hand=[0.3, 0.3], repeat=3).tick == 3
    assert Hand(str(out)).name == "my-hand"
    page = (out / "README.md").read_text()
    assert f"{best:.4g}" in page
    assert "--evaluations 10" in page
    assert (out / "design.toml").read_text() == design.path.read_text()
    assert (out / "design.svg").read_text().count("<rect") > 2 * 12
    # Comments and all other numbers stay.
    assert "# housings; pads below" in (out / "hand.toml").read_text()
    radius = Place("arm.left_tendon.left_distal_joint").read(files_of(out))
    wound = 0.026 * files_of(out).settings["motors"]["left_motor"]["offset"]
    assert radius != 0.0055
    assert Hand(str(out)).R() @ Hand(str(out)).q0 == pytest.approx([-wound, -wound], abs=1e-7)
    # It does not write over a hand.
    assert hand_design.main([str(design.path), "--out", str(out)]) == 1
    assert "is not empty" in capsys.readouterr().err


TOML = """# first
name = "a" # "x = 1"
'quoted key'.b = 1_000
list = [
  [1, 2], # two
  ["]", { d = -3.5e-3, "e f" = true }],
]
text = \"\"\"a = [ " \\\"\"\" \"\"\"
day = 1979-05-27 07:32:00

[[tactile]]
size = [0.1, 0.2]
[tactile.deep]
x = inf
[[tactile]]
size = [0.3, 0.4]
[motors] # comment
m = { scaling = 0.026, offset = 1 }
"""


def at(tree: object, path: tuple[str | int, ...]) -> object:
    for key in path:
        tree = tree[key]  # type: ignore[index]
    return tree


def test_every_value_of_a_toml_text_is_found_and_can_be_replaced() -> None:
    tree = tomllib.loads(TOML)
    spans = toml_spans(TOML)
    assert len(spans) == 16
    for path, (first, last) in spans.items():
        assert tomllib.loads(f"x = {TOML[first:last]}")["x"] == at(tree, path)
        other = TOML[:first] + "12345" + TOML[last:]
        assert at(tomllib.loads(other), path) == 12345
    path = ("tactile", 1, "size", 0)
    assert HandFiles(TOML, b"").toml_with(path, "9").toml == TOML.replace("[0.3,", "[9,")


@pytest.mark.parametrize("hand", ["softhand", "pinch", "ihy", "robotiq_3f"])
def test_the_texts_of_built_in_hands_are_walked_whole(hand: str) -> None:
    text = (ROOT / f"models/hands/{hand}/hand.toml").read_text()
    tree = tomllib.loads(text)

    def count(it: object) -> int:
        if isinstance(it, dict):
            return sum(map(count, it.values()))
        return sum(map(count, it)) if isinstance(it, list) else 1

    spans = toml_spans(text)
    assert len(spans) == count(tree) > 5
    assert all(tomllib.loads(f"x = {text[a:b]}")["x"] == at(tree, path) for path, (a, b) in spans.items())


def of_t42() -> HandFiles:
    return HandFiles((T42 / "hand.toml").read_text(), (T42 / "hand.urdf").read_bytes())


@pytest.mark.parametrize(
    ("place", "before"),
    [
        ("arm.left_tendon.left_distal_joint", 0.0055),
        ("stiffness.left_distal_joint", 0.2),
        ("rest.right_proximal_joint", -0.8),
        ("length.left_proximal", 0.062),
        ("length.left_distal", 0.045),
        ("joint.left_proximal_joint.origin.y", 0.0385),
        ("-joint.right_proximal_joint.origin.y", 0.0385),
        ("joint.left_distal_joint.limit.upper", 1.6),
        ("joint.left_distal_joint.dynamics.damping", 0.01),
        ("link.left_distal.mass", 0.02),
        ("motors.left_motor.scaling", 0.026),
        ("tendons.left_tendon.force_limit", 80.0),
        ("links.left_distal.friction", 1.2),
        ("uncertain.distal_arms.factor.1", 1.45),
    ],
)
def test_a_number_is_read_and_replaced_and_nothing_else(place: str, before: float) -> None:
    files, there = of_t42(), Place(place)
    assert there.read(files) == pytest.approx(before)
    assert there.write(files, there.read(files)) is files
    other = there.write(files, 0.05)
    assert there.read(other) == pytest.approx(0.05)
    changed = [(a, b) for a, b in zip(lines(files), lines(other), strict=True) if a != b]
    assert 1 <= len(changed) <= (8 if "length" in place else 1)


def lines(files: HandFiles) -> list[str]:
    return (files.toml + files.urdf.decode()).splitlines()


def test_a_longer_link_moves_what_is_on_it_and_has_the_inertia_of_even_density() -> None:
    files = of_t42()
    longer = Place("length.left_proximal").write(files, 0.124)
    assert Place("joint.left_distal_joint.origin.z").read(longer) == pytest.approx(0.124)
    assert Place("link.left_proximal.mass").read(longer) == pytest.approx(0.056)
    link = longer.robot.first("link", name="left_proximal")
    assert link is not None
    box = link.all("collision")[1]
    assert [it.attributes for it in (*box.all("origin"), *box.all("geometry")[0].children)] == [
        {"xyz": "0.0 -0.009 0.06"},
        {"size": "0.018 0.004 0.08"},
    ]
    # A box a × b × c of even density about its middle: m (b² + c²)/12, …
    a, b, c, m = 0.02, 0.014, 0.062, 0.03
    inertia = f'ixx="{m * (b**2 + c**2) / 12}" ixy="0" ixz="0" '
    inertia += f'iyy="{m * (a**2 + c**2) / 12}" iyz="0" '
    inertia += f'izz="{m * (a**2 + b**2) / 12}"'
    text = re.sub(rb'ixx="1e-6".*?izz="1e-6"', inertia.encode(), files.urdf)
    made = Place("length.left_proximal").write(HandFiles(files.toml, text), 2 * c)
    link = made.robot.first("link", name="left_proximal")
    assert link is not None
    found = link.all("inertial")[0].all("inertia")[0].attributes
    m, c = 2 * m, 2 * c
    for name, expected in (("ixx", b**2 + c**2), ("iyy", a**2 + c**2), ("izz", a**2 + b**2)):
        assert float(found[name]) == pytest.approx(m * expected / 12)


def test_a_shape_that_is_turned_by_a_right_angle_is_longer_along_the_link_and_no_other_can_be() -> None:
    files = of_t42()
    straight = b'<origin xyz="0 0 0.031"/>\n      <geometry><box size="0.02 0.014 0.056"/></geometry>'
    assert straight in files.urdf
    for roll, size in (("1.5707963267948966", "0.02 0.056 0.014"), ("0.3", "0.02 0.014 0.056")):
        turned = f'<origin xyz="0 0 0.031" rpy="{roll} 0 0"/><geometry><box size="{size}"/></geometry>'
        other = HandFiles(files.toml, files.urdf.replace(straight, turned.encode(), 1))
        place = Place("length.left_proximal")
        if roll == "0.3":
            with pytest.raises(ValueError, match="its box cannot be longer along the link's z axis"):
                place.read(other)
        else:
            assert b'size="0.02 0.112 0.014"' in place.write(other, 0.124).urdf


OF_T42 = f"hand = '{T42}'\n"
UNKNOWN = '[[unknowns]]\nname = "u"\nin = "{}"\nrange = [0, 1]\n'
POSTURES = '[[goals]]\nkind = "postures"\nsigma = [[0.5]]\nq = [[0.1, nan, 0.1, nan]]\n'
WRONG = [
    ('hand = "none"', "hand: found 'none'; wanted a name of `palmares hands`, or a folder"),
    (OF_T42, "unknowns: found nothing; wanted at least one table"),
    (
        OF_T42 + UNKNOWN.format("a b"),
        r"unknowns\[0\]: in: found 'a b'; wanted words with dots",
    ),
    (
        OF_T42 + UNKNOWN.format("a").replace("[0, 1]", "[1, 0]") + POSTURES,
        r"range: found \[1, 0\]; wanted \[low, high\]",
    ),
    (
        OF_T42 + UNKNOWN.format("a") + POSTURES.replace("postures", "fast"),
        "kind: found 'fast'; wanted one of fates, ejection",
    ),
    (
        OF_T42 + UNKNOWN.format("a") + POSTURES + "wieght = 2\n",
        r"goals\[0\]: unknown field 'wieght'; valid: .*weight",
    ),
    (
        OF_T42 + UNKNOWN.format("a") + POSTURES + "at_most = 2\n",
        "no goal has a weight; wanted at least one to improve",
    ),
    (
        OF_T42 + UNKNOWN.format("a") + POSTURES + POSTURES,
        "two goals have the name 'postures'",
    ),
    (
        OF_T42 + UNKNOWN.format("arm.left_tendon.thumb") + POSTURES,
        "unknown 'u': hand.urdf: transmission 'left_tendon' has no joint 'thumb'; valid: left_prox",
    ),
    (
        OF_T42 + UNKNOWN.format("arms.left_tendon") + POSTURES,
        "hand.toml: it has no 'arms'; valid: name, description, .*\n.*arm.TENDON.JOINT",
    ),
    (
        OF_T42 + UNKNOWN.format("motors.left_motor.scale") + POSTURES,
        r"\[motors.left_motor\] has no 'scale'; valid: scaling, offset",
    ),
    (
        OF_T42 + UNKNOWN.format("rest.left_distal_joint") + POSTURES.replace("nan", "0, 1"),
        "goal 'postures': q: wanted 4 numbers each",
    ),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_what_is_wrong_is_named_with_what_is_valid(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "design.toml").write_text(text)

    def begin() -> None:
        with maker(read(tmp_path / "design.toml")):
            pass

    with pytest.raises(ValueError, match=re.compile(message, re.DOTALL)):
        begin()


def test_the_search_finds_the_bottom_of_a_bent_valley_and_repeats_itself() -> None:
    def rosenbrock(point: Array) -> tuple[float, float]:
        x, y = 4 * point - 2
        return 0.0, (1 - x) ** 2 + 100 * (y - x * x) ** 2

    runs = []
    for _ in range(2):
        points: list[list[float]] = []

        def evaluate(point: Array, points: list[list[float]] = points) -> tuple[float, float]:
            points.append(point.tolist())
            return rosenbrock(point)

        search(evaluate, np.array([0.1, 0.9]), 700, np.random.default_rng(1))
        runs.append(points)
    assert runs[0] == runs[1]
    assert len(runs[0]) == 700
    assert all(0.0 <= x <= 1.0 for point in runs[0] for x in point)
    best = min(runs[0], key=lambda point: rosenbrock(np.array(point)))
    assert 4 * np.array(best) - 2 == pytest.approx([1, 1], abs=0.02)


def test_halton_points_are_those_of_the_definition_and_points_outside_are_reflected() -> None:
    assert [halton(k, 2).tolist() for k in (1, 2, 3)] == [
        pytest.approx(it) for it in ([1 / 2, 1 / 3], [1 / 4, 2 / 3], [3 / 4, 1 / 9])
    ]
    assert folded(np.array([-0.2, 1.3, 2.4, 0.5])) == pytest.approx([0.2, 0.7, 0.4, 0.5])


def test_ctrl_c_keeps_the_best_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    text = OF_T42 + UNKNOWN.format("rest.left_distal_joint") + POSTURES.replace("nan", "0.6", 1)
    (tmp_path / "design.toml").write_text(text)
    measured: list[Measured] = []
    measure = PosturesMissed.measure

    def interrupted(goal: PosturesMissed, hand: str) -> Measured:
        if len(measured) == 5:
            raise KeyboardInterrupt
        measured.append(measure(goal, hand))
        return measured[-1]

    monkeypatch.setattr(PosturesMissed, "measure", interrupted)
    out = tmp_path / "out"
    assert hand_design.main([str(tmp_path / "design.toml"), "--out", str(out), "--quiet"]) == 130
    page = (out / "README.md").read_text()
    assert "Ctrl-C ended the search after 5 hands." in page
    assert f"{min(it.value for it in measured):.4g} rad" in page


def test_other_commands_of_hand_are_those_of_the_compiled_program() -> None:
    assert "Load a hand, describe it" in palmares("hand", "check", "--help").stdout
    ours = palmares("hand", "design", "--help").stdout
    assert "--evaluations" in ours
    assert "pull_out" in ours


def test_a_hand_has_the_name_of_its_folder_and_not_that_of_a_built_in_one() -> None:
    names = {"my hand": "my_hand", "pinch": "pinch-designed", "v1.2": "v1.2"}
    assert {name: name_of(Path("/tmp") / name) for name in names} == names
    assert named(of_t42(), "other").settings["name"] == "other"
    assert named(HandFiles("[base]\n", b""), "other").settings == {"name": "other", "base": {}}


def test_a_hand_is_not_written_into_the_folder_that_it_is_made_of(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is in the folder of the hand"):
        copy_of(str(tmp_path), tmp_path / "new")


def test_offsets_follow_scaling(tmp_path: Path) -> None:
    goal = '[[goals]]\nkind = "postures"\nsigma = [[0.5]]\nq = [[{}]]\n'
    scaling = UNKNOWN.format("motors.left_motor.scaling").replace("[0, 1]", "[0.02, 0.03]")
    (tmp_path / "design.toml").write_text(OF_T42 + scaling + goal.format("0, 0, 0, 0"))
    with maker(read(tmp_path / "design.toml")) as made:
        motor = made.at(np.array([0.0])).files.settings["motors"]["left_motor"]
    assert motor["scaling"] == 0.02
    assert motor["scaling"] * motor["offset"] == pytest.approx(0.026 * 0.301923)


def test_a_hand_that_the_check_refuses_is_passed_over(tmp_path: Path) -> None:
    longest = UNKNOWN.format("length.left_distal").replace("[0, 1]", "[0.02, 0.6]")
    (tmp_path / "design.toml").write_text(OF_T42 + longest + POSTURES)
    with maker(read(tmp_path / "design.toml")) as made:
        found = [made.at(np.array([share])) for share in (1.0, 0.05)]
        best, second = (replace(it, score=score) for it, score in zip(found, (2.0, 1.0), strict=True))
    shutil.copytree(T42, tmp_path / "hand")
    # A link of 0.6 m can be simulated, and is beyond the limits of a competition.
    assert best.measured
    assert usable(Designed(made.before, [best, second]), tmp_path / "hand") == second
