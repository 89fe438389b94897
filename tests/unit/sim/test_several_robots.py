"""Tests of several robots in one simulation."""

import math

import numpy as np
import pytest
from playground import box, shipped

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.simulation import RobotPlacement, Simulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.raycasting.ray_scene import RayScene

FRONT = Twist(0.3, 0.0, 0.0)


@pytest.fixture
def meet():
    """Makes simulations of robots by name and closes them."""
    made = []

    def make(solids=(), **robots):
        placed = {
            name: RobotPlacement(build_robot_body(shipped(model)), Pose2(*pose))
            for name, (model, *pose) in robots.items()
        }
        made.append(Simulation(merge_solids(list(solids)), [], placed, triangulate))
        return made[-1]

    yield make
    for simulation in made:
        simulation.close()


def drive(simulation, ticks, **commands):
    """The truths of all robots, every 24 ticks, while they drive what they are told."""
    told = []
    for _ in range(ticks // 24):
        for name, twist in commands.items():
            simulation.robots[name].drive(twist)
        simulation.step(24)
        told.append({name: robot.truth() for name, robot in simulation.robots.items()})
    return told


def corners(simulation, name, body):
    """The footprint of a robot in the world, densely sampled."""
    ring = np.array(body.footprint)
    edges = zip(ring, np.roll(ring, -1, axis=0), strict=True)
    points = np.concatenate([a + np.linspace(0, 1, 400)[:, None] * (b - a) for a, b in edges])
    return simulation.robots[name].base_pose().plane.apply(points)


@pytest.mark.slow
def test_the_clearance_of_each_counts_the_other_as_measured_by_brute_force(meet):
    amr, turtlebot = build_robot_body(shipped("amr")), build_robot_body(shipped("turtlebot"))
    for x, y, yaw in ((1.3, 0.4, 0.7), (0.2, 1.1, 2.0), (-1.2, -0.6, -1.0)):
        simulation = meet(a=("amr", 0.0, 0.0, 0.3), b=("turtlebot", x, y, yaw))
        here, there = corners(simulation, "a", amr), corners(simulation, "b", turtlebot)
        apart = np.hypot(*(here[:, None] - there[None]).transpose(2, 0, 1)).min()
        for name in "ab":
            assert simulation.robots[name].truth().clearance == pytest.approx(apart, abs=0.01)


def test_a_collision_names_the_other_robot_on_both_sides_and_whose_doing_it_was(meet):
    simulation = meet(a=("turtlebot", 0.0, 0.0, 0.0), b=("turtlebot", 1.0, 0.0, 0.0))
    drive(simulation, 720, a=FRONT)
    hit, was_hit = (simulation.robots[name].collisions()[0] for name in "ab")
    assert (hit.name, was_hit.name) == ("b", "a")
    assert hit.tick == was_hit.tick
    assert hit.data["robot_caused"] and not was_hit.data["robot_caused"]
    assert hit.data["speed"] == pytest.approx(was_hit.data["speed"], abs=1e-6)
    assert hit.data["speed"] == pytest.approx(0.3, abs=0.03)
    assert simulation.robots["b"].base_pose().x > 1.0, "it is pushed"


def test_each_robot_is_an_object_for_the_other(meet):
    simulation = meet(a=("turtlebot", 0.0, 0.0, 0.0), b=("turtlebot", 2.0, 0.0, 0.0))
    a = simulation.robots["a"]
    assert list(a.truth().objects) == ["b"]
    assert a.truth().objects["b"] == simulation.robots["b"].base_pose()
    rays = LiveRayCaster(RayScene(merge_solids([])), a)
    (ahead, back) = rays.cast(np.array([[0.3, 0.0, 0.1]] * 2), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), 5.0)
    radius = build_robot_body(shipped("turtlebot")).radius
    assert ahead == pytest.approx(1.7 - radius, abs=0.02)
    assert math.isinf(back), "it does not see itself"


def test_a_robot_far_away_changes_nothing_bit_for_bit(meet):
    walls = [box("wall", 3.0, 0.0, 0.2, 4.0)]
    alone = meet(walls, a=("turtlebot", 0.0, 0.0, 0.1))
    among = meet(walls, b=("jackal", 40.0, 5.0, 1.0), a=("turtlebot", 0.0, 0.0, 0.1), aa=("amr", -30.0, 5.0, 1.0))
    turn = Twist(0.3, 0.0, 0.2)
    first = drive(alone, 2400, a=turn)
    second = drive(among, 2400, a=turn, b=Twist(0.5, 0.0, 0.5), aa=FRONT)
    same = [(one["a"].pose, one["a"].twist, one["a"].clearance) for one in first]
    assert same == [(one["a"].pose, one["a"].twist, one["a"].clearance) for one in second]


def test_the_order_in_which_robots_are_named_changes_nothing(meet):
    robots = {"a": ("turtlebot", 0.0, 0.0, 0.0), "b": ("turtlebot", 0.9, 0.1, math.pi)}
    told = [drive(meet(**order), 720, a=FRONT, b=FRONT) for order in (robots, dict(reversed(robots.items())))]
    assert told[0] == told[1]
