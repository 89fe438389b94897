"""Tests of the events about a robot that waits for a component of its stack."""

import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.events import Event
from simscen.model.stack import StackSpec
from simscen.model.stack_base import Latency
from simscen.stack.publishing import StandstillReporter
from simscen.testing.flatland import Flatland, drive


def kinds(events: tuple[Event, ...]) -> list[tuple[str, str]]:
    return [(str(event.kind), event.name) for event in events]


def test_hold_is_reported_once_after_a_second_and_then_its_release() -> None:
    standstill = StandstillReporter(240)
    assert [kinds(standstill.report_hold(tick, "planner", lambda: "why")) for tick in (12, 251, 252, 264)] == [
        [], [], [("robot.held", "planner")], [],
    ]  # fmt: skip
    assert kinds(standstill.report_release(300)) == [("robot.released", "planner")]
    assert standstill.report_release(301) == ()
    standstill.report_hold(400, "planner", lambda: "why")
    assert standstill.report_release(500) == ()


def test_hold_by_another_component_releases_the_previous_hold() -> None:
    standstill = StandstillReporter(240)
    standstill.report_hold(0, "planner", lambda: "why")
    standstill.report_hold(240, "planner", lambda: "why")
    assert kinds(standstill.report_hold(300, "controller", lambda: "why")) == [("robot.released", "planner")]
    assert kinds(standstill.report_hold(540, "controller", lambda: "why")) == [("robot.held", "controller")]


@pytest.mark.parametrize("component", ["planner", "controller"])
def test_waiting_for_planner_or_controller_is_reported(component: str) -> None:
    world = Flatland().room(8, 6)
    spec = StackSpec(latency=Latency(**{component: 2.0}))
    d = drive(world, Pose2(1, 3), Goal("g", Pose2(6, 3)), spec=spec, grid=world.grid((-0.5, -0.5, 8.5, 6.5))).run(6.0)
    held, released = d.events_of_kind("robot.held")[0], d.events_of_kind("robot.released")[0]
    assert held.name == released.name == component
    assert f"the {component} takes 2 s" in held.data["message"]
    assert 1.0 <= held.tick / 240 < 1.2
    assert 2.0 <= released.tick / 240 < 2.3
