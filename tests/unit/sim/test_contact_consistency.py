"""Clearance, collisions, and the contacts of the engine agree about the same bodies."""

import random

import pytest
from playground import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, Extrusion, MotionPath, Solid
from simscen.core.records.events import EventKind
from simscen.sim.contact.collisions import contact_points

EVERY = 6
HOUSE = ((-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6))
BEND = ((0.0, 0.0), (4.0, 0.0), (4.0, 1.2), (1.2, 1.2), (1.2, 4.0), (0.0, 4.0))


def pressed(simulation) -> bool:
    """Whether the engine reports a contact of the robot with anything but the ground right now."""
    robot = simulation.robot
    return bool(
        contact_points(
            simulation._scene.client, robot.base.id, robot._names, lambda _: "", 1.0, robot._is_ground_contact
        )
    )


def watch(simulation, ticks, every=EVERY):
    """Run on, sampling the truth as a run does; the events, and (tick, clearance, pressed) of each sample."""
    events, samples = [], []
    for _ in range(ticks // every):
        simulation.step(every)
        truth = simulation.truth()
        events += simulation.robot.collisions()
        samples.append((simulation.tick, truth.clearance, pressed(simulation)))
    return events, samples


def kinds(events):
    return [event.kind for event in events]


@pytest.mark.parametrize("every", [6, 24])
def test_a_collision_ends_when_the_robot_has_left_however_far_it_then_is(simulate, every):
    simulation = simulate(solids=[box("wall", 1.05, 0, 0.1, 4)], drive=(0.5, 0.0, 0.0))
    watch(simulation, 720, every)
    simulation.drive(Twist(-0.5, 0.0, 0.0))
    events, samples = watch(simulation, 480, every)
    assert kinds(events) == [EventKind.COLLISION_ENDED]
    left = next(tick for tick, clearance, _ in samples if clearance > 0.005)
    assert events[0].tick <= left + 24 + every
    assert not simulation.robot.touching()


@pytest.mark.parametrize("height", [0.02, 0.028])
def test_a_sill_that_holds_the_robot_is_a_collision_and_leaves_no_clearance(simulate, height):
    simulation = simulate(solids=[box("sill", 0.6, 0, 0.05, 4, height)], drive=(0.3, 0.0, 0.0))
    events, samples = watch(simulation, 720)
    assert kinds(events)[0] == EventKind.COLLISION_STARTED
    assert events[0].name == "sill"
    assert min(clearance for _, clearance, _ in samples) <= 0.0


def wild_world(rng, pushable):
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
def test_ruling_contacts_out_gives_the_events_and_the_clearance_of_asking_at_every_tick(
    simulate, monkeypatch, seed, robot, pushable
):
    def run():
        rng = random.Random(seed)
        simulation = simulate(robot, *wild_world(rng, pushable))
        events, samples = [], []
        for k in range(24):
            simulation.drive(Twist(rng.uniform(-0.5, 0.5), 0.0, rng.uniform(-2, 2)))
            if k % 8 == 5:
                simulation.robot.push((rng.uniform(-4, 4), rng.uniform(-4, 4)))
            if k == 17:  # not into the cart: how Bullet parts what overlaps depends on where it saw both before
                simulation.place_robot(Pose2(0.0, 0.0, rng.uniform(-3, 3)))
            more = watch(simulation, 96)
            events, samples = events + more[0], samples + more[1]
        return events, samples

    ruled_out = run()
    monkeypatch.setattr("simscen.sim.contact.clearance.SPEED_HORIZON_S", -1.0)
    polled = run()
    assert EventKind.COLLISION_STARTED in kinds(polled[0])
    assert ruled_out[0] == polled[0]
    # Something long at rest is not asked where it is when somebody only comes near, which lets it creep so much.
    assert ruled_out[1] == [
        (tick, pytest.approx(clearance, abs=1e-6), pressed) for tick, clearance, pressed in polled[1]
    ]
    assert [sample for sample in polled[1] if sample[2] and sample[1] > 0] == []


@pytest.mark.parametrize(
    "solid",
    [box("crate", 5, 5, 1.2, 1.2), Solid(Extrusion(BEND, 1.0), Pose3(4.4, 4.4), "crate")],
    ids=["convex", "concave"],
)
def test_a_robot_set_down_wholly_inside_something_solid_collides_with_it_until_it_is_out(simulate, solid):
    simulation = simulate(solids=[solid])
    watch(simulation, 24)
    simulation.place_robot(Pose2(5.0, 5.0, 0.0))
    events, samples = watch(simulation, 240)
    assert [(event.kind, event.name) for event in events] == [(EventKind.COLLISION_STARTED, "crate")]
    assert events[0].tick == 25
    assert max(clearance for _, clearance, _ in samples) < 0
    simulation.place_robot(Pose2(0.0, 0.0, 0.0))
    events, samples = watch(simulation, 240)
    assert kinds(events) == [EventKind.COLLISION_ENDED]
    assert min(clearance for _, clearance, _ in samples) > 0


@pytest.mark.parametrize("polygon", [HOUSE, BEND], ids=["convex", "concave"])
def test_something_solid_that_appears_around_the_robot_is_a_collision(simulate, polygon):
    simulation = simulate(pose=Pose2(0.6, 0.6) if polygon is BEND else Pose2(0.0, 0.0))
    watch(simulation, 24)
    simulation.spawn(Body("block", (Solid(Extrusion(polygon, 1.0)),)))
    events, samples = watch(simulation, 120)
    assert [(event.kind, event.name) for event in events] == [(EventKind.COLLISION_STARTED, "block")]
    assert max(clearance for _, clearance, _ in samples) < 0
    simulation.remove("block")
    assert kinds(watch(simulation, 120)[0]) == [EventKind.COLLISION_ENDED]


def test_a_house_in_which_a_run_begins_is_no_obstacle(simulate):
    walls = ((-3, -3), (3, -3), (3, 3), (0.1, 3), (0.1, 2.9), (2.9, 2.9), (2.9, -2.9), (-2.9, -2.9), (-2.9, 2.9),
             (-0.1, 2.9), (-0.1, 3), (-3, 3))  # fmt: skip
    simulation = simulate(solids=[Solid(Extrusion(walls, 2.0), Pose3(), "house")])
    events, samples = watch(simulation, 48)
    assert events == []
    assert min(clearance for _, clearance, _ in samples) > 1.9


@pytest.mark.parametrize("gap", [0.05, 0.15, 0.3])
def test_a_push_does_not_carry_the_robot_into_something_unseen(simulate, monkeypatch, gap):
    def run():
        simulation = simulate(solids=[box("wall", 0.22 + gap + 0.05, 0, 0.1, 4)])
        watch(simulation, 24)
        simulation.robot.push((8.0, 0.0))
        return watch(simulation, 48, 24)

    ruled_out = run()
    monkeypatch.setattr("simscen.sim.contact.clearance.SPEED_HORIZON_S", -1.0)
    assert ruled_out == run()
    assert kinds(ruled_out[0])[0] == EventKind.COLLISION_STARTED
