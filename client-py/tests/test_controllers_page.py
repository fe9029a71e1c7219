"""How many scenes `benchmarks/controllers.py` plays for a page."""

import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias

import pytest

pytest.importorskip("palmares._native", reason="the compiled part of the package is not there")
from palmares.evaluate import Job, Played

ROOT = Path(__file__).resolve().parents[2]
SEEDS = range(1, 101)


@pytest.fixture(scope="module")
def page() -> Iterator[ModuleType]:
    sys.path.insert(0, str(ROOT / "client-py/benchmarks"))
    import controllers

    yield controllers
    sys.path.remove(str(ROOT / "client-py/benchmarks"))


class Scores:
    """A pool in which a seed's score is known."""

    def __init__(self, of: Callable[[int], float], state_hash: str = "h") -> None:
        self.of, self.state_hash = of, state_hash
        self.played: list[int] = []

    def __call__(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Played]]:
        """Play the jobs."""
        for job in reversed(jobs):  # In any order.
            self.played.append(job.seed)
            score = self.of(job.seed)
            yield job, Played("c", "balls", "softhand", job.seed, score=score, state_hash=self.state_hash)


Runs: TypeAlias = Callable[[Scores], Any]


@pytest.fixture
def runs(page: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runs:
    monkeypatch.setattr(page, "KEPT", tmp_path)
    file = tmp_path / "c.py"
    file.write_text("")

    def made(scores: Scores) -> Any:
        monkeypatch.setattr(page, "pool_of", lambda *_: ("c", "local", scores))
        return page.Runs("c", file, None)

    return made


@pytest.mark.parametrize(("spread", "count"), [(0.0, 20), (0.8, 40), (5.0, 100)])
def test_scenes_are_played_until_the_mean_is_known(runs: Runs, spread: float, count: int) -> None:
    # Half of the interval is about 2 s / √n, with s = spread: 0.35 of 20 scenes, 0.25 of 40; 0.3 is enough.
    scores = Scores(lambda seed: 5.0 + spread * (-1) ** seed)
    played = runs(scores).until_known(SEEDS, 10.0, math.inf)
    assert [run.seed for run in played] == list(SEEDS)[:count]
    assert sorted(scores.played) == list(SEEDS)[:count]


def test_a_stopped_evaluation_goes_on(runs: Runs, tmp_path: Path) -> None:
    scores = Scores(lambda seed: 5.0 + 5.0 * (-1) ** seed)
    assert runs(scores).until_known(SEEDS, 10.0, 0.0) is None
    assert scores.played == []
    runs(scores).until_known(range(1, 31), 10.0, math.inf)
    again = Scores(scores.of)
    assert len(runs(again).until_known(SEEDS, 10.0, math.inf)) == 100
    # The worst run first, to see that it ends alike.
    assert sorted(again.played[1:]) == list(range(31, 101))
    (file,) = tmp_path.glob("*.jsonl")
    assert len([json.loads(line) for line in file.read_text().splitlines()]) == 100


def test_runs_that_end_otherwise_now_are_played_again(runs: Runs) -> None:
    runs(Scores(lambda _: 5.0)).until_known(SEEDS, 10.0, math.inf)
    changed = Scores(lambda _: 6.0, "other")
    played = runs(changed).until_known(SEEDS, 10.0, math.inf)
    assert {(run.score, run.state_hash) for run in played} == {(6.0, "other")}
