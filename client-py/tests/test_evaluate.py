"""Evaluation of controllers in many scenes."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import palmares
from palmares.evaluate import MAX_SEEDS, ControllerError, evaluate, processes
from palmares.evaluate.controller import loaded
from palmares.evaluate.statistics import Comparison, Spread
from palmares.program.evaluate import main, parser, seeds, separated
from tests.real_server import RealServer, needs_server

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
# Ends in every possible way.
ENDS = """
import os, sys
def run(client, seed):
    client.reset("balls", "softhand", seed=seed)
    client.step(repeat=3)
    print("seed", seed)
    if seed == 2:
        os._exit(3)
    if seed == 3:
        sys.exit("three is enough")
    if seed == 4:
        return
    client.stop()
    if seed == 5:
        raise ValueError("after\\nthe run")
"""
HANDS = Path(__file__).parents[2] / "models/hands"
TASKS = Path(__file__).parents[2] / "tasks"


def written(path: Path, text: str) -> str:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return str(path)


@pytest.fixture
def idle(tmp_path: Path) -> str:
    return written(tmp_path / "idle.py", IDLE)


@pytest.fixture
def fails(tmp_path: Path) -> str:
    return written(tmp_path / "fails.py", FAILS)


def test_the_report_is_the_same_for_any_number_of_processes(idle: str) -> None:
    def rows(count: int) -> list[tuple[str, str, int, float, str]]:
        report = evaluate([idle], ["grasp", "balls"], ["softhand", "pinch"], [4, 1, 2], pool=processes(count))
        runs = [run for row in report.rows for run in row.runs]
        return [(run.task, run.hand, run.seed, run.score, run.state_hash) for run in runs]

    one = rows(1)
    assert one == rows(2)
    assert [run[:3] for run in one[:4]] == [
        ("balls", "pinch", 1),
        ("balls", "pinch", 2),
        ("balls", "pinch", 4),
        ("balls", "softhand", 1),
    ]
    assert len({run[4] for run in one}) == len(one) == 12


def test_a_failed_run_is_reported_and_the_others_count(
    fails: str, idle: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "replays"
    code = main([fails, idle, "--seeds", "3", "--quiet", "--jobs", "2", "--replays", str(folder)])
    printed = capsys.readouterr()
    assert code == 1
    assert "seed 2: failed: ArithmeticError: two is too many (fails.py:5)" in printed.out
    assert f"{fails} minus {idle}, grasp, softhand: " in printed.out
    assert "over 3 seeds" in printed.out
    assert len(list(folder.glob("*.mcap"))) == 6


def test_however_a_controller_ends_its_run_is_counted(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    report = evaluate(written(tmp_path / "ends.py", ENDS), seeds=range(1, 6), pool=processes(1))
    printed = capfd.readouterr()
    assert printed.out == ""
    assert sorted(printed.err.split()) == ["1", "2", "3", "4", "5"] + 5 * ["seed"]
    (row,) = report.rows
    assert [(run.error or "").split(" (")[0] for run in row.runs] == [
        "",
        "its process ended: exit code 3",
        "SystemExit: three is enough",
        "ControllerError: it ended without client.stop()",
        "ValueError: after the run",
    ]
    assert [run.state_hash != "" for run in row.runs] == [True, False, True, True, True]
    assert (row.task, row.hand, row.failed) == ("balls", "softhand", 4)


def test_each_controller_imports_modules_of_its_own_folder(tmp_path: Path) -> None:
    text = """
import helper
STEPS = []
def run(client, seed):
    import later
    client.reset("grasp", "softhand", seed=seed)
    STEPS.append(helper.TICKS + later.TICKS)
    client.step(repeat=sum(STEPS))
    return client.stop()
