"""Tests of temporal criteria: required evidence, unit of the margin, and findings."""

import math

import pytest

from simscen.core.records.verdict import Evidence, Status
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def criterion(keys):
    chosen = AnyCriterion.model_validate(keys).chosen
    assert isinstance(chosen, TemporalCriterion)
    return chosen


def finding_of(keys, trace, case=None):
    (verdict,) = judge([AnyCriterion.model_validate(keys)], synthetic_trace(trace), synthetic_case(case or {}))
    (finding,) = verdict.findings
    return finding


FAR = {"signal": "clearance", "op": ">", "value": 2.0}
FARTHER = {"signal": "clearance", "op": ">", "value": 3.0}
SLOW = {"signal": "speed", "op": "<", "value": 1.0}
IN_COLLISION = {"signal": "in_collision"}
CART = {"signal": "distance_to", "object": "cart", "op": ">", "value": 1.0}
STILL = {"seconds": 1, "truth": [[0, 0, 0]]}


@pytest.mark.parametrize(
    ("keys", "meters"),
    [
        ({"always": FAR}, 2.5),
        ({"always": {"any": [FARTHER, FAR, SLOW]}}, 3.5),
        ({"until": {"hold": SLOW, "release": FAR}}, 2.5),
        ({"whenever": FAR, "then": FARTHER}, 3.5),
        ({"eventually": {"any": [SLOW, {"signal": "goal_distance", "op": "<", "value": 5.0}]}}, 0.0),
        ({"always": IN_COLLISION}, 0.0),
    ],
)
def test_the_clearance_is_searched_for_half_a_meter_beyond_the_largest_bound_on_it(keys, meters):
    assert criterion(keys).clearance_range == meters


def test_temporal_criterion_needs_the_evidence_of_its_signals():
    assert criterion({"always": SLOW}).evidence == {Evidence.TRUTH, Evidence.VELOCITY}
    both = criterion({"until": {"hold": SLOW, "release": IN_COLLISION}})
    assert both.evidence == {Evidence.TRUTH, Evidence.VELOCITY, Evidence.CONTACTS}
    assert criterion({"always": CART}).evidence == {Evidence.TRUTH, Evidence.ALIGNMENT, Evidence.OBJECTS}
    assert criterion({"always": {"all": [SLOW, CART]}}).evidence > {Evidence.OBJECTS, Evidence.VELOCITY}
    point = {"signal": "distance_to", "point": [0, 0], "op": ">", "value": 1.0}
    assert criterion({"always": point}).evidence == {Evidence.TRUTH, Evidence.ALIGNMENT}


DRIVE = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": 2.25}
LONG_CLEARANCE_RANGE = {"clearance_range": 9.0}


@pytest.mark.parametrize(
    ("condition", "margin", "unit"),
    [
        (FAR, 0.25, "m"),
        ({"all": [FAR, {**FAR, "value": 2.125}]}, 0.125, "m"),
        ({"all": [FAR, SLOW]}, None, "m"),
        ({"all": [FAR, {"not": IN_COLLISION}]}, 0.25, "m"),
        ({"all": [{**FAR, "scale": 0.5}, {**SLOW, "scale": 0.25}]}, 0.5, ""),
        ({"all": [{**FAR, "scale": 0.5}, SLOW]}, None, "m/s"),
        ({"all": [{**FAR, "scale": 0.5}, {**FAR, "value": 1.0}]}, None, "m"),
        ({"all": [{**FAR, "scale": 0.5}, {"not": IN_COLLISION}]}, 0.5, ""),
        ({"not": IN_COLLISION}, None, ""),
        ({"any": [FAR, {"not": IN_COLLISION}]}, None, ""),
        ({**FAR, "value": 2.25, "op": ">="}, 0.0, "m"),
    ],
)
def test_a_margin_is_in_the_unit_that_all_its_signals_share(condition, margin, unit):
    finding = finding_of({"always": condition}, DRIVE, LONG_CLEARANCE_RANGE)
    assert finding.status is Status.PASS
    assert (finding.margin, finding.unit) == (margin if margin is None else pytest.approx(margin), unit)


def test_margin_of_a_strict_bound_violated_by_equality_is_negative():
    finding = finding_of({"always": {**FAR, "value": 2.25}}, DRIVE, LONG_CLEARANCE_RANGE)
    assert finding.status is Status.FAIL
    assert -1e-300 < finding.margin < 0


def test_a_signal_that_is_infinite_has_no_margin():
    finding = finding_of(
        {"always": CART}, {**STILL, "events": [[0.5, "object.removed", "cart"]], "objects": {"cart": [[0, 9, 0]]}}
    )
    assert finding.margin == pytest.approx(8.0)
    gone = {**STILL, "events": [[0, "object.removed", "cart"]], "objects": {"cart": [[0, 9, 0]]}}
    finding = finding_of({"always": CART}, gone)
    assert (finding.status, finding.measured, finding.margin, finding.value) == (
        Status.PASS,
        "infinite",
        None,
        math.inf,
    )


def test_finding_has_time_position_and_signal_of_the_decision():
    finding = finding_of({"eventually": {"signal": "goal_distance", "op": "<", "value": 1.0}}, DRIVE, GOAL)
    assert (finding.what, finding.status, finding.value, finding.tick) == ("goal_distance", Status.PASS, 0.5, 960)
    assert finding.place == pytest.approx((2.0, 0.0))
    assert finding.detail == ("condition: eventually goal_distance < 1 m",)


GOAL = {"goals": [{"name": "a", "pose": [2.5, 0, 0]}]}


def test_boolean_signal_has_no_value():
    finding = finding_of({"always": {"not": IN_COLLISION}}, STILL)
    assert (finding.measured, finding.limit, finding.value) == ("no", "no", None)


def test_open_window_at_the_end_of_the_run_is_undecided():
    finding = finding_of({"always": {**FAR, "within": 9.0}}, DRIVE)
    assert finding.status is Status.INCONCLUSIVE
    assert finding.measured.startswith("the run ended at t = 4.00 s (navigation ended) before `always within 9 s")
    assert finding.limit == "always within 9 s clearance > 2 m"


def test_condition_with_a_missing_signal_is_undecided():
    finding = finding_of({"always": {"signal": "nees", "op": "<", "value": 9}}, {**STILL, "belief": None})
    assert (finding.status, finding.measured) == (Status.INCONCLUSIVE, "no covariance was recorded")


def test_notes_have_times():
    answer = {"whenever": {**FAR, "op": "<"}, "then": IN_COLLISION}
    trace = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": [[0, 9], [2, 9], [2.025, 1], [4, 1]]}
    finding = finding_of(answer, trace)
    assert finding.status is Status.FAIL
    assert finding.detail[1:] == ("the response was due at t = 2.02 s",)


WHENEVER = {"whenever": IN_COLLISION, "then": FAR}


@pytest.mark.parametrize(
    ("keys", "has_hint"),
    [(WHENEVER, True), ({"always": {"all": [FAR, WHENEVER]}}, False), ({"eventually": WHENEVER}, False)],
)
def test_only_a_top_level_whenever_can_be_optional(keys, has_hint):
    finding = finding_of(keys, {**DRIVE, "events": [[4, "run.ended", "time limit"]]}, LONG_CLEARANCE_RANGE)
    assert finding.status is Status.INCONCLUSIVE
    assert ("`required: false` lets such a run pass" in finding.detail) == has_hint
