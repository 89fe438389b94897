"""Tests of properties that all criteria share."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.findings import InvalidTrace, at_least, at_most, counted
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.spec.base import annotation_of
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CHOICES = AnyCriterion.choices()
HEADINGS = ["What is measured:", "When it fails:", "Why this:", "Source:", "Example:"]
NUMBERS = st.floats(min_value=-1e6, max_value=1e6)

TRACE = {
    "seconds": 8,
    "truth": [[0, 0, 0], [4, 2, 0.5], [8, 2.5, 0.5]],
    "events": [
        [0.5, "goal.accepted", "shelf"],
        [2, "fault.started", "lidar.off"],
        [2, "event.started", "kidnapped"],
        [3, "plan.made", "", {"reason": "blocked"}],
        [4, "recovery.started", "spin"],
        [5, "collision.started", "wall", {"x": 1.0, "y": 2.0, "impulse": 1.0, "speed": 0.2}],
        [7, "goal.reached", "shelf"],
        [7, "navigation.ended", "SUCCEEDED", {"error_code": 0}],
    ],
}
CASE = {"goals": [{"name": "shelf", "pose": [2.5, 0.5, 0]}], "shortest": {"shelf": 2.5}}


def specification(kind):
    return annotation_of(AnyCriterion.model_fields[CHOICES[kind]])


def example(kind):
    text = re.search(r"Example: `(.+)`", specification(kind).__doc__)[1]
    return AnyCriterion.model_validate(yaml.safe_load(text))


@pytest.mark.parametrize("kind", CHOICES)
def test_docstring_has_required_sections_and_a_valid_example(kind):
    doc = specification(kind).__doc__
    positions = [doc.find(heading) for heading in HEADINGS]
    assert -1 not in positions
    assert positions == sorted(positions)
    assert example(kind).kind == kind


@pytest.mark.parametrize("kind", CHOICES)
def test_the_same_trace_gives_the_same_findings(kind):
    criterion, trace, case = example(kind).chosen, synthetic_trace(TRACE), synthetic_case(CASE)
    first, second = criterion.judge(trace, case), criterion.judge(trace, case)
    assert first
    assert first == second


def test_a_margin_has_the_sign_of_the_status():
    kinds_with_margin = set()
    for kind in CHOICES:
        for finding in example(kind).chosen.judge(synthetic_trace(TRACE), synthetic_case(CASE)):
            if finding.margin is not None:
                kinds_with_margin.add(kind)
                assert (finding.status is Status.PASS) == (finding.margin >= 0)
    assert kinds_with_margin >= {
        "goals_reached",
        "clearance",
        "time_to_goal",
        "path_length",
        "speed",
        "stuck",
        "replans",
    }


@pytest.mark.parametrize("kind", CHOICES)
def test_no_criterion_passes_on_a_truncated_log(kind):
    (verdict,) = judge([example(kind)], synthetic_trace({**TRACE, "ended": None}), synthetic_case(CASE))
    assert verdict.status is not Status.PASS


def trace_without_messages(seconds):
    """Return the trace of a complete log without messages."""
    trace = synthetic_trace({"seconds": seconds, "truth": [[0, 0, 0]], "belief": None, "scans": []})
    empty = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    no_clearance = Samples(empty.ticks, np.empty((0, 1)))
    return replace(trace, truth=empty, velocity=empty, clearance=no_clearance, odometry=empty, command=empty)


@pytest.mark.parametrize("kind", CHOICES)
@pytest.mark.parametrize("seconds", [0, 8])
@pytest.mark.parametrize("case", [CASE, {}], ids=["with goals", "without goals"])
def test_complete_log_without_messages_does_not_pass(kind, seconds, case):
    (verdict,) = judge([example(kind)], trace_without_messages(seconds), synthetic_case(case))
    assert verdict.status in (Status.FAIL, Status.INCONCLUSIVE), verdict


@pytest.mark.parametrize("kind", ["path_length", "speed", "stopped_within", "localization_error", "goals_reached"])
def test_nan_in_the_truth_is_an_error_with_its_time(kind):
    truth = [[0, 0, 0], [4, 2, math.nan], [4.1, 2, 0.5], [8, 2.5, 0.5]]
    (verdict,) = judge([example(kind)], synthetic_trace({**TRACE, "truth": truth}), synthetic_case(CASE))
    assert verdict.status is Status.ERROR
    assert re.search(r"not finite at t = [\d.]+ s", verdict.findings[0].measured)


@given(NUMBERS, NUMBERS)
def test_an_upper_bound_holds_exactly_when_its_margin_is_not_negative(value, limit):
    finding = at_most("x", value, limit, "m")
    assert (finding.status is Status.PASS) == (value <= limit) == (finding.margin >= 0)


@given(NUMBERS, NUMBERS)
def test_a_lower_bound_holds_exactly_when_its_margin_is_not_negative(value, limit):
    finding = at_least("x", value, limit, "m")
    assert (finding.status is Status.PASS) == (value >= limit) == (finding.margin >= 0)


@given(NUMBERS, NUMBERS)
def test_texts_of_two_different_numbers_differ(value, limit):
    assume(abs(value - limit) > 1e-8)
    finding = at_most("x", value, limit, "m")
    assert finding.measured != finding.limit.removeprefix("≤ ")


@given(st.integers(0, 50), st.integers(0, 50), st.integers(0, 50))
def test_counts_are_bounded_on_both_sides(count, low, high):
    minimum, maximum = counted("x", count, "thing", low, high)
    assert (minimum.status is Status.PASS) == (count >= low)
    assert (maximum.status is Status.PASS) == (count <= high)


def test_comparison_with_nan_is_refused():
    with pytest.raises(InvalidTrace, match="clearance is not a number"):
        at_most("clearance", math.nan, 1.0, "m")
