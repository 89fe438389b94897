"""Tests of the summary of a session."""

from collections.abc import Iterable
from dataclasses import replace

import pytest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.judge.metrics.session_summary import (
    SessionSummary,
    SessionSummaryBuilder,
    session_summary_data,
    session_summary_line,
)


def summarize_session(results: Iterable[RunResult]) -> SessionSummary:
    figures = SessionSummaryBuilder()
    for result in results:
        figures.add(result)
    return figures.summary()


def run(seed, simulated=1800.0, **metrics):
    return RunResult(RunKey("a", seed), "a.yaml", Outcome.PASSED, metrics=metrics, simulated=simulated)


RUNS = [
    run(1, success=1.0, spl=0.9, soft_spl=0.9, collisions=0.0, path_length=1500.0),
    run(2, success=0.0, spl=0.0, soft_spl=0.5, collisions=3.0, path_length=500.0),
    run(3, success=1.0, spl=None, soft_spl=None, collisions=0.0, path_length=0.0),
    RunResult(RunKey("a", 4), "a.yaml", Outcome.ERROR, error=RunFailure("crashed", "SIGSEGV")),
]


def test_rates_are_over_all_runs_and_means_over_runs_with_the_metric():
    figures = summarize_session(RUNS)
    assert figures.success_rate == 0.5
    assert figures.success_interval == pytest.approx((0.15, 0.85), abs=0.01)
    assert (figures.spl, figures.soft_spl, figures.spl_runs) == (pytest.approx(0.45), pytest.approx(0.7), 2)
    assert (figures.collisions_per_km, figures.collisions_per_hour) == (1.5, 2.0)
    assert (figures.runs, figures.measured_runs, figures.kilometers, figures.hours) == (4, 3, 2.0, 1.5)


@pytest.mark.parametrize("kind", ["interrupted", "not-run"])
def test_runs_that_the_end_of_the_session_prevented_are_not_failures(kind):
    unfinished = RunResult(RunKey("a", 5), "a.yaml", Outcome.ERROR, error=RunFailure(kind, "the session ended"))
    assert summarize_session([*RUNS, unfinished]) == summarize_session(RUNS)


def test_order_of_runs_does_not_change_the_summary():
    runs = [run(seed, success=1.0, spl=0.1 * seed, path_length=0.1 * seed, collisions=0.0) for seed in (1, 2, 3)]
    assert 0.1 + 0.2 + 0.3 != 0.3 + 0.2 + 0.1  # sums of rounded numbers depend on the order
    assert summarize_session(runs) == summarize_session(reversed(runs))


def test_summary_line_has_the_numbers_of_runs():
    line = (
        "success 50% of 4 runs (15% … 85%) · SPL 0.45 of 2 values · "
        "1.5 collisions/km, 2.0/h in 2.00 km, 1.50 h of 3 runs"
    )
    assert session_summary_line(summarize_session(RUNS)) == line
    assert session_summary_line(summarize_session(RUNS[2:3])) == "success 100% of 1 run (21% … 100%)"


def test_summary_without_runs_has_no_rates():
    figures = summarize_session([])
    assert session_summary_line(figures) == ""
    data = session_summary_data(figures)
    assert data["runs"] == data["judged_runs"] == data["measured_runs"] == 0
    for name in (
        "collisions",
        "success_rate",
        "success_interval",
        "spl",
        "soft_spl",
        "collisions_per_km",
        "collisions_per_hour",
    ):
        assert data[name] is None


def test_unknown_success_and_unknown_collisions_do_not_count():
    """Logs of real robots have no contacts, and therefore neither collisions nor success."""
    unknown = run(5, success=None, collisions=None, path_length=5000.0)
    figures = summarize_session([unknown])
    assert session_summary_data(figures)["runs"] == 1
    assert (figures.success_rate, figures.collisions, figures.collisions_per_km) == (None, None, None)
    assert session_summary_line(figures) == ""
    drove = replace(figures, kilometers=1.0, hours=1.0)
    assert (drove.collisions_per_km, drove.collisions_per_hour) == (None, None)
    more = summarize_session([*RUNS, unknown])
    assert session_summary_line(more) == session_summary_line(summarize_session(RUNS))
    assert (more.runs, more.judged_runs, more.measured_runs, more.collisions) == (5, 4, 3, 3)


def test_a_robot_with_an_unknown_distance_adds_none():
    figures = summarize_session([*RUNS, run(5, success=1.0, collisions=1.0, path_length=None)])
    assert (figures.collisions, figures.kilometers) == (4, 2.0)


def test_rates_of_several_robots_are_over_those_with_known_collisions():
    metrics = {"success": 0.0, "a/collisions": 2.0, "a/path_length": 1000.0, "b/path_length": 7000.0}
    figures = summarize_session([run(1, **metrics, **{"b/collisions": None})])
    assert (figures.collisions, figures.kilometers, figures.hours) == (2, 1.0, 0.5)


def test_runs_with_errors_did_not_succeed():
    figures = summarize_session(RUNS[3:])
    assert (figures.success_rate, figures.measured_runs, figures.collisions_per_km) == (0.0, 0, None)
    assert figures.collisions_per_hour is None


def test_short_paths_and_times_have_rates():
    figures = summarize_session([run(1, simulated=36.0, success=0.0, collisions=2.0, path_length=10.0)])
    assert (figures.collisions_per_km, figures.collisions_per_hour) == (200.0, 200.0)


def test_distances_and_collisions_of_robots_are_added_and_all_must_succeed():
    metrics = {
        "a/spl": 0.5,
        "b/spl": None,
        "a/collisions": 1.0,
        "b/collisions": 2.0,
        "a/success": 1.0,
        "b/success": 0.0,
    }
    two = run(1, **metrics, success=0.0, **{"a/path_length": 1500.0, "b/path_length": 500.0})
    figures = summarize_session([two])
    assert (figures.runs, figures.measured_runs, figures.success_rate) == (1, 1, 0.0)
    assert (figures.spl, figures.spl_runs) == (0.5, 1)
    assert (figures.collisions, figures.kilometers, figures.hours) == (3, 2.0, 1.0)


def test_summary_is_bit_identical_in_any_order_of_runs() -> None:
    lengths = {1: 1e16, 2: 1.0, 3: 1.0}  # 1e16 + 1 + 1 = 1e16, but 1 + 1 + 1e16 > 1e16
    results = [
        RunResult(RunKey("a", seed), "a", Outcome.PASSED, metrics={"path_length": length})
        for seed, length in lengths.items()
    ]
    assert summarize_session(results) == summarize_session(reversed(results))
    assert sum(lengths.values()) != sum(reversed(lengths.values()))
