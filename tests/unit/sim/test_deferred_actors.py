"""Tests of deferred actors, which are added to the engine when a robot comes near their path."""

import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest
from simulation_helpers import box, robot_spec

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.motion_paths import pose_at
from simscen.core.geometry.shapes import Body, Box, MotionPath, Solid
from simscen.core.records.events import EventKind
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.bullet import collision_shapes, engine, pybullet
from simscen.sim.objects.actor import Actor
from simscen.sim.objects.proximity import REQUERY_DISTANCE_M, DeferredActors, ProximityQuery
from simscen.sim.simulation import RobotPlacement, Simulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate

CRATE = (box("crate", 0, 0, 0.4, 0.4, 0.4),)
NAMES = [f"object {number}" for number in range(10)]


def random_path(rng, start, spread):
    """Return a random path from `start` with speeds up to 5 m/s."""
    places = [(start[0] + rng.gauss(0, spread), start[1] + rng.gauss(0, spread)) for _ in range(3)]
    mode = rng.choice(["once", "loop", "back_and_forth"])
    poses = [Pose2(*start), *(Pose2(*place, rng.uniform(-3, 3)) for place in places)]
    if mode == "loop":
        poses[-1] = poses[0]
    times = [0.0]
    for here, there in pairwise(poses):
        times.append(times[-1] + math.dist(here[:2], there[:2]) / rng.choice([0.5, 2.0, 5.0]) + 0.3)
    ease = rng.choice(["linear", "smooth", "spline"])
    return MotionPath(tuple(times), tuple(poses), mode, rng.choice([0.0, 1.0]), ease)


def random_body(rng, name, start):
    """Return a crate at `start`, with or without a path."""
    path = None if rng.random() < 0.3 else random_path(rng, start, rng.choice([1, 5]))
    return Body(name, CRATE, Pose3(*start), path=path)


@pytest.mark.parametrize("seed", range(4))
def test_actors_whose_paths_come_within_reach_are_activated(simulate, seed):
    """The expected distances are those of the paths at 101 times."""
    rng = random.Random(seed)
    bodies = [random_body(rng, f"{k}", (rng.uniform(-20, 20), rng.uniform(-20, 20))) for k in range(60)]
    simulation = simulate(bodies=bodies, pose=Pose2(100.0, 100.0), has_images=False)
    actors = list(simulation._scene.actors._actors.values())
    deferred, place = DeferredActors(actors), (rng.uniform(-5, 5), rng.uniform(-5, 5), 0.0)
    near, measured = deferred.activate_near([ProximityQuery(place, 3.0, 6.0)])

    def min_distance(actor: Actor) -> float:
        """Return the minimum distance of the actor's bounding circle from `place` along its path in m."""
        if actor.path is None:
            return math.dist(actor.body.pose[:2], place[:2]) - actor.bounding_radius
        times = (k / 100 * actor.path.times[-1] for k in range(101))
        distances = (math.dist(pose_at(actor.path, actor.path.start + at)[:2], place[:2]) for at in times)
        return min(distances) - actor.bounding_radius

    distances = {actor.body.name: min_distance(actor) for actor in actors}
    deviations = {actor.body.name: max(segment.deviation for segment in actor.segments) for actor in actors}
    names = {actor.body.name for actor in near}
    assert 0 < len(names) < 50
    assert {name for name, distance in distances.items() if distance <= 3.0 + REQUERY_DISTANCE_M} <= names
    assert {name for name in names if distances[name] > 3.2 + REQUERY_DISTANCE_M + deviations[name]} == set()
    assert {actor.body.name for actor in measured} >= {
        name for name, distance in distances.items() if 4.0 + deviations[name] < distance <= 6.0
    }
    assert not names & {actor.body.name for actor in measured}
    shifted = (place[0] + REQUERY_DISTANCE_M, *place[1:])
    assert deferred.activate_near([ProximityQuery(shifted, 3.0 - REQUERY_DISTANCE_M, 6.0 - REQUERY_DISTANCE_M)]) == (
        [],
        [],
    )


