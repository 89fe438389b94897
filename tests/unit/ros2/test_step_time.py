"""Tests of the limit on the wall time of a step, with a fake clock that advances only while waiting."""

import re
from collections.abc import Callable

import pytest

from simscen.ros2 import step_time
from simscen.ros2.options import AdapterError
from simscen.ros2.step_time import StepTime


class FakeTime:
    """A clock in seconds."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def time(monkeypatch: pytest.MonkeyPatch) -> FakeTime:
    clock = FakeTime()
    monkeypatch.setattr(step_time, "time", clock)
    return clock


@pytest.fixture
def step(time: FakeTime) -> StepTime:
    """Return a StepTime for which each event takes 0.1 s."""

    def spin_until(done: Callable[[], bool], seconds: float) -> bool:
        end = time.now + seconds
        while not done():
            if time.now >= end:
                return False
            time.now += 0.1
        return True

    return StepTime(spin_until)


def pending_nodes(time: FakeTime, **ends: float) -> Callable[[], list[str]]:
    """Return a function that returns the nodes that have not answered yet; each answers after the given time in s."""
    start = time.now
    return lambda: ["/" + node for node, seconds in ends.items() if time.now - start < seconds]


def test_a_step_that_several_nodes_delay_ends_with_an_error_that_names_the_slowest(time: FakeTime, step) -> None:
    step.begin(8.0)
    assert step.wait_for(pending_nodes(time, controller_server=4.45, amcl=0.95), 5.0)
    with pytest.raises(AdapterError) as error:
        step.wait_for(pending_nodes(time, planner_server=9.0), 5.0)
    message = str(error.value)
    assert "more than 8 s of wall time" in message
    assert re.search(r"/controller_server \(4.5 s\), /planner_server \(3.[56] s\), /amcl \(1.0 s\)", message)


def test_each_step_has_its_own_time(time: FakeTime, step) -> None:
    for _ in range(3):
        step.begin(8.0)
        assert step.wait_for(pending_nodes(time, controller_server=4.5), 5.0)


def test_wait_with_its_own_limit_ends_before_the_step(time: FakeTime, step) -> None:
    step.begin(8.0)
    assert not step.wait_for(pending_nodes(time, planner_server=30.0), 2.0)
    assert 5.5 < step.remaining < 6.1
