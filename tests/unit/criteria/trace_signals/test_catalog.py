"""Tests of the catalog of signals."""

import math

import pytest

from simscen.criteria.trace_signals.catalog import SIGNALS

EITHER_WAY = ("forward_speed", "yaw_rate", "acceleration", "angular_acceleration")
ANGLES = ("goal_heading_error", "localization_yaw_error")
QUESTIONS = (
    "localized", "in_region", "in_collision", "goal_active", "recovery_active", "fault_active", "event_active",
    "started",
)  # fmt: skip


@pytest.mark.parametrize("name", SIGNALS)
def test_range_of_each_signal_is_reachable(name):
    expected = (0.0, math.inf)
    if name in EITHER_WAY:
        expected = (-math.inf, math.inf)
    if name in ANGLES:
        expected = (0.0, math.pi)
    if name in QUESTIONS:
        expected = (0.0, 1.0)
    if name == "clearance":
        expected = (-1.0, math.inf)
    assert (SIGNALS[name].minimum, SIGNALS[name].maximum) == expected


@pytest.mark.parametrize("name", SIGNALS)
def test_only_boolean_signals_have_no_unit(name):
    assert SIGNALS[name].is_boolean == (name in QUESTIONS)
    assert (SIGNALS[name].unit == "") == (name in (*QUESTIONS, "nees") or name.endswith("_count"))


def test_units_are_those_of_si():
    names = ("clearance", "speed", "turn_rate", "acceleration", "angular_acceleration", "jerk", "time", "yaw_std")
    expected = ["m", "m/s", "rad/s", "m/s^2", "rad/s^2", "m/s^3", "s", "rad"]
    assert [SIGNALS[name].unit for name in names] == expected
