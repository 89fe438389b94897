"""Tests of collision events."""

import math
import random

import pytest
from simulation_helpers import box

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.motion_paths import MAX_STEP_M
from simscen.core.geometry.shapes import Body, Cylinder, MotionPath, Solid
from simscen.sim.contact.collisions import MIN_CAUSING_SPEED_M_S
from simscen.worlds.world_file import ramp_solid

RADIUS = 0.22
WALL = box("wall", 1.05, 0, 0.1, 4)
CART = (box("cart", 0, 0, 0.6, 0.6, 0.5),)


def collisions(simulation, ticks, every=6):
    """Step the simulation; return the collision events, which are read every `every` ticks."""
    events = []
    for _ in range(ticks // every):
        simulation.step(every)
        events += simulation.robot.collisions()
    return events


def collision_starts(events):
    return [event for event in events if event.kind == "collision.started"]


def test_driving_into_a_wall_is_one_collision_with_place_speed_and_cause(simulate):
    simulation = simulate(solids=[WALL, box("far", -3, 0, 1, 1)], drive=(0.5, 0.0, 0.0))
    events = collisions(simulation, 960)
    assert [event.kind for event in events] == ["collision.started"]
    (hit,) = events
    assert hit.name == "wall"
    assert hit.data["x"] == pytest.approx(1.0, abs=2e-3)
    assert hit.data["y"] == pytest.approx(0.0, abs=5e-3)
    assert hit.data["speed"] == pytest.approx(0.5, abs=0.01)
    assert hit.data["impulse"] > 0.5
    assert hit.data["robot_caused"] is True
    assert simulation.robot.touching()


def test_collision_ends_a_tenth_of_a_second_after_the_last_contact(simulate):
    simulation = simulate(solids=[WALL], drive=(0.5, 0.0, 0.0))
    collisions(simulation, 720)
    simulation.drive(Twist(-0.3, 0.0, 0.0))
    events = collisions(simulation, 240)
    assert [event.kind for event in events] == ["collision.ended"]
    assert events[0].data["impulse"] > 0.5
    assert not simulation.robot.touching()


def test_grazing_an_object_that_cannot_move_is_a_collision_caused_by_the_robot(simulate):
    # The robot drives along the object and approaches it by 2 degrees, more slowly than MIN_CAUSING_SPEED_M_S.
    y = RADIUS + 0.07
    wall, ramp = box("wall", 1.0, y, 8.0, 0.1), ramp_solid((-3.0, y), (5.0, y), 0.1, 1.0, "ramp")
    door = Body("door", (box("door", 0, 0, 8.0, 0.1),), Pose3(1.0, y))
    for name, objects in (("wall", {"solids": [wall]}), ("ramp", {"solids": [ramp]}), ("door", {"bodies": [door]})):
        simulation = simulate(**objects, pose=Pose2(0.0, 0.0, math.radians(2)), drive=(0.5, 0.0, 0.0))
        (hit, *_) = collision_starts(collisions(simulation, 960))
        assert (hit.name, hit.data["robot_caused"]) == (name, True)
        assert hit.data["robot_speed"] < MIN_CAUSING_SPEED_M_S


def test_cart_that_hits_a_stationary_robot_causes_the_collision_and_pushes_it(simulate):
    cart = Body("cart", CART, Pose3(-2.0), path=MotionPath((0.0, 4.0), (Pose2(-2, 0), Pose2(2, 0))))
    simulation = simulate(bodies=[cart])
    (hit,) = collision_starts(collisions(simulation, 720))
    assert hit.name == "cart"
    assert hit.data["robot_caused"] is False
    assert hit.data["speed"] == pytest.approx(1.0, abs=0.01)
    truth = simulation.truth()
    assert truth.twist.vx == pytest.approx(1.0, abs=0.01)
    assert truth.clearance == pytest.approx(0.0, abs=2e-3)


def test_robot_that_hits_a_stationary_body_causes_the_collision(simulate):
    (hit,) = collision_starts(collisions(simulate(bodies=[Body("cart", CART, Pose3(1.0))], drive=(0.5, 0.0, 0.0)), 720))
    assert (hit.name, hit.data["robot_caused"]) == ("cart", True)


def test_a_light_box_is_pushed_along_and_a_heavy_one_stops_the_robot(simulate):
    boxes = (box("box", 0, 0, 0.3, 0.3, 0.2),)
    for mass, moves in ((0.3, True), (200.0, False)):
        simulation = simulate(bodies=[Body("box", boxes, Pose3(0.6), mass=mass)], drive=(0.3, 0.0, 0.0))
        simulation.step(960)
        assert (simulation.object_pose("box").x > 0.9) is moves
        assert (simulation.truth().pose.x > 0.5) is moves


def test_collision_names_the_solid_although_all_solids_are_one_mesh(simulate):
    solids = [box("left", 0, 1, 0.4, 0.4), Solid(Cylinder(0.2, 1), Pose3(1, 0, 0.5), "post"), box("right", 0, -1, 1, 1)]
    (hit, *_) = collisions(simulate(solids=solids, drive=(0.4, 0.0, 0.0)), 720)
    assert hit.name == "post"


def test_wheels_on_a_floor_solid_of_the_world_are_no_collision(simulate):
    floor = Solid(box("floor", 0, 0, 10, 10, 0.1).shape, Pose3(z=-0.05), "floor")
    simulation = simulate(solids=[floor], drive=(0.5, 0.0, 0.3))
    assert collisions(simulation, 480) == []
    assert simulation.truth().clearance == 2.0


@pytest.mark.sample(2)
@pytest.mark.parametrize("pushable", [False, True])
@pytest.mark.parametrize("seed", range(2))
def test_collisions_equal_those_of_a_query_after_every_tick(simulate, monkeypatch, seed, pushable):
    """Clearance rules out contacts for a while (conservative advancement); compare with a query at every tick."""
    rng = random.Random(seed)
    places = [(rng.uniform(-3, 3), rng.uniform(-3, 3)) for _ in range(40)]
    solids = [box(f"box{k}", x, y, 0.2, 0.3) for k, (x, y) in enumerate(places) if abs(x) + abs(y) > 0.8]
    path = MotionPath((0.0, 4.0), (Pose2(-3, 0.3), Pose2(3, -0.3)), "back_and_forth")
    bodies = [Body("cart", CART, Pose3(-3, 0.3), path=path)]
    if pushable:
        bodies.append(Body("box", (box("box", 0, 0, 0.2, 0.2, 0.2),), Pose3(0.6), 0.5))
    commands = [Twist(rng.uniform(-0.5, 0.5), 0.0, rng.uniform(-2, 2)) for _ in range(30)]

    def run():
        simulation, events = simulate(solids=solids, bodies=bodies), []
        for k, command in enumerate(commands):
            simulation.drive(command)
            if k == 15:
                simulation.push_robot((3.0, 1.0))
            events += collisions(simulation, 96)
        return events, simulation.truth().pose

    skipping = run()
    monkeypatch.setattr("simscen.sim.contact.clearance.SPEED_HORIZON_S", -1.0)
    polling = run()
    assert collision_starts(polling[0])
    assert skipping == polling


THIN_PLATE = (box("plate", 0, 0, 1.0, 0.01, 0.5),)
FAST_M_S = 0.95 * MAX_STEP_M * 240


@pytest.mark.parametrize("offset_ticks", [0.0, 0.25, 0.5, 0.75])
def test_thin_plate_at_maximum_speed_collides_with_the_robot(simulate, offset_ticks):
    start = offset_ticks / 240
    path = MotionPath((0.0, 4 / FAST_M_S), (Pose2(0, -2, 0), Pose2(0, 2, 0)), start=start)
    simulation = simulate(bodies=[Body("plate", THIN_PLATE, Pose3(0.0, -2.0), path=path)])
    assert [hit.name for hit in collision_starts(collisions(simulation, 120))] == ["plate"]


@pytest.mark.parametrize("offset_ticks", [0.0, 0.25, 0.5, 0.75])
def test_thin_plate_rotating_at_maximum_speed_collides_with_the_robot(simulate, offset_ticks):
    seconds = math.pi / 2 * 0.51 / FAST_M_S
    path = MotionPath((0.0, seconds), (Pose2(0, -0.55, 0), Pose2(0, -0.55, math.pi / 2)), start=offset_ticks / 240)
    simulation = simulate(bodies=[Body("plate", THIN_PLATE, Pose3(0.0, -0.55), path=path)])
    assert [hit.name for hit in collision_starts(collisions(simulation, 120))] == ["plate"]


def test_path_that_moves_a_body_too_far_in_one_tick_is_an_error(simulate):
    turn = MotionPath((0.0, 0.004), (Pose2(0.5, -0.5, 0), Pose2(0.5, -0.5, math.pi / 2)))
    with pytest.raises(RunError, match=r"`plate` moves up to 0\.79 m in one physics tick"):
        simulate(bodies=[Body("plate", THIN_PLATE, Pose3(0.5, -0.5), path=turn)])
    simulation = simulate(bodies=[Body("plate", THIN_PLATE, Pose3(0.5, -0.5))])
    with pytest.raises(RunError, match="`plate` moves up to"):
        simulation.move("plate", turn)
