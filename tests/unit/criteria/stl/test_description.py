"""Tests of descriptions of conditions and witnesses."""

import math

import pytest

from simscen.criteria.stl.condition import Condition
from simscen.criteria.stl.description import describe, describe_limit, describe_value
from simscen.criteria.stl.robustness import Witness

NEAR = {"signal": "clearance", "op": "<", "value": 0.5}
FAST = {"signal": "speed", "op": ">=", "value": 1}
LOST = {"not": {"signal": "localized"}}


@pytest.mark.parametrize(
    ("condition", "text"),
    [
        (NEAR, "clearance < 0.5 m"),
        ({"signal": "nees", "op": ">", "value": 3}, "nees > 3"),
        ({"signal": "distance_to", "object": "cart", "op": "<=", "value": 2}, "distance_to cart ≤ 2 m"),
        ({"signal": "in_region", "region": "wet floor"}, "in_region wet floor"),
        ({"signal": "in_region", "region": "dock", "op": ">=", "value": 1}, "in_region dock"),
        ({"all": [NEAR, FAST, LOST]}, "clearance < 0.5 m and speed ≥ 1 m/s and (not localized)"),
        ({"any": [NEAR, {"all": [FAST]}]}, "clearance < 0.5 m or (speed ≥ 1 m/s)"),
        ({"always": NEAR}, "always clearance < 0.5 m"),
        ({"always": {**LOST, "within": 2.5}}, "always within 2.5 s (not localized)"),
        ({"eventually": {**NEAR, "after": 3.0}}, "eventually after 3 s clearance < 0.5 m"),
        ({"eventually": {**NEAR, "between": [1.0, 4.0]}}, "eventually between 1 s and 4 s clearance < 0.5 m"),
        ({"until": {"hold": NEAR, "release": LOST}}, "clearance < 0.5 m until (not localized)"),
        (
            {"until": {"hold": LOST, "release": NEAR, "within": 9.0}},
            "(not localized) until within 9 s clearance < 0.5 m",
        ),
        ({"whenever": NEAR, "then": LOST}, "whenever clearance < 0.5 m, then not localized"),
    ],
)
def test_condition_description_is_readable(condition, text):
    assert describe(Condition.model_validate(condition)) == text


@pytest.mark.parametrize(
    ("condition", "value", "negated", "text"),
    [
        (NEAR, 0.25, False, ("0.25 m", "< 0.50 m")),
        (NEAR, 0.25, True, ("0.25 m", "≥ 0.50 m")),
        (NEAR, 0.4999, False, ("0.4999 m", "< 0.5000 m")),
        (FAST, 1.5, False, ("1.50 m/s", "≥ 1.00 m/s")),
        (FAST, 1.5, True, ("1.50 m/s", "< 1.00 m/s")),
        ({**FAST, "op": "<="}, 1.5, True, ("1.50 m/s", "> 1.00 m/s")),
        ({**FAST, "op": ">"}, 1.5, True, ("1.50 m/s", "≤ 1.00 m/s")),
        ({**NEAR, "op": ">"}, math.inf, False, ("infinite", "> 0.50 m")),
        ({"signal": "localized"}, 1.0, False, ("yes", "yes")),
        ({"signal": "localized"}, 0.0, False, ("no", "yes")),
        ({"signal": "localized"}, 1.0, True, ("yes", "no")),
        ({"signal": "localized", "op": ">=", "value": 1}, 1.0, False, ("yes", "yes")),
    ],
)
def test_witness_has_value_and_bound(condition, value, negated, text):
    witness = Witness(Condition.model_validate(condition), 0, value, negated)
    assert (describe_value(witness), describe_limit(witness)) == text
