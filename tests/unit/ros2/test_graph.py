"""Test of simscen's node in the ROS graph, with a fake rclpy."""

import importlib
import sys
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest


class FakeExecutor:
    """Executor whose events are the functions in `ready`."""

    def __init__(self) -> None:
        self.ready: list[Callable[[], None]] = []

    def add_node(self, node: Any) -> None: ...

    def wait_for_ready_callbacks(self) -> Callable[[], None]:
        if not self.ready:
            raise TimeoutError
        return self.ready.pop(0)

    def spin_once(self, timeout_sec: float) -> None:
        try:
            handle = self.wait_for_ready_callbacks()
        except TimeoutError:
            return
        handle()


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    for name in ("rclpy", "rclpy.qos"):
        monkeypatch.setitem(sys.modules, name, MagicMock())
    executors: Any = ModuleType("rclpy.executors")
    executors.SingleThreadedExecutor = FakeExecutor
    monkeypatch.setitem(sys.modules, "rclpy.executors", executors)
    monkeypatch.delitem(sys.modules, "simscen.ros2.graph", raising=False)
    yield importlib.import_module("simscen.ros2.graph").Graph(SimpleNamespace(namespace=""), lambda: None)
    del sys.modules["simscen.ros2.graph"]  # refers to the fake rclpy


def test_all_messages_are_received_although_other_events_come_first(graph: Any) -> None:
    """Answers of services, statuses of actions, and log lines are events, too, but add nothing to the inbox."""
    graph.executor.ready = [lambda: None, lambda: graph.inbox.append("command"), lambda: None]
    graph.receive_all()
    assert graph.inbox == ["command"]
