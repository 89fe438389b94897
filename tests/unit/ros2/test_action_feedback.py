"""Tests of the feedback of Nav2's navigation actions, with a fake rclpy."""

import importlib.util
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from simscen.peer.goals import Goal

GOALS = [Goal(name, x, 0.0, 0.0, 0.25, 0.25, via=x < 3) for x, name in enumerate("abc", start=1)]


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """`simscen.ros2.goal_sender`; with a fake rclpy if rclpy is not installed."""
    if importlib.util.find_spec("rclpy") is None:
        for name in ("rclpy", "rclpy.action", "rclpy.executors", "rclpy.qos"):
            monkeypatch.setitem(sys.modules, name, MagicMock())
    before = set(sys.modules)
    found = importlib.import_module("simscen.ros2.goal_sender")
    monkeypatch.setattr(found, "find_type", lambda _: MagicMock())
    monkeypatch.setattr(found, "ActionClient", MagicMock())
    yield found
    for name in sorted(set(sys.modules) - before):  # these modules refer to the fake rclpy
        if name.startswith("simscen.ros2."):
            del sys.modules[name]


def feedback(remaining: int, recoveries: int) -> Any:
    return SimpleNamespace(
        feedback=SimpleNamespace(number_of_poses_remaining=remaining, number_of_recoveries=recoveries)
    )


def test_late_feedback_on_earlier_goals_is_ignored(module: Any) -> None:
    """Otherwise, simscen would record goals and recoveries of the earlier goals for the current goals."""
    sender = module.ActionSender(MagicMock(offset_ns=0), "navigate_through_poses")
    handle = sender._client.send_goal_async.return_value.result.return_value
    handle.get_result_async.return_value.done.return_value = False
    state = module.StackState(0, False, None)
    callbacks = []
    for goals in (GOALS[:2], list(GOALS)):
        assert sender.send(goals, 0, MagicMock()) is None
        callbacks.append(sender._client.send_goal_async.call_args.kwargs["feedback_callback"])
    callbacks[0](feedback(remaining=1, recoveries=2))
    assert (sender.outcomes(state), sender.recoveries) == ([], 0)
    callbacks[1](feedback(remaining=2, recoveries=1))
    assert (sender.outcomes(state), sender.recoveries) == ([module.GoalReached()], 1)
