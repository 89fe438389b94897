"""Tests that clearance, collision events, and contacts of the engine are consistent."""

import random

import pytest
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, Extrusion, MotionPath, Solid
from simscen.core.records.events import EventKind

SAMPLE_TICKS = 6
SQUARE = ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6))
L_SHAPE = ((0.0, 0.0), (4.0, 0.0), (4.0, 1.2), (1.2, 1.2), (1.2, 4.0), (0.0, 4.0))


def has_contact(simulation) -> bool:
    """Return whether the engine reports a contact of the robot, except with the ground."""
    return bool(simulation.robot.contacts())


def step_and_sample(simulation, ticks, every=SAMPLE_TICKS):
    """Sample the truth as a run does; return the events, and (tick, clearance, has_contact) of each sample."""
    events, samples = [], []
    for _ in range(ticks // every):
        simulation.step(every)
        truth = simulation.truth()
        events += simulation.robot.collisions()
        samples.append((simulation.tick, truth.clearance, has_contact(simulation)))
    return events, samples


def kinds(events):
    return [event.kind for event in events]


@pytest.mark.parametrize("every", [6, 24])
def test_collision_ends_after_the_robot_has_driven_away(simulate, every):
    simulation = simulate(solids=[box("wall", 1.05, 0, 0.1, 4)], drive=(0.5, 0.0, 0.0))
    step_and_sample(simulation, 720, every)
    simulation.drive(Twist(-0.5, 0.0, 0.0))
    events, samples = step_and_sample(simulation, 480, every)
    assert kinds(events) == [EventKind.COLLISION_ENDED]
    left = next(tick for tick, clearance, _ in samples if clearance > 0.005)
    assert events[0].tick <= left + 24 + every
    assert not simulation.robot.touching()


@pytest.mark.parametrize("height", [0.02, 0.028])
def test_sill_that_stops_the_robot_is_a_collision_without_clearance(simulate, height):
    simulation = simulate(solids=[box("sill", 0.6, 0, 0.05, 4, height)], drive=(0.3, 0.0, 0.0))
    events, samples = step_and_sample(simulation, 720)
    assert kinds(events)[0] == EventKind.COLLISION_STARTED
    assert events[0].name == "sill"
    assert min(clearance for _, clearance, _ in samples) <= 0.0


def random_world(rng, pushable):
    places = [(rng.uniform(-3, 3), rng.uniform(-3, 3)) for _ in range(40)]
    solids = [
        box(f"box{k}", x, y, 0.2, 0.3, rng.choice([0.01, 0.015, 0.05, 1.0]), rng.uniform(0, 3))
        for k, (x, y) in enumerate(places)
        if abs(x) + abs(y) > 0.8
    ]
    path = MotionPath((0.0, 4.0), (Pose2(-3, 0.3), Pose2(3, -0.3)), "back_and_forth")
    bodies = [Body("cart", (box("cart", 0, 0, 0.6, 0.6, 0.5),), Pose3(-3, 0.3), path=path)]
    if pushable:
        bodies.append(Body("plank", (box("plank", 0, 0, 0.1, 0.1, 1.5),), Pose3(0.6, 0.1), 0.5))
    return solids, bodies


@pytest.mark.sample(2)
@pytest.mark.parametrize("pushable", [False, True])
@pytest.mark.parametrize(
    ("seed", "robot"), [(1, "turtlebot"), (2, "turtlebot"), (3, "amr"), (4, "jackal"), (5, "omni")]
)
def test_events_and_clearance_equal_those_of_a_query_at_every_tick(simulate, monkeypatch, seed, robot, pushable):
    def run():
        rng = random.Random(seed)
        simulation = simulate(robot, *random_world(rng, pushable))
        events, samples = [], []
        for k in range(24):
            simulation.drive(Twist(rng.uniform(-0.5, 0.5), 0.0, rng.uniform(-2, 2)))
            if k % 8 == 5:
                simulation.push_robot((rng.uniform(-4, 4), rng.uniform(-4, 4)))
            if k == 17:  # away from the cart: how Bullet separates overlapping bodies depends on their earlier poses
                simulation.place_robot(Pose2(0.0, 0.0, rng.uniform(-3, 3)))
            more = step_and_sample(simulation, 96)
            events, samples = events + more[0], samples + more[1]
        return events, samples

    skipping = run()
    monkeypatch.setattr("simscen.sim.contact.clearance.SPEED_HORIZON_S", -1.0)
    polling = run()
    assert EventKind.COLLISION_STARTED in kinds(polling[0])
    assert skipping[0] == polling[0]
    # The pose of a resting object is not read again when a body only comes near, so it may creep by this much.
    assert skipping[1] == [
        (tick, pytest.approx(clearance, abs=1e-6), contact) for tick, clearance, contact in polling[1]
    ]
    assert [sample for sample in polling[1] if sample[2] and sample[1] > 0] == []


@pytest.mark.parametrize(
    "solid",
    [box("crate", 5, 5, 1.2, 1.2), Solid(Extrusion(L_SHAPE, 1.0), Pose3(4.4, 4.4), "crate")],
    ids=["convex", "concave"],
)
def test_robot_placed_inside_a_solid_collides_until_it_is_moved_out(simulate, solid):
    simulation = simulate(solids=[solid])
    step_and_sample(simulation, 24)
    simulation.place_robot(Pose2(5.0, 5.0, 0.0))
    events, samples = step_and_sample(simulation, 240)
    assert [(event.kind, event.name) for event in events] == [(EventKind.COLLISION_STARTED, "crate")]
    assert events[0].tick == 25
    assert max(clearance for _, clearance, _ in samples) < 0
    simulation.place_robot(Pose2(0.0, 0.0, 0.0))
    events, samples = step_and_sample(simulation, 240)
    assert kinds(events) == [EventKind.COLLISION_ENDED]
    assert min(clearance for _, clearance, _ in samples) > 0


@pytest.mark.parametrize("polygon", [SQUARE, L_SHAPE], ids=["convex", "concave"])
def test_solid_spawned_around_the_robot_is_a_collision(simulate, polygon):
    simulation = simulate(pose=Pose2(0.6, 0.6) if polygon is L_SHAPE else Pose2(0.0, 0.0))
    step_and_sample(simulation, 24)
    simulation.spawn(Body("block", (Solid(Extrusion(polygon, 1.0)),)))
    events, samples = step_and_sample(simulation, 120)
    assert [(event.kind, event.name) for event in events] == [(EventKind.COLLISION_STARTED, "block")]
    assert max(clearance for _, clearance, _ in samples) < 0
    simulation.remove("block")
    assert kinds(step_and_sample(simulation, 120)[0]) == [EventKind.COLLISION_ENDED]


def test_robot_that_starts_between_the_walls_of_a_house_does_not_collide(simulate):
    walls = ((-3, -3), (3, -3), (3, 3), (0.1, 3), (0.1, 2.9), (2.9, 2.9), (2.9, -2.9), (-2.9, -2.9), (-2.9, 2.9),
             (-0.1, 2.9), (-0.1, 3), (-3, 3))  # fmt: skip
    simulation = simulate(solids=[Solid(Extrusion(walls, 2.0), Pose3(), "house")])
    events, samples = step_and_sample(simulation, 48)
    assert events == []
    assert min(clearance for _, clearance, _ in samples) > 1.9


@pytest.mark.parametrize("gap", [0.05, 0.15, 0.3])
def test_push_into_a_wall_is_detected_as_a_collision(simulate, monkeypatch, gap):
    def run():
        simulation = simulate(solids=[box("wall", 0.22 + gap + 0.05, 0, 0.1, 4)])
        step_and_sample(simulation, 24)
        simulation.push_robot((8.0, 0.0))
        return step_and_sample(simulation, 48, 24)

    skipping = run()
    monkeypatch.setattr("simscen.sim.contact.clearance.SPEED_HORIZON_S", -1.0)
    assert skipping == run()
    assert kinds(skipping[0])[0] == EventKind.COLLISION_STARTED
