"""Recipes of the built-in hands, and the example that plays them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import palmares
from palmares.examples import grasp
from palmares.skills.recipes import RECIPES

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

HANDS = Path(__file__).parent.parent.parent / "models/hands"


def test_every_hand_but_the_softhand_has_a_recipe_for_its_motors() -> None:
    motors = {hand.name: len(hand.motors) for hand in sim.welcome().hands}
    assert set(motors) == set(RECIPES) | {"softhand", "softhand_skin", "softhand_strong"}
    for name, recipe in RECIPES.items():
        assert len(recipe.opened) == len(recipe.closed) == motors[name], name
        assert all(0.0 <= sigma <= 1.0 for sigma in recipe.opened + recipe.closed), name


@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_points_down_and_closes_across_the_shorter_side(name: str) -> None:
    recipe = RECIPES[name]
    rotation = recipe.rotation(0.3)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3)
    assert np.allclose(rotation @ recipe.approach, [0.0, 0.0, -1.0], atol=1e-3)
    assert np.allclose(rotation @ recipe.across, [-np.sin(0.3), np.cos(0.3), 0.0], atol=1e-3)


def test_a_hand_grasps_by_its_recipe() -> None:
    with palmares.Client("local") as client:
        summary = grasp.run(client, 3, str(HANDS / "yale_t42"), RECIPES["yale_t42"])
    assert summary.hand == "yale_t42"
    assert summary.kept == 1
    assert summary.score > 8.0


def test_the_softhand_plays_its_own_grasps() -> None:
    with palmares.Client("local") as client:
        summary = grasp.run(client, 3, "softhand")
    assert summary.hand == "softhand"
    assert summary.kept == 1
