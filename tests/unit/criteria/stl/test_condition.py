"""Tests of valid and invalid temporal conditions."""

import math

import pytest
from pydantic import ValidationError

from simscen.criteria.stl.condition import Condition, Window

NEAR = {"signal": "clearance", "op": "<", "value": 0.5}
LOST = {"not": {"signal": "localized"}}
FAST = {"signal": "speed", "op": ">", "value": 1.0}


def validation_errors(keys):
    with pytest.raises(ValidationError) as error:
        Condition.model_validate(keys)
    return "; ".join(problem["msg"].removeprefix("Value error, ") for problem in error.value.errors())


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({}, "expected one of: signal, all, any, not, always, eventually, until, whenever"),
        ({**NEAR, "not": LOST}, "only one of signal, not may be given here"),
        ({"all": [LOST], "any": [LOST]}, "only one of all, any may be given here"),
        ({"whenever": NEAR}, "`whenever` and `then` must be given together"),
        ({**NEAR, "then": LOST}, "`whenever` and `then` must be given together"),
        ({"not": LOST, "op": "<"}, "`op` belongs to a signal, not to `not`"),
        ({"any": [LOST], "value": 0.0}, "`value` belongs to a signal, not to `any`"),
        ({"not": LOST, "scale": 1.0}, "`scale` belongs to a signal, not to `not`"),
        ({"not": LOST, "with": "box"}, "`with` belongs to a signal, not to `not`"),
        ({"all": []}, "List should have at least 1 item after validation, not 0"),
        ({"any": []}, "List should have at least 1 item after validation, not 0"),
        ({"all": [LOST] * 51}, "List should have at most 50 items after validation, not 51"),
        ({"any": [LOST] * 51}, "List should have at most 50 items after validation, not 51"),
        ({**NEAR, "region": "dock"}, "`clearance` takes no `region`"),
        ({"signal": "in_region", "goal": "a"}, "`in_region` takes no `goal`"),
        ({"signal": "in_region"}, "`in_region` needs exactly one of: region"),
        ({"signal": "distance_to", "op": "<", "value": 1}, "`distance_to` needs exactly one of: object, point, goal"),
        (
            {"signal": "distance_to", "goal": "a", "object": "cart", "op": "<", "value": 1},
            "`distance_to` needs exactly one of: object, point, goal",
        ),
        ({"signal": "localized", "op": ">=", "value": 2}, "`localized` is yes or no: write it alone, or below `not`"),
        ({"signal": "localized", "op": ">", "value": 1}, "`localized` is yes or no: write it alone, or below `not`"),
        ({"signal": "localized", "op": ">="}, "`localized` is yes or no: write it alone, or below `not`"),
        ({"signal": "localized", "value": 1}, "`localized` is yes or no: write it alone, or below `not`"),
        ({"signal": "localized", "scale": 1}, "`localized` is yes or no: write it alone, or below `not`"),
        ({"signal": "speed", "op": ">"}, "`speed` needs `op` and `value`"),
        ({"signal": "speed", "value": 1}, "`speed` needs `op` and `value`"),
        ({"op": "<", "value": ""}, "Input should be a valid number"),
        ({**FAST, "scale": 0}, "`scale` must be greater than 0"),
        ({**FAST, "scale": -0.5}, "`scale` must be greater than 0"),
        ({**FAST, "op": "=="}, "`==` is unsuitable for measured values; use `<=` and `>=` around the value"),
        ({**FAST, "op": "="}, "`=` is unsuitable for measured values; use `<=` and `>=` around the value"),
        ({**FAST, "op": "!="}, "`!=` is unsuitable for measured values; use `<=` and `>=` around the value"),
        (
            {**FAST, "value": "1 rad/s"},
            "`rad/s` is a unit of angular speed, but this is a speed; units: ",
        ),
    ],
)
def test_invalid_condition_is_refused(keys, message):
    assert validation_errors(keys).startswith(message)


