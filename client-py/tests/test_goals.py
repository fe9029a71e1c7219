"""Goals of the tasks with their tolerances, in the scene, in the greeting and in the guide."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest

import palmares
from palmares.scene import conditions
from palmares.wire import GoalInfo

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

GUIDE = Path(__file__).parents[2] / "docs/tasks.md"


@pytest.mark.parametrize("task", sim.TASKS)
def test_scene_and_greeting_have_the_goals_of_a_task(task: str) -> None:
    with palmares.Client("local") as client:
        client.reset(task, "softhand", seed=1)
        goals = client.scene.goals
        assert goals == client.welcome.task(task).goals
        assert sum(goal.points for goal in goals if goal.points > 0.0) == {"balls": 1.0, "shelf": 5.0}.get(
            task, 10.0
        )
        for goal in goals:
            assert f"goal {goal.name}" in str(client.scene)
            assert client.scene.goal_named(goal.name) is goal
        with pytest.raises(KeyError, match=f"no goal 'won'; there are: {goals[0].name}"):
            client.scene.goal_named("won")


def test_the_tolerances_are_those_of_the_rules() -> None:
    peg = {goal.name: goal for goal in sim.welcome().task("peg").goals}
    seated = peg["seated"]
    assert seated.within is not None
    assert (seated.within.object, seated.within.max) == ("block", (0.004, 0.004, 0.023))
    assert (seated.object, seated.for_s, seated.point) == ("peg", 0.2, (0.0, 0.0, -0.1))
    pan = {goal.name: goal for goal in sim.welcome().task("pan").goals}
    assert (pan["pan_level"].upright_deg, pan["pan_level"].above_m) == (20.0, 0.05)
    assert (pan["lid_aside"].rest_m_s, pan["lid_aside"].hand_off_m) == (0.005, 0.3)


def test_sensors_alone_know_the_goals_too() -> None:
    world = sim.World("pan", "softhand", seed=1, sensing="sensors")
    assert [goal.name for goal in world.scene.goals] == ["lid_lifted", "lid_aside", "pan_lifted", "pan_level"]


def test_an_older_server_sends_none() -> None:
    scene = msgspec.convert({"bodies": [], "regions": [], "gravity": [0, 0, -9.81]}, palmares.Scene)
    assert scene.goals == []


def test_the_guide_has_the_tolerances_of_every_task() -> None:
    rows = []
    for task in sim.welcome().tasks:
        for goal in task.goals:
            cells = [task.name, f"`{goal.name}`", goal.object or "each", f"{goal.points:g}"]
            rows.append(f"| {' | '.join([*cells, conditions(without(goal))])} |")
    (table,) = re.findall(r"<!-- goals: .*?-->\n(.*?)<!-- end of goals -->", GUIDE.read_text(), re.DOTALL)
    assert table.splitlines()[2:] == rows


def without(goal: GoalInfo) -> GoalInfo:
    """Return the goal without its object, which has a column of its own."""
    return msgspec.structs.replace(goal, object=None)
