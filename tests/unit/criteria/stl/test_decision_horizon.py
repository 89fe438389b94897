"""Tests of the decision horizon of conditions."""

import pytest

from simscen.criteria.registry import AnyCriterion
from simscen.criteria.stl.condition import Condition, decision_horizon

NOW = {"signal": "localized"}


def always(**more):
    return {"always": {**NOW, **more}}


def eventually(**more):
    return {"eventually": {**NOW, **more}}


@pytest.mark.parametrize(
    ("condition", "holds", "does_not"),
    [
        (NOW, 0, 0),
        ({"not": NOW}, 0, 0),
        (always(), 0, 0),
        (always(within=5.0), 5, 0),
        (always(after=3.0), 3, 3),
        (always(between=[2.0, 5.0]), 5, 2),
        (eventually(), 0, 0),
        (eventually(within=5.0), 0, 5),
        (eventually(between=[2.0, 5.0]), 2, 5),
        ({"not": always(within=5.0)}, 0, 5),
        ({"all": [always(within=5.0), always(within=7.0)]}, 7, 0),
        ({"all": [eventually(within=5.0), eventually(within=7.0)]}, 0, 5),
        ({"any": [always(within=5.0), always(within=7.0)]}, 5, 0),
        ({"any": [eventually(within=5.0), eventually(within=7.0)]}, 0, 7),
        ({"always": {**always(within=5.0), "within": 10.0}}, 15, 0),
        ({"eventually": {**always(within=5.0), "between": [1.0, 10.0]}}, 6, 10),
        ({"until": {"hold": NOW, "release": always(within=4.0), "between": [2.0, 9.0]}}, 6, 0),
        ({"whenever": NOW, "then": always(within=9.0)}, 0, 0),
    ],
)
def test_time_until_a_condition_is_decided(condition, holds, does_not):
    parsed = Condition.model_validate(condition)
    assert (decision_horizon(parsed), decision_horizon(parsed, False)) == (holds, does_not)


@pytest.mark.parametrize(
    ("criterion", "horizon"),
    [
        (always(within=5.0), 5),
        (eventually(between=[2.0, 5.0]), 2),
        ({"until": {"hold": NOW, "release": NOW, "after": 4.0}}, 4),
        ({"whenever": {**NOW, "within": 6.0}, "then": always(within=3.0)}, 9),
        ({"whenever": {**NOW, "within": 6.0, "required": False}, "then": always(within=3.0)}, 6),
        ({"whenever": {**eventually(within=5.0), "within": 6.0, "required": False}, "then": always(within=9.0)}, 11),
        ({"localization_error": {"max": 1.0, "after": 8.0}}, 8),
        ({"localization_consistency": {"after": 7.0}}, 7),
        ({"collisions": {"max": 0}}, 0),
    ],
)
def test_criterion_states_when_it_can_be_decided(criterion, horizon):
    assert AnyCriterion.model_validate(criterion).chosen.horizon == horizon
