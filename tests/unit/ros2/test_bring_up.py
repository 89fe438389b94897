"""Tests of the bring-up before a run, with a fake rclpy and a fake graph."""

import importlib
import sys
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from simscen.ros2.options import AdapterError, Options


class FakeGraph(MagicMock):
    """A graph without messages, whose nodes never change."""

    offset_ns = 0

    def nodes(self) -> list[str]:
        return ["/amcl"]

    def spin_until(self, done: Callable[[], bool], seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not done():
            if time.monotonic() >= end:
                return False
            time.sleep(0.01)
        return True


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    before = set(sys.modules)
    if importlib.util.find_spec("rclpy") is None:
        for name in ("rclpy", "rclpy.action", "rclpy.clock", "rclpy.executors", "rclpy.qos", "rclpy.serialization"):
            monkeypatch.setitem(sys.modules, name, MagicMock())
    yield importlib.import_module("simscen.ros2.bring_up")
    for name in sorted(set(sys.modules) - before):  # these modules refer to the fake rclpy
        if name.startswith("simscen.ros2."):
            del sys.modules[name]


@pytest.mark.parametrize("settle", [0.0, 0.1])
@pytest.mark.parametrize("problems", [[], ["/amcl is not active"]])
def test_run_starts_only_if_all_nodes_are_ready(module: Any, settle: float, problems: list[str]) -> None:
    readiness: Any = SimpleNamespace(problems=lambda: problems, likely_causes=list)
    bring_up = module.BringUp(FakeGraph(), readiness, Options(settle=settle, ready=0.6), 0.05, [], None)
    if not problems:
        bring_up.wait(0, 10.0)
        return
    with pytest.raises(AdapterError, match="/amcl is not active"):
        bring_up.wait(0, 10.0)
