"""Tests of the values that forms offer for new keys."""

import pytest

from simscen.editor import forms


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({}, 0),
        ({"exclusiveMinimum": 0}, 1),
        ({"exclusiveMinimum": 0, "maximum": 0.5}, 0.25),
        ({"minimum": 2, "maximum": 9}, 2),
        ({"minimum": -10, "maximum": -2}, -10),
        ({"exclusiveMaximum": 0}, -1),
    ],
)
def test_initial_number_is_within_the_limits(limits: dict[str, float], expected: float) -> None:
    assert forms._first_number({"type": "number", **limits}) == expected
