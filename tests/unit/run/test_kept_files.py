"""Tests of the options that select which files of a run are kept."""

from pathlib import Path

import pytest

from simscen.core.records.run_result import Outcome
from simscen.loading.scenario import load_scenario
from simscen.run.kept_files import LogRetention, OutcomeFilter
from simscen.run.sessions.run_session import SessionOptions

GOOD = {Outcome.PASSED, Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED}


@pytest.mark.parametrize("outcome", Outcome)
def test_files_for_failures_are_not_written_for_good_outcomes(outcome: Outcome) -> None:
    assert OutcomeFilter.ALL.includes(outcome)
    assert not OutcomeFilter.NONE.includes(outcome)
    assert OutcomeFilter.FAILED.includes(outcome) == (outcome not in GOOD)


@pytest.mark.parametrize(("keep_logs", "picture"), [("all", "all"), ("failed", "failed")])
def test_pictures_are_drawn_for_runs_that_keep_them(tmp_path: Path, keep_logs: str, picture: str) -> None:
    file = tmp_path / "a.scenario.yaml"
    file.write_text(
        "simscen: 1\nworld: {simscen: 1}\nrobot: {pose: {x: 1, y: 1}}\ngoals: []\npass: [{collisions: {max: 0}}]\n"
    )
    scenario = load_scenario(file, tmp_path)
    options = SessionOptions(keep_logs=LogRetention(keep_logs))
    assert options.job(0, scenario, scenario.key(1), tmp_path).picture is OutcomeFilter(picture)
