"""A run ends a while after its task, whatever is sampled how often."""

import numpy as np
import pytest

from simscen.core.clock import Clock
from simscen.core.geometry.kinematics import STOP
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.run.termination import EndCondition
from simscen.testing.sketch import sketch_case

RATES = [
    (240, 40, 20),
    (240, 10, 20),
    (240, 30, 20),
    (240, 40, 30),
    (240, 0.5, 20),
    (240, 48, 30),
    (120, 1, 24),
    (1000, 8, 20),
]


@pytest.mark.parametrize(("tick_rate", "truth_rate", "controller"), RATES)
def test_a_run_ends_soon_after_its_task_at_all_rates_and_with_a_sample_of_the_truth(
    play, tick_rate, truth_rate, controller
):
    trace = play(
        physics=f"{{tick_rate: {tick_rate}, truth_rate: {truth_rate} Hz}}",
        stack=f"{{controller_frequency: {controller} Hz, localizer: {{type: ground_truth}}}}",
    )
    (navigated,), (ended,) = trace.of_kind("navigation.ended"), trace.of_kind("run.ended")
    assert ended.name == "navigation ended"
    assert 0.5 <= trace.seconds(ended.tick - navigated.tick) < 0.5 + 1 / truth_rate
    assert trace.truth.ticks[-1] == trace.end == ended.tick
    assert len(set(np.diff(trace.truth.ticks))) == 1, "evenly spaced to the end"


def test_a_run_that_goes_nowhere_ends_at_its_time_limit_with_a_sample_of_the_truth(play):
    trace = play(goals="[]", time_limit="1.3", physics="{truth_rate: 1 Hz}", **{"pass": "[{collisions: {max: 0}}]"})
    assert trace.of_kind("run.ended")[0].name == "time limit"
    assert trace.truth.ticks.tolist() == [0, 240, 480]


def test_an_end_between_two_samples_breaks_nothing_that_is_derived_from_them(play):
    trace = play(linger="0.33", physics="{truth_rate: 10 Hz}", stack="{localizer: {type: ground_truth}}")
    criterion = AnyCriterion.model_validate({"always": {"signal": "jerk", "op": "<=", "value": 1e6}})
    (verdict,) = judge([criterion], trace, sketch_case({}))
    assert verdict.status is Status.PASS, verdict


def test_a_new_goal_takes_the_ending_back():
    ending = EndCondition(Clock(240), 60.0, 0.5)
    ending.update(Decision(STOP, events=(Event(100, EventKind.NAVIGATION_ENDED),)))
    assert not ending.reached(219)
    assert ending.reached(220)
    ending.update(Decision(STOP, events=(Event(120, EventKind.GOAL_ACCEPTED),)))
    assert not ending.reached(220)
    assert ending.reached(60 * 240)
