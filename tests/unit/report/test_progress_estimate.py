"""Tests of the estimate of the remaining time."""

from dataclasses import replace

import pytest

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunStarted, SessionStarted
from simscen.report.live_console import ProgressEstimate, _round_duration


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def session(passed):
    """Runs of a session of ten, a second each; `kept` of them were there before."""

    def expected(done, kept=0):
        clock = Clock()
        remaining = ProgressEstimate(clock)
        remaining(SessionStarted("0.1.0", 10, 10, 1))
        for number in range(kept + done):
            run = replace(passed, result=replace(passed.result, key=RunKey("navigation/goal", number + 1)))
            if number >= kept:
                remaining(RunStarted(run.key, run.result.path))
                clock.now += 1.0
            remaining(run)
        return remaining

    return expected


def test_remaining_time_is_extrapolated(session):
    assert session(done=4).remaining_s == 6.0
    assert session(done=4).text == "4 of 10, about 5 s left"


def test_kept_runs_do_not_count_for_the_estimate(session):
    assert session(done=2, kept=5).remaining_s == 3.0


def test_no_estimate_after_one_run(session):
    assert session(done=1).text == "1 of 10"


def test_single_run_has_no_progress_text():
    remaining = ProgressEstimate(Clock())
    remaining(SessionStarted("0.1.0", 1, 1, 1))
    assert remaining.text == ""


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [(0.4, "5 s"), (42, "40 s"), (89, "90 s"), (100, "2 min"), (5000, "83 min"), (9000, "2.5 h")],
)
def test_times_are_rounded(seconds, expected):
    assert _round_duration(seconds) == expected
