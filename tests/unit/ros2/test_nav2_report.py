"""Tests of the report on Nav2: parameter values, log lines, errors, and aborted bring-up."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from simscen.ros2.nav2.report import LogLine, Nav2Report
from simscen.ros2.node_parameters import plain_value


def parameter(number: int, **fields: object) -> SimpleNamespace:
    """Return a rcl_interfaces/msg/ParameterValue with a type by its number."""
    return SimpleNamespace(type=number, **fields)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (parameter(0), None),
        (parameter(1, bool_value=True), True),
        (parameter(2, integer_value=7), 7),
        (parameter(3, double_value=0.4), 0.4),
        (parameter(3, double_value=math.inf), "inf"),
        (parameter(4, string_value="scan"), "scan"),
        (parameter(5, byte_array_value=[b"\x01", b"\xff"]), [1, 255]),
        (parameter(6, bool_array_value=[True, False]), [True, False]),
        (parameter(7, integer_array_value=(1, 2)), [1, 2]),
        (parameter(8, double_array_value=(0.5, 1.5)), [0.5, 1.5]),
        (parameter(9, string_array_value=["a", "b"]), ["a", "b"]),
    ],
)
def test_parameter_is_converted_to_json(value: SimpleNamespace, expected: object) -> None:
    assert plain_value(value) == expected


def test_log_lines_are_returned_once_and_sorted_by_logger() -> None:
    missing: Any = None
    report = Nav2Report(missing, missing)
    report._add_log_line(SimpleNamespace(level=40, name="planner_server", msg="no path"))
    report._add_log_line(SimpleNamespace(level=20, name="amcl", msg="created"))
    change = SimpleNamespace(node_name="FollowPath", previous_status="IDLE", current_status="RUNNING")
    report._add_tree_changes(SimpleNamespace(event_log=[change]))
    assert report.take_lines() == [
        LogLine(20, "behavior_tree", "FollowPath: IDLE -> RUNNING"),
        LogLine(40, "planner_server", "no path"),
    ]
    assert report.take_lines() == []


def test_the_last_different_errors_are_listed() -> None:
    missing: Any = None
    report = Nav2Report(missing, missing)
    for number in (1, 2, 2, 3, 4):
        report._add_log_line(SimpleNamespace(level=40, name="planner_server", msg=f"error {number}"))
    report._add_log_line(SimpleNamespace(level=30, name="amcl", msg="a warning"))
    assert report.errors() == ["planner_server: error 2", "planner_server: error 3", "planner_server: error 4"]
    report.take_lines()
    assert report.errors() == []


def test_lifecycle_manager_that_gives_up_is_named() -> None:
    missing: Any = None
    report = Nav2Report(missing, missing)
    report._add_log_line(SimpleNamespace(level=40, name="robot1.manager", msg="Failed to change state for node: amcl"))
    assert not report.aborted_bring_up
    text = "Failed to bring up all requested nodes. Aborting bringup."
    report._add_log_line(SimpleNamespace(level=40, name="robot1.manager", msg=text))
    assert report.aborted_bring_up == "robot1.manager"
