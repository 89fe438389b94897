"""Contract tests of the reference stack with every controller."""

import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.model.controllers import DynamicWindow, RegulatedPurePursuit
from simscen.model.localizers import GroundTruth
from simscen.model.mppi import Mppi
from simscen.model.stack import StackSpec
from simscen.testing import Promise, promises_of
from simscen.testing.flatland import Drive, Flatland, drive

SPECS = {
    controller.type: StackSpec(localizer=GroundTruth(type="ground_truth"), controller=controller)
    for controller in (
        RegulatedPurePursuit(),
        DynamicWindow(type="dwb"),
        Mppi(type="mppi", batch_size=300),
    )
}
every_spec = pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)


def start_drive(spec: StackSpec, *goals: Goal) -> Drive:
    """Return a drive in a room with a mapped box and an unmapped disc."""
    world = Flatland().room(6, 4)
    world.boxes.append((2.9, 0.0, 3.0, 2.4))
    grid = world.grid((-0.5, -0.5, 6.5, 4.5))
    world.discs.append((4.6, 2.0, 0.2))
    return drive(world, Pose2(1, 1), *goals, grid=grid, spec=spec)


@pytest.mark.sample(1)
@every_spec
def test_stack_reaches_a_goal_around_an_unmapped_obstacle(spec: StackSpec) -> None:
    finished_drive = start_drive(spec, Goal("g", Pose2(5, 1, 0.5))).run(60)
    assert finished_drive.result == "SUCCEEDED"
    assert finished_drive.pose.distance(Pose2(5, 1)) <= 0.25
    assert finished_drive.min_clearance > 0


@pytest.mark.parametrize("promise", [p for name, spec in SPECS.items() for p in promises_of(spec, name)], ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()
