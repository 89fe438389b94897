"""Tests of the events for recoveries of Nav2."""

from types import SimpleNamespace
from typing import Any

import pytest

from simscen.ros2.nav2.actions import RecoveryReporter

S = 1_000_000_000


class FakeGraph:
    """A graph with the status topics of all behaviors."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Any] = {}

    def subscribe_to_status(self, action: str, keep: Any) -> str:
        self.callbacks[action] = keep
        return "/behavior_server"

    def report(self, behavior: str, *goals: tuple[int, int]) -> None:
        """Publish the status of goals, given as pairs of id and GoalStatus number."""
        messages = [
            SimpleNamespace(goal_info=SimpleNamespace(goal_id=SimpleNamespace(uuid=[number] * 16)), status=status)
            for number, status in goals
        ]
        self.callbacks[behavior](SimpleNamespace(status_list=messages))


@pytest.fixture
def graph() -> FakeGraph:
    return FakeGraph()


@pytest.fixture
def events(graph: FakeGraph) -> list[tuple[str, ...]]:
    return []


@pytest.fixture
def reporter(graph: FakeGraph, events: list[tuple[str, ...]]) -> RecoveryReporter:
    reporter = RecoveryReporter(graph, lambda kind, name, **data: events.append((kind, name, *data.values())))  # type: ignore[arg-type]
    reporter.subscribe()
    return reporter


def test_a_behavior_starts_and_ends_once_although_its_status_is_repeated(graph, events, reporter) -> None:
    graph.report("spin", (1, 1))
    assert events == []
    graph.report("spin", (1, 2))
    graph.report("spin", (1, 2))
    graph.report("spin", (1, 6))
    graph.report("spin", (1, 6), (2, 2))
    assert events == [
        ("recovery.started", "spin"),
        ("recovery.ended", "spin", "failed"),
        ("recovery.started", "spin"),
    ]


def test_behavior_with_only_an_observed_end_has_both_events(graph, events, reporter) -> None:
    graph.report("wait", (1, 4))
    assert events == [("recovery.started", "wait"), ("recovery.ended", "wait", "succeeded")]


def test_counted_recoveries_without_a_behavior_are_costmap_clearing(graph, events, reporter) -> None:
    reporter.begin_goal()
    reporter.update_count(1)
    reporter.report_clearing(0)
    assert events == []  # the status of a behavior may still arrive
    reporter.report_clearing(1 * S)
    clearing = [("recovery.started", "clear_costmap"), ("recovery.ended", "clear_costmap", "succeeded")]
    assert events == clearing
    reporter.update_count(1)
    reporter.report_clearing(3 * S)
    assert events == clearing


def test_a_counted_behavior_is_not_reported_twice(graph, events, reporter) -> None:
    reporter.begin_goal()
    reporter.update_count(1)  # the feedback comes before the status
    reporter.report_clearing(0)
    graph.report("backup", (1, 2))
    reporter.report_clearing(2 * S)
    assert events == [("recovery.started", "backup")]


def test_recovery_count_restarts_with_each_goal(graph, events, reporter) -> None:
    for now in (0, 10 * S):
        reporter.begin_goal()
        reporter.update_count(2)
        reporter.report_clearing(now)
        reporter.report_clearing(now + S)
    assert [event[0] for event in events].count("recovery.started") == 4


def test_behavior_that_the_last_goal_did_not_count_does_not_hide_a_clearing(graph, events, reporter) -> None:
    reporter.begin_goal()
    graph.report("spin", (1, 2))
    graph.report("spin", (1, 5))
    reporter.begin_goal()  # before the feedback that counts the spin
    reporter.update_count(1)
    for now in (10 * S, 11 * S):
        reporter.report_clearing(now)
    assert events[2:] == [("recovery.started", "clear_costmap"), ("recovery.ended", "clear_costmap", "succeeded")]


def test_clearing_shortly_before_the_next_goal_is_reported(graph, events, reporter) -> None:
    reporter.begin_goal()
    reporter.update_count(1)
    reporter.report_clearing(0)
    reporter.begin_goal()
    reporter.report_clearing(1 * S)
    assert events == [("recovery.started", "clear_costmap"), ("recovery.ended", "clear_costmap", "succeeded")]
