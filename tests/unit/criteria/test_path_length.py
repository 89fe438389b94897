"""Tests of `path_length` with lengths that floats represent exactly."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CASE = {"goals": [{"name": "a", "pose": [4, 0]}], "shortest": {"a": 4.0}}
REACHED = [[0, "goal.accepted", "a"], [4, "goal.reached", "a"]]


def path_length_finding(keys, events=REACHED, case=CASE, step=0.5, steps=8):
    """Return the finding for a straight drive with one sample per 0.5 s; `step` is the distance of samples, in m."""
    ticks = np.arange(steps + 1, dtype=np.int64) * 120
    poses = np.column_stack((step * np.arange(steps + 1), np.zeros((steps + 1, 2))))
    trace = replace(
        synthetic_trace({"seconds": 4, "truth": [[0, 0, 0]], "events": events}), truth=Samples(ticks, poses)
    )
    (verdict,) = judge([AnyCriterion.model_validate({"path_length": keys})], trace, synthetic_case(case))
    (finding,) = verdict.findings
    return finding


@pytest.mark.parametrize(("limit", "margin", "tick"), [(4.0, 0.0, 960), (3.5, -0.5, 960), (2.0, -2.0, 600)])
def test_violated_length_has_the_position_where_the_bound_was_exceeded(limit, margin, tick):
    finding = path_length_finding({"max": limit})
    assert (finding.margin, finding.tick) == (margin, tick)
    assert finding.place == (tick / 240, 0.0)


def test_satisfied_length_has_the_position_at_the_end():
    assert path_length_finding({"max": 5.0}).tick == 960


@pytest.mark.parametrize("max_ratio", [1.0, 1.5])
def test_a_perfect_drive_has_the_ratio_one(max_ratio):
    finding = path_length_finding({"max_ratio": max_ratio})
    assert finding.status is Status.PASS
    assert finding.value == pytest.approx(4.0)  # m, as the shortest path
    assert finding.margin == pytest.approx(4.0 * (max_ratio - 1.0))


@pytest.mark.parametrize(("shortest", "status"), [(4.0, Status.INCONCLUSIVE), (3.5, Status.FAIL)])
def test_without_arrival_only_an_exceeded_length_is_decided(shortest, status):
    case = {**CASE, "shortest": {"a": shortest}}
    assert path_length_finding({"max_ratio": 1.0}, events=REACHED[:1], case=case).status is status


def test_near_goal_has_a_path_length_ratio():
    case = {**CASE, "shortest": {"a": 0.5}}
    assert path_length_finding({"max_ratio": 1.0}, case=case, step=0.25, steps=2).margin == 0.0


def test_reasons_without_a_comparison_are_in_order():
    case_with_repeated_names = {
        "goals": [{"name": n, "pose": [4, 0]} for n in "gfedcbagfedcba"],
        "shortest": dict.fromkeys("abcdefg", 1.0),
    }
    assert path_length_finding({"max_ratio": 1.0}, case=case_with_repeated_names).measured.startswith(
        "several goals are called a, b, c, d, e, f, g,"
    )
    case_with_sent_goals = {**CASE, "sent": [{"name": n, "pose": [4, 0]} for n in "hgfedcb"]}
    events = [[k, "goal.accepted", name] for k, name in enumerate("hgfedcb")]
    measured = path_length_finding({"max_ratio": 1.0}, case=case_with_sent_goals, events=events).measured
    assert measured.startswith("b, c, d, e, f, g, h was sent by an event")
    assert (
        path_length_finding({"max_ratio": 1.0}, case={**CASE, "shortest": {"a": 0.0}}).measured
        == "the shortest path has no length"
    )
    assert (
        path_length_finding({"max_ratio": 1.0}, case={**CASE, "shortest": {}}).measured
        == "no shortest path to a is known"
    )
