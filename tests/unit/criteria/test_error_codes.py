"""Tests of error codes in criteria and events."""

import pytest
from pydantic import TypeAdapter, ValidationError

from simscen.core.messages.navigation import ErrorCode
from simscen.core.records.events import Event
from simscen.criteria.error_codes import ErrorCodeValue, error_code_name

ADAPTER = TypeAdapter(ErrorCodeValue)


@pytest.mark.parametrize("value", ["GOAL_OCCUPIED", 206, ErrorCode.GOAL_OCCUPIED])
def test_error_code_can_be_a_name_or_number(value):
    assert ADAPTER.validate_python(value) is ErrorCode.GOAL_OCCUPIED


@pytest.mark.parametrize("value", ["GOAL_OCUPIED", 999, True, 206.0, None, "206"])
def test_unknown_error_code_is_refused_with_the_valid_names(value):
    with pytest.raises(ValidationError, match="GOAL_OCCUPIED"):
        ADAPTER.validate_python(value)


def test_schema_of_error_codes_lists_names_and_numbers():
    values = ADAPTER.json_schema()["enum"]
    assert "GOAL_OCCUPIED" in values
    assert 206 in values


@pytest.mark.parametrize(
    ("data", "name"),
    [
        ({}, "NONE"),
        ({"error_code": 206}, "GOAL_OCCUPIED"),
        ({"error_code": 4711}, "4711"),
        ({"error_code": 206, "error_name": ""}, "GOAL_OCCUPIED"),
        ({"error_code": 206, "error_name": 3}, "GOAL_OCCUPIED"),
        ({"error_code": None}, "NONE"),
        ({"error_code": "odd"}, "odd"),
        ({"error_code": 206, "error_name": "GOAL_OCCUPIED"}, "GOAL_OCCUPIED"),
    ],
)
def test_event_shows_the_name_of_its_error_code(data, name):
    assert error_code_name(Event(1, "goal.failed", "a", data)) == name
