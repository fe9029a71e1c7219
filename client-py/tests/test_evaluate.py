"""Controllers over many scenes."""

import json
from pathlib import Path

import pytest

from palmares.evaluate import ControllerError, evaluate, processes
from palmares.evaluate.command import main, seeds
from palmares.evaluate.statistics import Comparison, Spread

# Drops the ball from where the hand begins: a short run whose final state depends on the seed.
IDLE = """
def run(client, seed, task="grasp", hand="softhand"):
    client.reset(task, hand, seed=seed)
    client.step(repeat=3)
    return client.stop()
"""
FAILS = """
def run(client, seed):
    client.reset("grasp", "softhand", seed=seed)
    if seed == 2:
        raise ArithmeticError("two is too many")
    client.stop()
"""


@pytest.fixture
def idle(tmp_path: Path) -> str:
    path = tmp_path / "idle.py"
    path.write_text(IDLE)
    return str(path)


@pytest.fixture
def fails(tmp_path: Path) -> str:
    path = tmp_path / "fails.py"
    path.write_text(FAILS)
    return str(path)


def test_the_report_is_the_same_for_any_number_of_processes(idle: str) -> None:
    def told(count: int) -> list[tuple[str, str, int, float, str]]:
        report = evaluate([idle], ["grasp", "balls"], ["softhand", "pinch"], [4, 1, 2], pool=processes(count))
        runs = [run for row in report.rows for run in row.runs]
        return [(run.task, run.hand, run.seed, run.score, run.state_hash) for run in runs]

    one = told(1)
    assert one == told(2)
    assert [run[:3] for run in one[:4]] == [
        ("balls", "pinch", 1),
        ("balls", "pinch", 2),
        ("balls", "pinch", 4),
        ("balls", "softhand", 1),
    ]
    assert len({run[4] for run in one}) == len(one) == 12


def test_a_run_that_fails_is_told_and_the_others_count(
    fails: str, idle: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "replays"
    code = main([fails, idle, "--seeds", "3", "--quiet", "--jobs", "2", "--replays", str(folder)])
    told = capsys.readouterr()
    assert code == 1
    assert "seed 2: failed: ArithmeticError: two is too many (fails.py:5)" in told.out
    assert f"{fails} minus {idle}, grasp, softhand: " in told.out
    assert "over 3 seeds" in told.out
    assert len(list(folder.glob("*.mcap"))) == 5


def test_json_has_everything(idle: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([idle, "--seeds", "7-8", "--quiet", "--json", "--jobs", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    (row,) = told["rows"]
    assert (row["task"], row["hand"], row["failed"], row["spread"]["runs"]) == ("grasp", "softhand", 0, 2)
    assert [run["seed"] for run in row["runs"]] == [7, 8]


def test_the_table_is_also_written_in_markdown(
    idle: str, fails: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    written = tmp_path / "table.md"
    arguments = [idle, fails, "--seeds", "2", "--quiet", "--jobs", "1", "--markdown", str(written)]
    assert main(arguments) == 1
    header, rule, first, second = written.read_text().splitlines()
    assert header.count("|") == rule.count("|") == first.count("|") == second.count("|")
    assert first.startswith("| idle | grasp | softhand | truth | 2 | 0.00 |")
    assert "| 2, 1 failed |" in second
    assert "mean" in capsys.readouterr().out


def test_what_cannot_be_played_is_refused(fails: str, tmp_path: Path) -> None:
    with pytest.raises(ControllerError, match="no parameter `task`"):
        evaluate([fails], tasks=["grasp", "balls"])
    with pytest.raises(ControllerError, match="plays the task 'grasp', not balls"):
        evaluate([fails], tasks=["balls"], seeds=[1], pool=processes(1))
    with pytest.raises(ControllerError, match="no such file"):
        evaluate([str(tmp_path / "none.py")])
    with pytest.raises(ControllerError, match="ModuleNotFoundError"):
        evaluate(["no.such.module"])
    (tmp_path / "empty.py").write_text("walk = 1\n")
    with pytest.raises(ControllerError, match="no function"):
        evaluate([str(tmp_path / "empty.py")])


def test_seeds_are_a_number_a_range_or_a_list() -> None:
    assert seeds("3") == [1, 2, 3]
    assert seeds("5001-5003") == [5001, 5002, 5003]
    assert seeds("3,5,8") == [3, 5, 8]
    for wrong in ("0", "-1", "5-3", "a", "", "1-2-3", str(2**53) + ","):
        with pytest.raises(Exception, match="wanted a number"):
            seeds(wrong)


def test_the_paired_test_counts_every_sign_of_few_differences() -> None:
    # Of the 8 ways to sign three differences of 1, two have a sum as far from 0 as 3.
    found = Comparison.of([2.0, 3.0, 4.0], [1.0, 2.0, 3.0])
    assert found.p_value == pytest.approx(2 / 8)
    assert (found.better, found.equal, found.worse, found.mean) == (3, 0, 0, 1.0)
    assert Comparison.of([1.0, 2.0], [1.0, 2.0]).p_value == 1.0


def test_the_paired_test_draws_signs_of_many_differences() -> None:
    same = [0.5 * (-1) ** k for k in range(40)]
    assert Comparison.of(same, [0.0] * 40).p_value > 0.9
    shifted = [value + 1.0 for value in same]
    assert Comparison.of(shifted, [0.0] * 40).p_value < 0.001


def test_the_spread_is_that_of_the_scores() -> None:
    spread = Spread.of([0.0, 1.0, 2.0, 3.0, 4.0])
    assert (spread.least, spread.quartile_1, spread.median, spread.quartile_3, spread.most) == (0, 1, 2, 3, 4)
    assert spread.mean == 2.0
    assert spread.interval[0] < 2.0 < spread.interval[1]
    assert Spread.of([3.0]).interval == (3.0, 3.0)
