"""Tests of the estimate of the remaining time."""

from dataclasses import replace

import pytest

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunStarted, SessionStarted
from simscen.report.live_console import ProgressEstimate, _round_duration


class Clock:
    """Clock that tests set."""

    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def session(passed):
    """Return a function that returns the estimate for a session of ten runs of 1 s each.

    `kept` runs are from an earlier session, and `finished` runs have run since.
    """

    def estimate_after(finished, kept=0):
        clock = Clock()
        estimate = ProgressEstimate(clock)
        estimate(SessionStarted("0.1.0", 10, 10, 1))
        for number in range(kept + finished):
            run = replace(passed, result=replace(passed.result, key=RunKey("navigation/goal", number + 1)))
            if number >= kept:
                estimate(RunStarted(run.key, run.result.path))
                clock.now += 1.0
            estimate(run)
        return estimate

    return estimate_after


def test_remaining_time_is_extrapolated(session):
    assert session(finished=4).remaining_s == 6.0
    assert session(finished=4).text == "4 of 10, about 5 s left"


def test_kept_runs_do_not_count_for_the_estimate(session):
    assert session(finished=2, kept=5).remaining_s == 3.0


def test_no_estimate_after_one_run(session):
    assert session(finished=1).text == "1 of 10"


def test_single_run_has_no_progress_text():
    estimate = ProgressEstimate(Clock())
    estimate(SessionStarted("0.1.0", 1, 1, 1))
    assert estimate.text == ""


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [(0.4, "5 s"), (42, "40 s"), (89, "90 s"), (100, "2 min"), (5000, "83 min"), (9000, "2.5 h")],
)
def test_durations_are_rounded(seconds, expected):
    assert _round_duration(seconds) == expected
