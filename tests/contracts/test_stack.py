"""A whole stack keeps the promises of simscen.stack.protocols.Stack, with every controller."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "stack"))
from simscen.core.geometry import Pose2
from simscen.core.motion import STOP
from simscen.core.navigation import Goal
from simscen.model.stack import DynamicWindow, GroundTruth, Mppi, RegulatedPurePursuit, StackSpec
from simscen.testing.flatland import Drive, Flatland, drive

SPECS = {
    controller.type: StackSpec(localizer=GroundTruth(type="ground_truth"), controller=controller)
    for controller in (
        RegulatedPurePursuit(),
        DynamicWindow(type="dwb"),
        Mppi(type="mppi", batch_size=300),
    )
}
every = pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)


def start(spec: StackSpec, *goals: Goal) -> Drive:
    world = Flatland().room(6, 4)
    world.boxes.append((2.9, 0.0, 3.0, 2.4))
    grid = world.grid((-0.5, -0.5, 6.5, 4.5))
    world.discs.append((4.6, 2.0, 0.2))
    return drive(world, Pose2(1, 1), *goals, grid=grid, spec=spec)


@every
def test_it_reaches_a_goal_around_an_unmapped_obstacle_without_contact(spec: StackSpec) -> None:
    d = start(spec, Goal("g", Pose2(5, 1, 0.5))).run(60)
    assert d.result == "SUCCEEDED"
    assert d.pose.distance(Pose2(5, 1)) <= 0.25
    assert d.least > 0


@every
def test_without_a_goal_it_commands_zero(spec: StackSpec) -> None:
    d = start(spec).run(0.5)
    assert set(d.commands) == {STOP}
    assert d.stack.goal is None
    assert d.stack.plan is None


@every
def test_once_a_task_has_ended_it_commands_zero(spec: StackSpec) -> None:
    d = start(spec, Goal("g", Pose2(1.6, 1.0))).run(20)
    ended = len(d.commands) - 1
    d.run(0.5, until="")
    assert set(d.commands[ended:]) == {STOP}


@every
def test_the_same_seed_gives_the_same_drive_bit_for_bit(spec: StackSpec) -> None:
    one, other = (start(spec, Goal("g", Pose2(5, 1, 0.5))).run(4) for _ in range(2))
    assert one.commands == other.commands
    assert one.log == other.log


@every
def test_every_goal_is_accepted_once_and_ends_once(spec: StackSpec) -> None:
    d = start(spec, Goal("a", Pose2(1.6, 1.0)), Goal("b", Pose2(40.0, 0.0))).run(30)
    assert [e.name for e in d.kinds("goal.accepted")] == ["a", "b"]
    assert [e.name for e in d.kinds("goal.reached")] == ["a"]
    assert [e.name for e in d.kinds("goal.failed")] == ["b"]
    assert [e.name for e in d.kinds("navigation.ended")] == ["FAILED"]
