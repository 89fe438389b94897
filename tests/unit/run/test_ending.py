"""Tests of the end of a run."""

import numpy as np
import pytest

from simscen.core.clock import Clock
from simscen.core.geometry.kinematics import STOP
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.run.lockstep import EndCondition
from simscen.testing.synthetic_trace import synthetic_case

RATES = [
    (240, 40, 20),
    (240, 20, 5),
    (240, 30, 20),
    (240, 40, 30),
    (240, 240, 20),
    (240, 48, 30),
    (120, 24, 20),
    (1000, 25, 20),
]


@pytest.mark.parametrize(("tick_rate", "truth_rate", "controller"), RATES)
def test_run_ends_soon_after_navigation_with_a_truth_sample_at_all_rates(play, tick_rate, truth_rate, controller):
    trace = play(
        physics=f"{{tick_rate: {tick_rate}, truth_rate: {truth_rate} Hz}}",
        stack=f"{{controller_frequency: {controller} Hz, localizer: {{type: ground_truth}}}}",
    )
    (navigated,), (ended,) = trace.of_kind("navigation.ended"), trace.of_kind("run.ended")
    assert ended.name == "navigation ended"
    assert 0.5 <= trace.seconds(ended.tick - navigated.tick) < 0.5 + 1 / truth_rate
    assert trace.truth.ticks[-1] == trace.end == ended.tick
    assert len(set(np.diff(trace.truth.ticks))) == 1, "evenly spaced to the end"


@pytest.mark.parametrize(("truth_rate", "time_limit"), [(20, "110 ms"), (40, "101 ms"), (240, "100 ms"), (20, "60 ms")])
@pytest.mark.parametrize("robots", [1, 2])
def test_run_ends_exactly_at_its_time_limit_with_a_truth_sample(play, truth_rate, time_limit, robots):
    keys = {"goals": "[]", "pass": "[{collisions: {max: 0}}]"}
    if robots == 2:
        del keys["goals"]
        keys |= {"robots": "{a: {pose: {x: 1, y: 1}}, b: {pose: {x: 3, y: 1}, goals: [{pose: {x: 7, y: 5}}]}}"}
    trace = play(time_limit=time_limit, physics=f"{{truth_rate: {truth_rate} Hz}}", **keys)
    (ended,) = trace.of_kind("run.ended")
    limit = round(float(time_limit.removesuffix(" ms")) / 1000 * 240)
    assert ended.name == "time limit"
    assert ended.tick == trace.end == trace.truth.ticks[-1] == limit
    period = 240 // truth_rate
    assert trace.truth.ticks[:-1].tolist() == list(range(0, limit, period))


def test_run_that_ends_between_two_samples_can_be_judged(play):
    trace = play(time_limit="2.01", physics="{truth_rate: 20 Hz}", stack="{localizer: {type: ground_truth}}")
    criterion = AnyCriterion.model_validate({"always": {"signal": "jerk", "op": "<=", "value": 1e6}})
    (verdict,) = judge([criterion], trace, synthetic_case({}))
    assert verdict.status is Status.PASS, verdict


def test_new_goal_cancels_the_end_of_the_run():
    ending = EndCondition(Clock(240), 60.0, 0.5)
    ending.update(Decision(STOP, events=(Event(100, EventKind.NAVIGATION_ENDED),)))
    assert not ending.end_event(219)
    assert ending.end_event(220)
    ending.update(Decision(STOP, events=(Event(120, EventKind.GOAL_ACCEPTED),)))
    assert not ending.end_event(220)
    assert ending.end_event(60 * 240)
