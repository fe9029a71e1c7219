"""`palmares.analysis` against closed forms, differences and the simulation."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from palmares.analysis import (
    Contact,
    ContactModel,
    Hand,
    Postures,
    Variable,
    arm,
    ellipsoid,
    grasp_matrix,
    held,
    rest,
    soft_synergies,
)
from palmares.sim import World

ROOT = Path(__file__).parents[2]
TIPS = [
    Contact("left_distal", (0, -0.006, 0.02), (0, -1, 0), "soft_finger", 0.8, 0.005),
    Contact("right_distal", (0, 0.006, 0.02), (0, 1, 0), "soft_finger", 0.8, 0.005),
]


def test_the_notebook_runs() -> None:
    cells = json.loads((ROOT / "docs/examples/analysis.ipynb").read_text())["cells"]
    names: dict[str, Any] = {}
    codes = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert len(codes) > 8
    for number, code in enumerate(codes):
        exec(compile(code, f"cell {number}", "exec"), names)


def test_rest_is_the_closed_form_and_has_the_links_poses() -> None:
    hand = Hand("pinch")
    found = hand.rest([0.3, 0.2])
    compliance, r = np.linalg.inv(hand.E), hand.R()
    p = np.linalg.inv(r @ compliance @ r.T + np.diag(1 / hand.K))
    # At σ = 0 the tendons are as long as at q₀.
    q = hand.q0 + compliance @ r.T @ p @ hand.W @ [0.3, 0.2]
    assert found.method == "closed_form"
    np.testing.assert_allclose(found.q, q, atol=1e-12)
    np.testing.assert_allclose(found.links, hand.poses(found.q), atol=0)
    assert found.links.shape == (len(hand.links), 7)


def test_a_held_point_stays_and_its_reaction_is_a_force() -> None:
    hand = Hand("pinch")
    tip = hand.links.index("left_distal")
    place = hand.rest(0.31).links[tip, :3]
    found = hand.rest(0.3, held=[("left_distal", (0, 0, 0), place)])
    assert found.gaps[0] < 1e-4
    again = hand.rest(0.3, forces=[("left_distal", (0, 0, 0), found.reactions[0])])
    np.testing.assert_allclose(again.q, found.q, atol=1e-6)


def test_arrays_have_their_shapes_and_do_the_same_work() -> None:
    hand = Hand("pinch")
    grasp = hand.grasp([0.5, 0.3], TIPS)
    assert grasp.G.shape == (6, 8)
    assert grasp.J.shape == (8, 4)
    np.testing.assert_allclose(grasp.G, grasp_matrix(grasp.contacts, grasp.object), atol=1e-15)
    linear = grasp.linear(contact_stiffness=(1e4, 5e3, 0.1))
    # The object's balance under σ, and Maxwell's reciprocity of its compliance.
    np.testing.assert_allclose(grasp.G @ linear.forces_per_input, 0, atol=1e-8)
    np.testing.assert_allclose(linear.object_per_wrench, linear.object_per_wrench.T, atol=1e-9)
    assert linear.controllable_internal_forces.shape[0] == 8
    fixed = grasp.linear(contact_stiffness=(1e4, 5e3, 0.1), tendons="fixed")
    assert np.trace(fixed.object_stiffness) > np.trace(linear.object_stiffness)
    assert grasp.form_closure().closed is False


def test_soft_synergies_without_an_object_follow_their_commands() -> None:
    s = np.array([[1.0], [0.5]])
    hand = soft_synergies(s, np.diag([2.0, 3.0]), np.array([[4.0]]))
    np.testing.assert_allclose(hand.compliance, np.diag([1 / 2, 1 / 3]) + s @ s.T / 4)
    np.testing.assert_allclose(hand.motion, s)


def test_quality_of_a_pinch_is_between_its_pyramids_and_round_cones() -> None:
    grasp = Hand("pinch").grasp([0.5, 0.3], TIPS)
    four, eight = grasp.quality(edges=4), grasp.quality(edges=8)
    assert 0 < four.epsilon <= eight.epsilon + 1e-9
    assert eight.epsilon <= min(four.epsilon_bound, eight.epsilon_bound) + 1e-9
    assert four.volume is not None
    assert eight.volume is not None
    assert four.volume < eight.volume
    with pytest.raises(ValueError, match="objects in the plane"):
        grasp.quality("each")


def test_a_world_held_object_has_the_forces_of_its_contacts() -> None:
    world = World("grasp", "softhand", seed=3)
    obs = world.step(hand=[1.0], repeat=100)
    assert obs is not None
    for body in world.scene.free:
        grasp = held(world, body.name)
        assert grasp.G.shape[1] == grasp.J.shape[0] == (0 if grasp.forces is None else len(grasp.forces))
    with pytest.raises(ValueError, match="object: found 'none'"):
        held(world, "none")


def test_an_object_that_nothing_touches_is_held_in_no_direction() -> None:
    world = World("grasp", "softhand", seed=3)
    grasp = held(world, world.scene.free[0].name)
    linear = grasp.linear()
    assert (grasp.contacts, linear.held) == ((), 0)
    np.testing.assert_array_equal(linear.joints_per_input, grasp.hand().motion)


def test_design_reaches_a_trajectory() -> None:
    hand = Hand("pinch")
    variables = [
        Variable([arm("close", "left_base"), arm("close", "right_base")], 0.001, 0.01),
        Variable([rest("left_tip")], -0.5, 0.5),
    ]
    wanted = Postures(
        sigma=[[0.2, 0.2], [0.4, 0.1]], q=[[0.3, np.nan, 0.3, np.nan], [0.5, np.nan, 0.5, np.nan]]
    )
    best = hand.optimise(variables, [wanted])
    assert best.cost < best.history[0]
    values, slopes = hand.differences(variables, [wanted])
    assert slopes.shape == (len(values), 2)


def test_ejection_depends_on_the_distance() -> None:
    found = Hand("pinch").ejection(
        "sphere", [0.01], [(0, 0, 0.5)], sigma=0.5, close_s=0.2, hold_s=0.02, loads=[]
    )
    assert found.fate.tolist() == [["missed"]]


def test_the_root_has_its_own_frame_where_the_base_is_elsewhere(tmp_path: Path) -> None:
    folder = tmp_path / "pinch"
    shutil.copytree(ROOT / "models/hands/pinch", folder)
    settings = folder / "hand.toml"
    base = "[base]\nposition = [0.0, 0.01, -0.05]\nrpy = [0, 0.3, 0.2]\n"
    settings.write_text(settings.read_text() + "\n" + base)
    plain, moved = Hand("pinch"), Hand(str(folder))
    sigma = [0.3, 0.35]
    away = moved.rest(sigma)
    # The whole hand is elsewhere, as its root is: each link in the root's frame is where it was.
    turn = _turn(away.links[0])
    links = [turn.T @ (link[:3] - away.links[0, :3]) for link in away.links]
    np.testing.assert_allclose(links, plain.rest(sigma).links[:, :3], atol=1e-9)
    np.testing.assert_allclose(moved.poses(away.q), away.links, atol=0)
    assert np.linalg.norm(away.links[0, :3]) > 0.04
    point = (0.01, 0.02, 0.03)
    grasp = moved.grasp(away, [Contact("palm", point, (0, 0, 1))])
    place = away.links[0, :3] + turn @ point
    np.testing.assert_allclose(grasp.contacts[0].point, place, atol=1e-12)
    np.testing.assert_allclose(grasp.contacts[0].normal, turn[:, 2], atol=1e-12)
    assert moved.rest(sigma, held=[("palm", point, place)]).gaps[0] < 1e-9


def _turn(pose: Any) -> Any:
    x, y, z, w = pose[3:]
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def test_one_contact_stiffness_is_springs_at_the_arm_about_the_normal() -> None:
    def stiffness(model: ContactModel, arm: float, k: Any) -> Any:
        tips = [Contact(tip.link, tip.point, tip.normal, model, 0.8, arm) for tip in TIPS]
        return Hand("pinch").grasp([0.3, 0.35], tips).linear(k).object_stiffness

    assert Contact("palm", (0, 0, 0), (0, 0, 1)).arm == 0.005
    parts = (2e4, 2e4, 2e4 * 0.005**2)
    np.testing.assert_allclose(
        stiffness("soft_finger", 0.005, 2e4), stiffness("soft_finger", 0.005, parts), atol=1e-6
    )
    # Without an arm a soft finger transmits no moment, as a hard one.
    np.testing.assert_allclose(
        stiffness("soft_finger", 0.0, 2e4), stiffness("hard_finger", 0.0, 2e4), atol=1e-6
    )


def test_travel_and_progress_follow_the_coordinates() -> None:
    hand = Hand("softhand")
    closing = hand.close(steps=20)
    np.testing.assert_allclose(closing.travel, closing.q[-1] - closing.q[0])
    first = closing.reached[[hand.coordinates.index(name) for name in closing.order], 0]
    assert np.all(np.diff(first[~np.isnan(first)]) >= 0)


def test_what_is_wrong_is_named() -> None:
    hand = Hand("pinch")
    for wrong, match in [
        (Contact("no", (0, 0, 0), (0, 0, 1)), 'contact 0: link: found "no"; wanted one of palm'),
        (Contact("palm", (0, 0, 0), (0, 0, 0)), "contact 0: its normal"),
        (Contact("palm", (0, 0, np.nan), (0, 0, 1)), "contact 0: point"),
        (Contact("palm", (0, 0, 0), (0, 0, 1), friction=-1), "its friction"),
    ]:
        with pytest.raises(ValueError, match=match):
            hand.grasp(0.3, [wrong])
    with pytest.raises(ValueError, match="sigma: found"):
        hand.rest([0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match=r"sigma: found \[7\.0, 7\.0\]; wanted 2 numbers from 0"):
        hand.rest(7.0)
    with pytest.raises(ValueError, match="end: found"):
        hand.close(0.0, -0.1)
    with pytest.raises(ValueError, match="contacts: found none"):
        hand.grasp(0.3, [])
    found, word = hand.rest(0.3), cast(Any, "stiff")
    for stiff in (lambda: hand.linear(found, word), lambda: hand.grasp(found, TIPS).linear(1e4, word)):
        with pytest.raises(ValueError, match='tendons: found \'stiff\'; wanted "compliant" or "fixed"'):
            stiff()
    for number in (-1.0, 0.0, np.nan, [1, 2], [1, -1, 1]):
        with pytest.raises(ValueError, match="contact_stiffness: found"):
            hand.grasp(found, TIPS).linear(cast(Any, number))
    with pytest.raises(ValueError, match="neither a hand"):
        Hand("no-such-hand")
    assert ellipsoid(np.zeros((2, 2))).manipulability == 0
