"""Tests of the text of findings."""

import math

import pytest

from simscen.criteria.findings import at_least, at_most, counted, format_quantity, missed
from simscen.testing.synthetic_trace import synthetic_trace


@pytest.mark.parametrize(
    ("value", "limit", "value_text", "limit_text"),
    [
        (0.5, 0.25, "0.50 m", "≤ 0.25 m"),
        (0.5, 0.5, "0.50 m", "≤ 0.50 m"),
        (0.501, 0.5, "0.501 m", "≤ 0.500 m"),
        (0.5 + 1e-7, 0.5, "0.5000001 m", "≤ 0.5000000 m"),
        (0.5 + 1e-8, 0.5, "0.50000001 m", "≤ 0.50000000 m"),
        (0.5 + 1e-9, 0.5, "0.500000001 m", "≤ 0.500000000 m"),
        (0.5 + 1e-12, 0.5, "0.500000000 m", "≤ 0.500000000 m"),
        (0.0, 0.001, "0.000 m", "≤ 0.001 m"),
        (0.001, 0.0, "0.001 m", "≤ 0.000 m"),
        (math.inf, 0.5, "inf m", "≤ 0.50 m"),
        (0.5, math.inf, "0.50 m", "≤ inf m"),
    ],
)
def test_numbers_have_enough_digits_to_differ(value, limit, value_text, limit_text):
    finding = at_most("x", value, limit, "m")
    assert (finding.measured, finding.limit) == (value_text, limit_text)


@pytest.mark.parametrize(("value", "detail"), [(0.4, ()), (0.5, ()), (0.6, ("why",))])
def test_the_reason_is_reported_only_for_a_violation(value, detail):
    assert at_most("x", value, 0.5, "m", detail=["why"]).detail == detail
    assert at_least("x", -value, -0.5, "m", detail=["why"]).detail == detail


def test_scope_is_written_after_the_limit():
    assert at_most("x", 1.0, 2.0, "s", context="after lidar.off").limit == "≤ 2.00 s after lidar.off"
    assert at_least("x", 1.0, 2.0, "").limit == "≥ 2.00"


def test_counts_are_written_with_a_noun():
    (minimum,) = counted("x", 1, "recovery", 2, None)
    (maximum,) = counted("x", 2, "recovery", None, 3)
    assert (minimum.measured, minimum.limit, minimum.margin, minimum.value) == ("1 recovery", "≥ 2", -1.0, 1.0)
    assert (maximum.measured, maximum.limit, maximum.margin, maximum.value) == ("2 recoveries", "≤ 3", 1.0, 2.0)
    assert counted("x", 0, "replan", 0, None)[0].measured == "0 replans"
    assert counted("x", 2, "delay", 0, None)[0].measured == "2 delays"


def test_a_finding_has_the_position_of_the_robot_at_its_time():
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 4, 2]]})
    finding = missed("x", "a", "b", (trace, 480), ["why"])
    assert (finding.tick, finding.place, finding.detail) == (480, (2.0, 1.0), ("why",))


def test_a_quantity_has_its_unit():
    assert (format_quantity(1.234, "s", 2), format_quantity(1.234, "", 1)) == ("1.23 s", "1.2")
