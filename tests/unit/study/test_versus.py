import pytest
from finishedruns import ARRIVED, HIT, run

from simscen.core.result import Outcome
from simscen.study.tally import Trial, over_worlds, tally
from simscen.study.versus import versus

SLOW = run(Outcome.PASSED, seconds=12.0)


def test_the_interval_is_over_worlds_however_many_seeds_each_has() -> None:
    few = [Trial(r, world=f"{n}") for n, r in enumerate((ARRIVED, HIT, ARRIVED, ARRIVED, HIT, ARRIVED))]
    many = [Trial(trial.run, world=trial.world) for trial in few for _ in range(20)]
    assert over_worlds(few) == over_worlds(many)
    low, high = over_worlds(few) or (0.0, 0.0)
    assert low == pytest.approx(1 / 3, abs=0.01)  # of six worlds, four or so good ones: 2.5 % have at most two
    assert high == 1.0


def test_worlds_that_all_say_the_same_leave_wilsons_doubt() -> None:
    assert over_worlds([Trial(ARRIVED, world=f"{n}") for n in range(10)]) == pytest.approx((0.722, 1.0), abs=1e-3)


def test_one_world_says_nothing_of_others() -> None:
    assert tally("doorway", [Trial(ARRIVED, world="w")] * 20).success_interval is None


def test_a_stack_is_compared_in_the_drives_that_both_have_done() -> None:
    before = [Trial(r, 10.0, f"{n}") for n, r in enumerate((ARRIVED, ARRIVED, HIT, HIT, ARRIVED, run(Outcome.ERROR)))]
    after = [Trial(r, 10.0, f"{n}") for n, r in enumerate((SLOW, SLOW, SLOW, HIT, HIT, ARRIVED))]
    said = versus("fields", before, after)
    assert (said.pairs, said.better, said.worse) == (5, 1, 1)
    assert said.success.mean == 0.0
    assert said.seconds is not None and said.seconds.mean == 4.0  # of the two drives in which both arrived
    # 10 m at 2 m/s: 0.5 for 8 s, 5/12 for 12 s
    assert said.score is not None and said.score.mean == pytest.approx((3 * 5 / 12 - 3 * 0.5) / 5)


def test_runs_of_other_drives_are_not_compared() -> None:
    with pytest.raises(ValueError, match="not of the same drives"):
        versus("fields", [Trial(ARRIVED, world="a")], [Trial(ARRIVED, world="b")])
