import pytest
from finishedruns import ARRIVED, GAVE_UP, HIT, LATE, run

from simscen.core.result import Outcome
from simscen.core.sessionevents import RunFinished
from simscen.study.tally import Fate, Trial, tally


@pytest.mark.parametrize(
    ("finished", "fate"),
    [
        (ARRIVED, Fate.SUCCESS),
        (HIT, Fate.COLLISION),
        (run(Outcome.FAILED, collided=True, ended="time limit"), Fate.COLLISION),
        (LATE, Fate.TIMEOUT),
        (GAVE_UP, Fate.FAILED),
        (run(Outcome.ERROR), Fate.ERROR),
    ],
)
def test_a_run_has_exactly_one_fate(finished: RunFinished, fate: Fate) -> None:
    assert Trial(finished).fate is fate


def test_rates_are_of_all_runs_and_times_of_the_good_ones() -> None:
    row = tally("BARN", [Trial(r, 10.0) for r in (ARRIVED, ARRIVED, HIT, LATE)])
    assert (row.runs, row.success, row.collisions, row.timeouts, row.failed) == (4, 0.5, 0.25, 0.25, 0.0)
    assert row.seconds == 8.0


def test_a_score_counts_failures_as_nothing() -> None:
    # 10 m at 2 m/s is 5 s; arriving within 10 s is worth 0.5.
    assert tally("BARN", [Trial(ARRIVED, 10.0), Trial(HIT, 10.0)]).score == pytest.approx(0.25)


def test_a_case_without_reference_has_no_score() -> None:
    assert tally("doorway", [Trial(ARRIVED)]).score is None