@pytest.mark.parametrize(
    ("signal", "op", "value", "message"),
    [
        ("speed", ">=", 0, "never below 0 m/s, so `>= 0 m/s` is always true"),
        ("speed", ">", -1, "never below 0 m/s, so `> -1 m/s` is always true"),
        ("speed", "<", 0, "never below 0 m/s, so `< 0 m/s` is never true"),
        ("speed", "<=", -1, "never below 0 m/s, so `<= -1 m/s` is never true"),
        ("goal_heading_error", "<=", math.pi, "never above 3.14159 rad, so `<= 3.14159 rad` is always true"),
        ("goal_heading_error", "<", 4, "never above 3.14159 rad, so `< 4 rad` is always true"),
        ("goal_heading_error", ">", math.pi, "never above 3.14159 rad, so `> 3.14159 rad` is never true"),
        ("goal_heading_error", ">=", 4, "never above 3.14159 rad, so `>= 4 rad` is never true"),
        ("collision_count", ">=", 0, "never below 0, so `>= 0` is always true"),
    ],
)
def test_trivial_condition_is_refused(signal, op, value, message):
    assert validation_errors({"signal": signal, "op": op, "value": value}) == f"`{signal}` is {message}"


@pytest.mark.parametrize(
    ("signal", "op", "value"),
    [
        ("speed", ">", 0),
        ("speed", "<=", 0),
        ("goal_heading_error", ">=", math.pi),
        ("goal_heading_error", "<", math.pi),
        ("clearance", "<=", -1),
        ("yaw_rate", ">", -50),
    ],
)
def test_bound_at_the_limit_of_the_range_is_valid(signal, op, value):
    assert Condition.model_validate({"signal": signal, "op": op, "value": value}).value == value


def test_bound_has_the_dimension_of_its_signal():
    text = Condition.model_validate({"signal": "speed", "op": ">", "value": "50 cm/s", "scale": "10 cm/s"})
    assert (text.value, text.scale) == (0.5, 0.1)
    assert Condition.model_validate({"signal": "nees", "op": ">", "value": 3}).value == 3.0


def test_misspelled_signal_is_a_single_problem():
    assert validation_errors({"signal": "sped", "op": ">", "value": "1 m/s"}).count(";") == 0
    assert validation_errors({"signal": "sped", "op": ">", "value": "1 N s"}).count(";") == 0
    assert validation_errors({"signal": "sped", "op": ">", "value": 1}).count(";") == 0
    assert "valid number" in validation_errors({"signal": "sped", "op": ">", "value": "fast"})


def test_comparisons_of_a_condition_are_in_written_order():
    hurt = {"signal": "in_collision"}
    text = Condition.model_validate(
        {"any": [{"all": [NEAR, LOST]}, {"until": {"hold": hurt, "release": NEAR}}, {"whenever": LOST, "then": hurt}]}
    )
    names = [comparison.signal for comparison in text.comparisons()]
    assert names == ["clearance", "localized", "in_collision", "clearance", "localized", "in_collision"]
    assert [comparison.signal for comparison in Condition.model_validate({"always": NEAR}).comparisons()] == [
        "clearance"
    ]
    assert [comparison.signal for comparison in Condition.model_validate({"eventually": NEAR}).comparisons()] == [
        "clearance"
    ]


def test_signal_arguments_use_the_keys_of_the_language():
    assert Condition.model_validate({"signal": "in_collision", "with": "box"}).arguments == {"with": "box"}
    assert Condition.model_validate({"signal": "in_region", "region": "dock"}).arguments == {"region": "dock"}
    assert Condition.model_validate({"signal": "in_collision"}).arguments == {}


@pytest.mark.parametrize(
    ("keys", "stretch"),
    [
        ({}, (0.0, None)),
        ({"within": 2}, (0.0, 2.0)),
        ({"after": 2}, (2.0, None)),
        ({"between": [0, 2]}, (0.0, 2.0)),
        ({"between": [1, 2]}, (1.0, 2.0)),
    ],
)
def test_window_must_be_a_future_interval(keys, stretch):
    assert Window.model_validate(keys).interval == stretch


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"within": 2, "after": 1}, "only one of within, after may be given here"),
        ({"after": 1, "between": [2, 3]}, "only one of after, between may be given here"),
        ({"between": [2, 2]}, "the window from 2 s to 2 s is empty"),
        ({"between": [3, 2]}, "the window from 3 s to 2 s is empty"),
        ({"between": [3]}, "at least 2 items"),
        ({"between": [1, 2, 3]}, "at most 2 items"),
        ({"within": 0}, "greater than 0"),
    ],
)
def test_window_must_be_one_nonempty_interval(keys, message):
    with pytest.raises(ValidationError, match=message):
        Window.model_validate(keys)