"""
    controllers = []
    for name, ticks in (("old", 1), ("new", 5)):
        controllers.append(written(tmp_path / name / "controller.py", text))
        written(tmp_path / name / "helper.py", f"TICKS = {ticks}")
        written(tmp_path / name / "later.py", f"TICKS = {10 * ticks}")
    report = evaluate(controllers, seeds=[1, 2], pool=processes(1))
    assert [[round(run.sim_time_s, 6) for run in row.runs] for row in report.rows] == [[0.11] * 2, [0.55] * 2]


def test_a_file_may_have_the_name_of_a_module(tmp_path: Path) -> None:
    path = written(tmp_path / "json.py", IDLE)
    before = set(sys.modules)
    with loaded(path) as run:
        assert run.__code__.co_filename == path
        assert sys.modules["json"] is json
        assert sys.path[0] == str(tmp_path)
    assert set(sys.modules) == before
    assert str(tmp_path) not in sys.path


def test_a_users_hand_is_reported_by_its_path(idle: str, fails: str, tmp_path: Path) -> None:
    hand = tmp_path / "changed"
    shutil.copytree(HANDS / "softhand", hand)
    report = evaluate(idle, "grasp", ["softhand", str(hand)], [1], pool=processes(1))
    assert [(row.hand, row.failed) for row in report.rows] == [(str(hand), 0), ("softhand", 0)]
    with pytest.raises(ControllerError, match="replays of hands of your own need a server"):
        evaluate(idle, "grasp", str(hand), [1], replays=tmp_path / "replays")
    report = evaluate(fails, "grasp", str(hand), [2], pool=processes(1))
    assert [(row.hand, row.failed) for row in report.rows] == [(str(hand), 1)]


def test_so_does_a_task_of_ones_own(idle: str, tmp_path: Path) -> None:
    task = tmp_path / "changed"
    shutil.copytree(TASKS / "grasp", task)
    report = evaluate(idle, ["grasp", str(task)], "pinch", [1], pool=processes(1))
    assert [(row.task, row.failed) for row in report.rows] == [(str(task), 0), ("grasp", 0)]


def test_ctrl_c_ends_it_with_the_runs_so_far(tmp_path: Path) -> None:
    reached = tmp_path / "reached"
    wait = f"""
    if seed == 3:
        open({str(reached)!r}, "w").close()
        time.sleep(100.0)
    return"""
    slow = written(tmp_path / "slow.py", "import time" + IDLE.replace("\n    return", wait))
    command = [sys.executable, "-m", "palmares", "evaluate", slow, "--seeds", "4", "--jobs", "1", "--json"]
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell makes background processes ignore Ctrl-C; undo that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as child:
        while not reached.exists():
            assert child.poll() is None
            time.sleep(0.01)
        os.killpg(child.pid, signal.SIGINT)
        out, err = child.communicate(timeout=20)
    assert child.returncode == 130
    assert f"interrupted after 2 of 4 runs\nopen: {slow} seed 3\n" in err
    assert "Traceback" not in err
    assert [run["seed"] for run in json.loads(out)["rows"][0]["runs"]] == [1, 2]


def test_a_run_that_does_not_end_has_failed_and_the_others_go_on(tmp_path: Path) -> None:
    stuck = written(
        tmp_path / "stuck.py", IDLE.replace("\n    return", "\n    while seed == 1: pass\n    return")
    )
    begun = time.monotonic()
    report = evaluate(stuck, seeds=range(1, 4), pool=processes(1, timeout_s=3.0))
    assert 3.0 < time.monotonic() - begun < 20.0
    (row,) = report.rows
    assert [run.error for run in row.runs] == ["it took longer than 3 s", None, None]
    assert row.runs[0].score == 0.0
    assert row.runs[0].wall_s >= 3.0
    options = parser().parse_args([stuck, "--timeout-s", "0.5"])
    assert options.timeout_s == 0.5
    for wrong in ("0", "-1", "nan", "x"):
        with pytest.raises(SystemExit):
            parser().parse_args([stuck, "--timeout-s", wrong])


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("def run(client):", r"its function is `run\(client\)`; wanted `run\(client, seed\)`"),
        ("def run(client, seed, more):", "missing a required argument: 'more'"),
        ("def run(client, seed, task):", r"run\(\) needs `task`: pass tasks=… or --tasks"),
    ],
)
def test_a_run_that_cannot_be_called_so_is_refused_before(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(ControllerError, match=message):
        evaluate(written(tmp_path / "other.py", f"{line}\n    pass\n"), seeds=[1], pool=processes(1))


def test_a_closed_reader_is_no_error(idle: str) -> None:
    command = [sys.executable, "-m", "palmares", "evaluate", idle, "--seeds", "1", "--quiet"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        child.stdout.close()
        assert child.stderr.read() == ""
    assert child.returncode == 128 + signal.SIGPIPE


def test_json_has_everything(idle: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([idle, "--seeds", "7-8", "--quiet", "--json", "--jobs", "1"]) == 0
    printed = json.loads(capsys.readouterr().out)
    (row,) = printed["rows"]
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


@needs_server
def test_over_the_socket_it_is_the_same_and_names_the_replays(idle: str, tmp_path: Path) -> None:
    with RealServer(tmp_path / "data") as server:
        there = evaluate(idle, "grasp", "pinch", [1, 2], url=server.url, pool=processes(2))
        here = evaluate(idle, "grasp", "pinch", [1, 2], pool=processes(2))
        runs = there.rows[0].runs
        assert [run.state_hash for run in runs] == [run.state_hash for run in here.rows[0].runs]
        assert [run.replay for run in runs] == [f"{server.url}/replay/{run.run_id}" for run in runs]
        with pytest.raises(palmares.PalmaresError, match="no hand `fist`"):
            evaluate(idle, hands="fist", url=server.url)


def test_invalid_evaluations_are_refused(
    fails: str, idle: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ControllerError, match="no parameter `task`"):
        evaluate(fails, tasks=["grasp", "balls"])
    with pytest.raises(ControllerError, match="plays the task 'grasp', not 'balls'"):
        evaluate(fails, tasks="balls", seeds=[1], pool=processes(1))
    with pytest.raises(ControllerError, match="plays the hand 'softhand', not 'pinch'"):
        evaluate(fails, hands="pinch", seeds=[1], pool=processes(1))
    with pytest.raises(palmares.PalmaresError, match=r"\"bals\" is neither a task of the program"):
        evaluate(idle, tasks="bals")
    with pytest.raises(palmares.PalmaresError, match=r"\"fist\" is neither a hand of the program"):
        evaluate(idle, hands="fist")
    with pytest.raises(ValueError, match="seeds: found none"):
        evaluate(idle, seeds=[])
    with pytest.raises(ValueError, match="seeds: found more than 1000000; wanted 1 to 1000000"):
        evaluate(idle, seeds=range(10**9))
    with pytest.raises(ValueError, match="seeds: found -1; wanted a whole number from 0 to"):
        evaluate(idle, seeds=[1, -1])
    with pytest.raises(ControllerError, match="no such file"):
        evaluate(str(tmp_path / "none.py"))
    with pytest.raises(ControllerError, match="ModuleNotFoundError"):
        evaluate("no.such.module")
    with pytest.raises(ControllerError, match="no function"):
        evaluate(written(tmp_path / "empty.py", "walk = 1\n"))
    with pytest.raises(ControllerError, match="SystemExit: 4"):
        evaluate(written(tmp_path / "leaves.py", "raise SystemExit(4)\n"))
    assert main([idle, "--ray", "--timeout-s", "5", "--quiet"]) == 1
    assert "--timeout-s is for the processes of this machine, without --ray" in capsys.readouterr().err
    assert main([idle, "--url", "http://127.0.0.1:9", "--quiet"]) == 1
    assert "no server at http://127.0.0.1:9" in capsys.readouterr().err


def test_seeds_are_a_number_a_range_or_a_list() -> None:
    assert list(seeds("3")) == [1, 2, 3]
    assert list(seeds("5001-5003")) == [5001, 5002, 5003]
    assert list(seeds("3,5,8")) == [3, 5, 8]
    assert parser().parse_args(["a.py"]).seeds == range(1, 101)
    assert parser().parse_args(["a.py", "--scenes", "7"]).seeds == range(1, 8)
    assert parser().parse_args(["a.py", "--seeds", "7"]).seeds == range(1, 8), "the old spelling of --scenes"
    assert parser().parse_args(["a.py", "--seeds", "5001-5003"]).seeds == range(5001, 5004)
    for wrong_count in ("0", "-1", "3,5", str(MAX_SEEDS + 1)):
        with pytest.raises(SystemExit):
            parser().parse_args(["a.py", f"--scenes={wrong_count}"])
    assert len(seeds(str(MAX_SEEDS))) == MAX_SEEDS
    for many in ("1-1000000000", "1000001"):
        with pytest.raises(Exception, match=r"found \d+ seeds; wanted at most 1000000"):
            seeds(many)
    for wrong in ("0", "-1", "5-3", "a", "", "1-2-3", str(2**53) + ",", "1-" + "9" * 30, "9" * 30):
        with pytest.raises(Exception, match="wanted a number"):
            seeds(wrong)


def test_the_word_after_ray_is_an_address_or_a_controller() -> None:
    def parsed(*arguments: str) -> tuple[str | None, list[str]]:
        options = parser().parse_args(list(separated(arguments)))
        return options.ray, options.controllers

    assert parsed("a.py") == (None, ["a.py"])
    assert parsed("--ray", "a.py") == parsed("a.py", "--ray") == ("", ["a.py"])
    assert parsed("--ray", "10.0.0.1:6379", "a.py") == ("10.0.0.1:6379", ["a.py"])
    assert parsed("a.py", "--ray", "auto") == parsed("a.py", "--ray=auto") == ("auto", ["a.py"])


def test_the_paired_test_counts_every_sign_of_few_differences() -> None:
    # Two of the 8 sign patterns of three differences of 1 have a sum of ±3.
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
