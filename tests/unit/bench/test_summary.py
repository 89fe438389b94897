"""Tests of the summary of an experiment: outcomes, rates, times, and scores."""

from dataclasses import replace

import pytest
from finished_runs import ARRIVED, GAVE_UP, HIT, LATE, run

from simscen.bench.navigation.summary import Trial, TrialOutcome, summarize
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished


@pytest.mark.parametrize(
    ("finished", "outcome"),
    [
        (ARRIVED, TrialOutcome.SUCCESS),
        (HIT, TrialOutcome.COLLISION),
        (run(Outcome.FAILED, collided=True, ended="time limit"), TrialOutcome.COLLISION),
        (LATE, TrialOutcome.TIMEOUT),
        (GAVE_UP, TrialOutcome.FAILED),
        (run(Outcome.ERROR), TrialOutcome.ERROR),
    ],
)
def test_run_has_exactly_one_outcome(finished: RunFinished, outcome: TrialOutcome) -> None:
    assert Trial(finished).outcome is outcome


def test_rates_are_over_all_runs_and_times_over_successful_runs() -> None:
    row = summarize("BARN", [Trial(r, 10.0) for r in (ARRIVED, ARRIVED, HIT, LATE)])
    assert (row.runs, row.success, row.collisions, row.timeouts, row.failed) == (4, 0.5, 0.25, 0.25, 0.0)
    assert row.seconds == 8.0


def test_failed_runs_have_score_zero() -> None:
    # 10 m at 2 m/s is 5 s; arriving within 10 s is worth 0.5.
    assert summarize("BARN", [Trial(ARRIVED, 10.0), Trial(HIT, 10.0)]).score == pytest.approx(0.25)


def test_a_case_without_reference_has_no_score() -> None:
    assert summarize("doorway", [Trial(ARRIVED)]).score is None


def test_success_is_weighted_by_the_time_of_the_shortest_path_at_top_speed() -> None:
    # 10 m at 2 m/s is 5 s; it took 8 s. A failed drive scores 0, and the maximum is 1.
    assert summarize("BARN", [Trial(ARRIVED, top_speed=2.0), Trial(HIT, top_speed=2.0)]).sct == pytest.approx(5 / 8 / 2)
    assert summarize("BARN", [Trial(ARRIVED, top_speed=1.0)]).sct == 1.0


def test_scenario_without_an_arrival_has_no_sct() -> None:
    refused = run(Outcome.PASSED, seconds=None)
    assert summarize("blocked", [Trial(refused, top_speed=1.0), Trial(GAVE_UP, top_speed=1.0)]).sct is None


def test_times_of_several_robots_are_averaged() -> None:
    metrics = {"success": 1.0, "a/time_to_goal": 10.0, "b/time_to_goal": 14.0, "a/shortest_length": 6.0}
    finished = replace(ARRIVED, result=replace(ARRIVED.result, metrics=metrics))
    assert Trial(finished).metric("time_to_goal") == 12.0
    assert Trial(finished, top_speed=0.5).sct == 1.0
    assert Trial(finished, top_speed=1.0).sct == 0.5