def drive_among_carts(seed, has_images):
    """Return truths and collisions of two robots, and the numbers of actors in the engine and in total."""
    rng = random.Random(seed)
    fast = build_robot_body(robot_spec("turtlebot"))
    fast = replace(fast, limits=fast.limits.model_copy(update={"linear": 2.0, "linear_acceleration": 4.0}))
    bodies = [random_body(rng, name, (rng.uniform(-9, 9), rng.uniform(-9, 9))) for name in NAMES]
    bodies += [random_body(rng, f"far {number}", (60.0, 10.0 * number)) for number in range(3)]
    placed = {
        "a": RobotPlacement(fast, Pose2(0.0, 0.0)),
        "b": RobotPlacement(build_robot_body(robot_spec("jackal")), Pose2(2.0, 1.5)),
    }
    simulation = Simulation(
        merge_solids([box("post", 3, -2, 0.3, 0.3)]), bodies, placed, triangulate, has_images=has_images
    )
    beats = []
    for beat in range(48):
        simulation.step(6)
        for robot in simulation.robots.values():
            robot.drive(Twist(1.5 if beat % 20 < 15 else -1.5, 0.0, 1.0))
            beats.append((robot.truth(), robot.collisions()))
        if beat % 8 == 7:
            robot, name = simulation.robots[rng.choice("ab")], rng.choice(NAMES)
            here, there = robot.base_pose(), simulation.object_pose(name)
            beside = (here.x + rng.uniform(0.3, 1.0), here.y + rng.uniform(-1.0, 1.0))
            action = beat // 8
            if action in (0, 3):  # beside a cart or overlapping it
                simulation.place_robot(robot.name, Pose2(there.x + rng.uniform(-0.9, 0.9), there.y + 0.5))
            elif action == 1:
                simulation.spawn(random_body(rng, "new", beside))
            elif action == 2:
                simulation.move(name, random_path(rng, there[:2], 3))
            else:
                simulation.place(name, Pose2(*beside))
    count = len(simulation._scene.actors.names_by_id()), len(simulation._scene.actors.bodies())
    simulation.close()
    return beats, count


def squeeze(seed, every=6, **observation):
    """Return the poses of a robot between a crate and two carts that meet it 8 m from its start."""
    rng = random.Random(seed)

    def cart(name, side, offset):
        poses = (
            Pose2(8.0 + offset, side * 2.0, rng.uniform(-0.3, 0.3)),
            Pose2(8.0 + rng.uniform(-0.1, 0.1), side * rng.uniform(0.25, 0.35), rng.uniform(-0.3, 0.3)),
        )
        path = MotionPath((0.0, rng.uniform(1.5, 4.0)), poses, "once", 12.0, "linear")
        return Body(name, CRATE, Pose3(*poses[0][:2]), path=path)

    crate = Body("m", CRATE, Pose3(8.55 + rng.uniform(0.0, 0.05), rng.uniform(-0.1, 0.1)))
    bodies = [cart("a", 1, rng.uniform(2, 4)), cart("z", -1, -rng.uniform(3, 5)), crate]
    placed = {"": RobotPlacement(build_robot_body(robot_spec("turtlebot")), Pose2(0.0, 0.0))}
    simulation = Simulation(merge_solids([box("post", 3, -2, 0.3, 0.3)]), bodies, placed, triangulate, **observation)
    robot = simulation.robots[""]
    robot.drive(Twist(0.65, 0.0, 0.0))
    poses = []
    for _ in range(4800 // every):
        simulation.step(every)
        poses.append(robot.truth().pose)
    simulation.close()
    return poses


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [1, 6, 10])
def test_observations_do_not_change_the_contacts_of_a_jammed_robot(seed):
    poses = squeeze(seed, has_images=False)
    assert squeeze(seed, has_images=True) == poses
    assert squeeze(seed, has_images=False, clearance_range=6.0) == poses
    assert squeeze(seed, every=24, has_images=False) == poses[3::4]


