"""Tests of the report of an external stack on replay pages: behavior tree, log lines, and parameters."""

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "browser"))
from nav2_report import ERROR, INFO, PARAMETERS, WARNING, with_nav2_report

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.peer.messages import BEHAVIOR_TREE_LOGGER, log, tree_change
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log
from simscen.record.messages.event_text import EVENT_LOGGER
from simscen.record.sensor_messages import SensorMessages
from simscen.report.replay import stack_report
from simscen.report.replay.packed_columns import PackedColumns
from simscen.report.replay.stack_report import behavior_tree_data, log_lines_data, parameters_data
from simscen.testing.synthetic_trace import synthetic_trace

RATE = 240


def log_with(*lines: tuple[int, int, str, str], stack: dict[str, str] | None = None) -> Log:
    """Return a log with lines of /rosout: tick, severity, logger, and text."""
    time = Clock(RATE)
    messages = [(tick, log(time.stamp(tick), *line)) for tick, *line in lines]
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]]})
    sensors = SensorMessages(time, log_lines=messages)
    return Log(LogHeader("hall/drive", 7, Case(Pose2(0, 0), ())), trace, "", True, sensors=sensors, stack=stack or {})


def tree_change_line(tick: int, node: str, old: str, new: str) -> tuple[int, int, str, str]:
    """Return the log line of a node of a behavior tree that changed its status."""
    return tick, INFO, BEHAVIOR_TREE_LOGGER, tree_change(node, old, new)


class ColumnsSpy(PackedColumns):
    """Columns that are not packed: `add` returns the values."""

    def add(self, values: Any, step: float = 1.0) -> Any:
        return list(values)


def log_with_parameters(nodes: object) -> Log:
    """Return the log of a stack that reported parameters by node."""
    return log_with(stack={"about": json.dumps({"parameters": nodes})})


def test_changes_of_a_behavior_tree_keep_their_order_within_a_tick() -> None:
    lines = [
        tree_change_line(0, "Root", "IDLE", "RUNNING"),
        tree_change_line(0, "name: a -> b", "IDLE", "RUNNING"),
        (12, WARNING, "amcl", "no transform"),
        tree_change_line(24, "Root", "RUNNING", "FAILURE"),
    ]
    tree = behavior_tree_data(log_with(*lines), ColumnsSpy())
    assert tree is not None
    names = [[tree["nodes"][k] for k in tree["node"]]]
    names += [[tree["statuses"][k] for k in tree[key]] for key in ("before", "status")]
    assert list(zip(tree["ticks"], *names, strict=True)) == [
        (0, "Root", "idle", "running"),
        (0, "name: a -> b", "idle", "running"),
        (24, "Root", "running", "failure"),
    ]


def test_stack_report_contains_log_lines_but_no_simscen_events() -> None:
    lines = [
        (0, INFO, EVENT_LOGGER, "goal.accepted shelf"),
        (5, WARNING, "planner_server", "no\npath"),
        (6, ERROR, "controller_server", "x" * 1000),
        (7, INFO, BEHAVIOR_TREE_LOGGER, "not a change"),
    ]
    entries = log_lines_data(log_with(*lines), ColumnsSpy())
    assert [line[:3] for line in entries] == [
        [5, "warning", "planner_server"],
        [6, "error", "controller_server"],
        [7, "info", BEHAVIOR_TREE_LOGGER],
    ]
    assert entries[0][3] == "no path"
    assert entries[1][3] == f"{'x' * stack_report.MAX_LINE_CHARACTERS} … (1000 characters)"


def test_parameters_are_shown_as_in_a_file_with_the_main_ones_marked() -> None:
    controller = {"FollowPath.vx_max": 1.0, "empty": "", "list": ["x"], "no": False}
    nodes = parameters_data(
        log_with_parameters({"/amcl": {"z_hit": 0.5}, "/controller_server": controller}), ColumnsSpy()
    )
    assert [(node["node"], node["total"]) for node in nodes] == [("/controller_server", 4), ("/amcl", 1)]
    assert nodes[0]["values"] == [
        ["FollowPath.vx_max", "1.0", True],
        ["empty", '""', False],
        ["list", '["x"]', False],
        ["no", "false", False],
    ]


@pytest.mark.parametrize("nodes", [None, [], {"/amcl": 3}, {"/amcl": {}}, "text"])
def test_parameters_in_another_form_are_not_shown(nodes: object) -> None:
    assert parameters_data(log_with_parameters(nodes), ColumnsSpy()) == []


@pytest.mark.parametrize("about", ["{", "[]", "3"])
def test_description_that_is_not_an_object_has_no_parameters(about: str) -> None:
    assert parameters_data(log_with(stack={"about": about}), ColumnsSpy()) == []


def test_log_without_an_external_stack_has_no_stack_report() -> None:
    log_ = log_with((0, INFO, EVENT_LOGGER, "goal.accepted shelf"))
    assert behavior_tree_data(log_, ColumnsSpy()) is None
    assert log_lines_data(log_, ColumnsSpy()) == parameters_data(log_, ColumnsSpy()) == []


def test_last_changes_and_main_parameters_of_a_large_report_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stack_report, "MAX_TREE_CHANGES", 2)
    monkeypatch.setattr(stack_report, "MAX_LINES", 1)
    monkeypatch.setattr(stack_report, "MAX_PARAMETERS", 1)
    lines: Sequence[tuple[int, int, str, str]] = [
        *(tree_change_line(tick, "Root", "IDLE", "RUNNING") for tick in range(3)),
        *(tree_change_line(tick, "GoalUpdated", "IDLE", "FAILURE") for tick in range(2, 4)),
        (3, ERROR, "amcl", "first"),
        (4, ERROR, "amcl", "last"),
    ]
    nodes = {"/amcl": {"a": 1, "max_particles": 2000}}
    log_ = replace(log_with(*lines), stack=log_with_parameters(nodes).stack)
    columns = ColumnsSpy()
    tree, parameters = behavior_tree_data(log_, columns), parameters_data(log_, columns)
    assert tree is not None and tree["ticks"] == [1, 2]
    assert [text for *_, text in log_lines_data(log_, columns)] == ["last"]
    assert parameters == [{"node": "/amcl", "values": [["max_particles", "2000", True]], "total": 2}]
    assert columns.reductions == [
        "changes of the behavior tree, without conditions: 2 of 5",
        "parameters of the stack: 1 of 2",
        "log lines of the stack, the last ones: 1 of 2",
    ]


def test_example_stack_reports_all_parts() -> None:
    log_ = with_nav2_report(log_with())
    tree = behavior_tree_data(log_, ColumnsSpy())
    assert tree is not None and "FollowPath" in tree["nodes"]
    assert log_lines_data(log_, ColumnsSpy()) == [[720, "error", "controller_server", "Failed to make progress"]]
    assert [node["node"] for node in parameters_data(log_, ColumnsSpy())] == [*list(PARAMETERS)[1:], "/amcl"]
