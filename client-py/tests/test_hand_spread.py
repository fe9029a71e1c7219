"""Hands with numbers drawn from the ranges of ``[uncertain]``: training, and what a score hangs on."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palmares
from palmares.evaluate import ControllerError, Played, Report, evaluate, processes
from palmares.evaluate.effects import FEWEST_RUNS, effects
from palmares.evaluate.statistics import Spread
from palmares.program.evaluate import main, parser, separated
from palmares.training import Training
from tests.fake_server import FakeServer

sim = pytest.importorskip("palmares.sim", reason="the compiled part of the package is not installed")

UNCERTAIN = (
    "damping",
    "distal_arms",
    "force_limit",
    "friction",
    "other_arms",
    "speed_limit",
    "stiffness",
)
# Closes in the air: the final state depends on the hand.
CLOSES = """
def run(client, seed, task="grasp", hand="softhand"):
    client.reset(task, hand, seed=seed)
    client.step(hand=[1.0], repeat=30)
    return client.stop()
"""


def played(seed: int, score: float, index: int = 0, **drawn: float) -> Played:
    """Return the outcome of a run with a drawn hand."""
    return Played("c.py", "grasp", "softhand", seed, score=score, hand_sample=(index, 99), hand_drawn=drawn)


def test_an_effect_is_found_and_a_number_without_one_is_not() -> None:
    generator = np.random.default_rng(7)
    factors = generator.uniform(0.5, 1.5, size=(300, 2))
    noise = generator.normal(0.0, 1.0, size=300)
    runs = [
        played(k, 5.0 - 6.0 * (good - 1.0) + noise[k], good=good, idle=idle)
        for k, (good, idle) in enumerate(factors)
    ]
    first, second = effects(runs)
    assert (first.name, second.name) == ("good", "idle")
    # The means of the outer thirds of an even distribution are 2/3 of its width apart: 6 · 2/3.
    assert first.interval[0] < -4.0 < first.interval[1]
    assert first.difference == pytest.approx(first.high - first.low)
    assert first.matters
    assert not second.matters
    assert -1.0 <= first.correlation_interval[0] < first.correlation < first.correlation_interval[1] < -0.7
    assert second.correlation_interval[0] < 0.0 < second.correlation_interval[1]
    assert 0.5 <= first.least < 0.51 < 1.49 < first.most <= 1.5
    assert effects(runs) == effects(runs[::-1]) or math.isclose(effects(runs[::-1])[0].low, first.low)


def test_the_rank_correlation_is_spearmans() -> None:
    values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]
    scores = [2.0, 1.0, 4.0, 3.0, 6.0, 5.0, 8.0, 7.0, 10.0, 9.0, 12.0, 11.0]
    # Without ties it is 1 − 6 Σ d² / (n (n² − 1)); every d is 1.
    (effect,) = effects([played(k, s, x=v) for k, (v, s) in enumerate(zip(values, scores, strict=True))])
    assert effect.correlation == pytest.approx(1.0 - 6.0 * 12.0 / (12.0 * 143.0), abs=1e-12)
    (alike,) = effects([played(k, 3.0, x=v) for k, v in enumerate(values)])
    assert (alike.correlation, alike.correlation_interval) == (0.0, (0.0, 0.0))
    assert (alike.difference, alike.interval, alike.matters) == (0.0, (0.0, 0.0), False)
    assert effects([played(k, 3.0, x=float(k)) for k in range(FEWEST_RUNS - 1)]) == ()


def test_an_interval_knows_that_runs_of_a_scene_are_not_independent() -> None:
    """Ten hands in each of twenty scenes, whose scores depend on the scene alone."""
    generator = np.random.default_rng(3)
    easy = generator.normal(0.0, 1.0, size=20)
    scores = [float(easy[k]) for k in range(20) for _ in range(10)]
    scenes = [k for k in range(20) for _ in range(10)]
    low, high = Spread.of(scores, scenes).interval
    assert (low, high) == pytest.approx(Spread.of(easy.tolist()).interval)
    narrow = Spread.of(scores).interval
    assert high - low > 2.5 * (narrow[1] - narrow[0])


def test_intervals_contain_no_effect_as_often_as_they_say() -> None:
    """Eighty evaluations of scores that hang on nothing: with 95 % of them no number matters."""
    generator = np.random.default_rng(11)
    wrong = 0
    for _ in range(80):
        numbers, scores = generator.uniform(size=(60, 3)), generator.normal(size=60)
        runs = [played(k, scores[k], a=a, b=b, c=c) for k, (a, b, c) in enumerate(numbers)]
        wrong += any(effect.matters for effect in effects(runs))
    # 4 of 80 are expected; more than 11 have a probability of 0.1 %.
    assert wrong <= 11


def test_a_controller_is_played_over_the_spread(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "closes.py"
    path.write_text(CLOSES)
    table = tmp_path / "table.md"
    line = [str(path), "--seeds", "1-7", "--hand-spread", "2", "--quiet", "--jobs", "2", "--json"]
    assert main([*line, "--markdown", str(table)]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert [(run["seed"], run["hand_sample"]) for run in row["runs"]] == [
        (1 + k // 2, [k, 14]) for k in range(14)
    ]
    assert all(tuple(run["hand_drawn"]) == UNCERTAIN for run in row["runs"])
    assert sorted(effect["name"] for effect in row["effects"]) == sorted(UNCERTAIN)
    assert len({run["state_hash"] for run in row["runs"]}) == 14
    for name in UNCERTAIN:
        assert len({run["hand_drawn"][name] for run in row["runs"]}) == 14
    lines = table.read_text().splitlines()
    assert any("hangs on, over 14 drawn hands" in text for text in lines)
    assert sum(text.startswith("| distal_arms |") for text in lines) == 1
    report = evaluate(str(path), seeds=range(1, 8), hand_spread=2, pool=processes(1))
    assert [run.state_hash for run in report.rows[0].runs] == [run["state_hash"] for run in row["runs"]]
    printed = str(report)
    assert "what closes, grasp, softhand hangs on, over 14 drawn hands:" in printed
    assert "seed 1, hand 0 of 14: " in printed
    own = evaluate(str(path), seeds=[1], pool=processes(1)).rows[0]
    assert (own.effects, own.runs[0].hand_drawn, own.runs[0].hand_sample) == ((), {}, None)


def test_controllers_are_compared_with_the_same_hands() -> None:
    runs = [played(k // 2, 1.0 + k, index=k, x=float(k)) for k in range(12)]
    other = [Played("d.py", *run_of(run)) for run in runs]
    report = Report.of([*runs, *other])
    assert report.comparisons == ()
    same = [
        Played("d.py", "grasp", "softhand", run.seed, score=run.score - 1.0, hand_sample=run.hand_sample)
        for run in runs
    ]
    (compared,) = Report.of([*runs, *same]).comparisons
    assert (compared.comparison.pairs, compared.comparison.mean, compared.comparison.better) == (12, 1.0, 12)


def run_of(run: Played) -> tuple[str, str, int]:
    return run.task, run.hand, run.seed


def test_what_has_no_spread_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "closes.py"
    path.write_text(CLOSES)
    with pytest.raises(ControllerError, match=r"no \[uncertain\] in the hand.toml of pinch: nothing to draw"):
        evaluate(str(path), hands="pinch", seeds=[1], hand_spread=1)
    with pytest.raises(ControllerError, match="without url, and have no replays"):
        evaluate(str(path), seeds=[1], hand_spread=1, replays=tmp_path / "replays")
    with pytest.raises(ControllerError, match="without url, and have no replays"):
        evaluate(str(path), seeds=[1], hand_spread=1, url="http://127.0.0.1:1")
    with pytest.raises(ValueError, match="hand_spread: found -1; wanted a whole number from 0 to 1000000"):
        evaluate(str(path), seeds=[1], hand_spread=-1)
    with pytest.raises(ValueError, match="hand_spread times the number of scenes: found 2000000"):
        evaluate(str(path), seeds=[1, 2], hand_spread=1_000_000)
    options = parser().parse_args(list(separated(["--hand-spread", str(path), "--ray"])))
    assert (options.hand_spread, options.controllers, options.ray) == (1, [str(path)], "")
    assert parser().parse_args(list(separated([str(path), "--hand-spread", "3"]))).hand_spread == 3
    assert parser().parse_args([str(path)]).hand_spread == 0


def test_each_world_of_a_batch_has_a_hand_of_its_own() -> None:
    def opened(threads: int, seeds: list[int], training: Training) -> Any:
        batch = sim.Batch("grasp", "softhand", len(seeds), threads=threads, training=training)
        batch.reset(seeds)
        return batch

    everything = Training(randomise=["hand"])
    batch = opened(1, [4, 5, 6], everything)
    assert batch.hand_numbers == UNCERTAIN
    drawn = batch.hand_drawn
    assert drawn.shape == (3, 7)
    assert len(np.unique(drawn)) == 21
    np.testing.assert_array_equal(batch.observe()["hand_drawn"], drawn)
    assert batch.fields["hand_drawn"] == (7,)
    again = opened(2, [6, 5, 4], everything)
    np.testing.assert_array_equal(again.hand_drawn, drawn[::-1])
    action = np.zeros((3, 7))
    action[:, 6] = 0.5
    for each in (batch, again):
        each.step(action)
    assert batch.state_hashes() == again.state_hashes()[::-1]
    batch.reset([7, 0, 0], [True, False, False])
    assert (batch.hand_drawn[1:] == drawn[1:]).all()
    assert (batch.hand_drawn[0] != drawn[0]).all()
    one = opened(1, [4, 5, 6], Training(randomise=["mass", "hand_friction"]))
    assert one.hand_numbers == ("friction",)
    np.testing.assert_array_equal(one.hand_drawn[:, 0], drawn[:, UNCERTAIN.index("friction")])
    world = sim.World("grasp", "softhand", 5, training=everything)
    assert list(world.hand_drawn.items()) == list(zip(UNCERTAIN, drawn[1], strict=True))
    assert world.varied
    assert world.result().status == "training"
    plain = sim.Batch("grasp", "softhand", 2, threads=1)
    assert (plain.hand_numbers, plain.hand_drawn.shape) == ((), (2, 0))
    assert "hand_drawn" not in plain.fields


def test_a_critic_sees_the_hand_and_a_policy_of_sensors_does_not() -> None:
    pytest.importorskip("gymnasium")
    from palmares.gym import BatchEnv, FlatEnv

    envs = BatchEnv("grasp", "softhand", 2, sensing="sensors", threads=1, randomise=["hand"])
    observations, infos = envs.reset(seed=3)
    assert "hand_drawn" not in observations
    assert infos["hand_drawn"].shape == (2, 7)
    assert infos["_hand_drawn"].all()
    stepped = envs.step(np.zeros((2, 7)))[-1]
    np.testing.assert_array_equal(stepped["hand_drawn"], infos["hand_drawn"])
    for sensing in ("truth", "sensors"):
        env = FlatEnv("grasp", "softhand", sensing=sensing, randomise=["hand"])
        observation, info = env.reset(seed=3)
        assert env.hand_numbers == envs.hand_numbers == UNCERTAIN
        np.testing.assert_array_equal(info["hand_drawn"], infos["hand_drawn"][0])
        assert env.observation_space.contains(observation)
        assert ("hand_drawn" in observation) is (sensing == "truth")
        np.testing.assert_array_equal(env.step(np.zeros(7))[-1]["hand_drawn"], info["hand_drawn"])
        env.close()
    env = FlatEnv("grasp", "softhand", randomise=["mass"])
    observation, info = env.reset(seed=3)
    assert "hand_drawn" not in observation | info
    env.close()


def test_a_hand_that_cannot_be_drawn_is_refused() -> None:
    for name, hand, message in (
        ("hand", "pinch", r"randomise: hand `pinch` has nothing in \[uncertain\] of its hand.toml"),
        ("hand_slip", "softhand", r"found \"slip\"; hand `softhand` has in \[uncertain\]: damping, "),
    ):
        with pytest.raises(ValueError, match=message):
            sim.World("grasp", hand, 1, training=Training(randomise=[name]))
    with pytest.raises(ValueError, match="randomise: found 'grip'; wanted some of mass, friction"):
        Training(randomise=["grip"])
    for wrong in ((3, 3), (-1, 3), (0, 0), (0, 1_000_001), "01", (1,), (0.5, 2)):
        with pytest.raises(ValueError, match="hand_sample"):
            Training(hand_sample=wrong)  # type: ignore[arg-type]
    first, second = (sim.World("grasp", "softhand", 1, training=Training(hand_sample=(k, 2))) for k in (0, 1))
    for name, number in first.hand_drawn.items():
        assert (number - 1.0) * (second.hand_drawn[name] - 1.0) < 0.0 or name in (
            "friction",
            "stiffness",
            "speed_limit",
        )
    with FakeServer([]) as server, pytest.raises(ValueError, match="servers do not offer it"):
        palmares.Client(server.url, training=Training(randomise=["hand"]))
