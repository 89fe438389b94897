"""Tests of ground-truth samples that are evaluated later."""

import pytest
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.geometry.shapes import Body, Box, MotionPath, Solid
from simscen.core.records.trace import Truth

CROSSING = MotionPath((0.0, 6.0), (Pose2(4.0, 4.0), Pose2(2.0, -1.0)))
CRATE = Body("crate", (Solid(Box((0.3, 0.3, 0.3))),), Pose3(2.2, 1.2, 0.15))


@pytest.mark.parametrize("mass", [0.0, 5.0])
def test_samples_evaluated_later_equal_immediate_truth(simulate, mass: float) -> None:
    solids = [box("near", 1.5, 0.8, 0.4, 0.3), box("far", 3.5, -0.9, 0.4, 0.3), box("ahead", 6.0, 0.0, 0.4, 4.0)]
    cart = Body("cart", (box("cart", 0, 0, 0.4, 0.4),), Pose3(4.0, 4.0), path=CROSSING)
    eager, lazy = (simulate(solids=solids, bodies=[cart], drive=(0.5, 0.0, 0.05)) for _ in range(2))
    immediate, samples = [], []
    for beat in range(480):
        for simulation in (eager, lazy):
            if beat == 100:
                simulation.spawn(Body("crate", CRATE.solids, CRATE.pose, mass))
            elif beat == 203:
                simulation.place("crate", Pose2(2.2, 2.0))
            elif beat == 305:
                simulation.remove("crate")
            simulation.step(6)
        immediate.append(eager.truth())
        samples.append(lazy.robot.sample(6))
    collisions = eager.robot.collisions()
    assert [event.tick for event in lazy.robot.collisions()] == [event.tick for event in collisions] != []
    deferred = sum(not isinstance(sample, Truth) for sample in samples)
    assert 0 < deferred < len(samples)
    evaluated = [sample if isinstance(sample, Truth) else sample.truth() for sample in samples]
    assert evaluated == immediate
    assert sum(type(truth.objects) is PosesAtTick for truth in evaluated) > 100  # poses are nearly always precomputed


def test_samples_among_sleeping_and_pushed_objects_equal_immediate_truth(simulate) -> None:
    crate = (Solid(Box((0.3, 0.3, 0.3))),)
    crates = [Body(f"crate {k}", crate, Pose3(x, y, 0.15), 0.5) for k, (x, y) in enumerate([(3, 0), (2, 2), (0, 4)])]
    cart = Body("cart", (box("cart", 0, 0, 0.4, 0.4),), Pose3(-1.0, 4.0), path=MotionPath(
        (0.0, 8.0, 12.0), (Pose2(-1.0, 4.0), Pose2(-1.0, 4.0), Pose2(1.0, 4.0))))  # fmt: skip
    eager, lazy = (simulate(bodies=[*crates, cart], drive=(0.5, 0.0, 0.0)) for _ in range(2))
    immediate, samples = [], []
    for _ in range(560):
        for simulation in (eager, lazy):
            simulation.step(6)
        immediate.append(eager.truth())
        samples.append(lazy.robot.sample(6))
    assert [sample if isinstance(sample, Truth) else sample.truth() for sample in samples] == immediate
    assert [event.name for event in eager.robot.collisions()] == [event.name for event in lazy.robot.collisions()]
    first, last = (truth.objects for truth in (immediate[0], immediate[-1]))
    assert last["crate 0"].x > first["crate 0"].x + 0.5  # pushed by the robot
    assert last["crate 2"].x > first["crate 2"].x + 0.5  # pushed by the cart
    assert last["crate 1"] == first["crate 1"]