@pytest.mark.parametrize("seed", [4, 6])
def test_robots_collide_as_if_all_actors_were_in_the_engine_from_the_start(seed):
    """Images need all actors in the engine. Results are equal to the last bit."""
    complete, (complete_in_engine, complete_total) = drive_among_carts(seed, has_images=True)
    deferred, (in_engine, total) = drive_among_carts(seed, has_images=False)
    assert deferred == complete
    assert complete_in_engine == complete_total == total > in_engine
    assert EventKind.COLLISION_STARTED in {event.kind for _, events in complete for event in events}


def actors_in_engine(simulation):
    return set(simulation._scene.actors.names_by_id().values())


RADIUS = build_robot_body(robot_spec("turtlebot")).radius
FAR = Body("far", CRATE, Pose3(7.5))
APPROACHING = Body("approaching", CRATE, Pose3(0, 30), path=MotionPath((0.0, 60.0), (Pose2(0, 30), Pose2(0, 1.0))))


def test_engine_has_actors_whose_path_comes_near_the_robot(simulate):
    simulation = simulate(bodies=[FAR, APPROACHING], has_images=False)
    assert actors_in_engine(simulation) == {"approaching"}
    simulation.place_robot(Pose2(4.0, 0.0))
    assert actors_in_engine(simulation) == {"approaching", "far"}
    assert simulation.truth().clearance == 2.0
    simulation.place_robot(Pose2(6.5, 0.0))
    assert simulation.truth().clearance == pytest.approx(7.3 - 6.5 - RADIUS, abs=0.001)


@pytest.mark.parametrize("every", [12, 18 * 240], ids=["sampled often", "sampled once"])
def test_robot_collides_with_an_actor_that_was_deferred(simulate, every):
    simulation = simulate(bodies=[FAR], drive=(0.5, 0.0, 0.0), has_images=False)
    for _ in range(18 * 240 // every):
        simulation.step(every)
        clearance = simulation.truth().clearance
    assert clearance <= 0.0
    assert [event.name for event in simulation.robot.collisions()] == ["far"]


def test_no_actor_is_deferred_if_one_can_be_pushed(simulate):
    simulation = simulate(bodies=[FAR], has_images=False)
    assert actors_in_engine(simulation) == set()
    simulation.spawn(Body("light", CRATE, Pose3(-3.0), mass=1.0))
    assert actors_in_engine(simulation) == {"far", "light"}


def test_steered_actor_is_not_deferred(simulate):
    simulation = simulate(has_images=False)
    simulation.add_steered_body(FAR, 1.0)
    assert actors_in_engine(simulation) == {"far"}


def test_distance_to_a_deferred_actor_is_an_error(simulate):
    """Otherwise, a collision with a deferred actor could be missed."""
    simulation = simulate(bodies=[FAR], has_images=False)
    with pytest.raises(LookupError, match='"far" is not in the engine'):
        simulation._scene.actors.prepare_nearby(simulation.robot.base.id, (7.0, 0.0, 0.0), 2.0, 2.0, 0)


def test_scripted_body_with_reenabled_collisions_has_no_ground_contact(simulate):
    """Such a contact would cost time at each step."""
    client = simulate()._scene.client
    shape = collision_shapes.create_compound_shape(client, [Solid(Box((0.4, 0.4, 0.4)), Pose3())])
    inertia = ((0.0, 0.0, 0.0), Pose3())
    body = engine.create_rigid_body(client, 0.0, shape, Pose3(5.0, 0.0, 0.2), inertia, friction=0.6)
    engine.disable_collisions(client, body)
    engine.enable_collisions(client, body)
    pybullet.resetBaseVelocity(body, (0.1, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=client)
    pybullet.stepSimulation(client)
    assert not pybullet.getContactPoints(body, physicsClientId=client)
