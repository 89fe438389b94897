"""Tests of several robots in one simulation."""

import math

import numpy as np
import pytest
from simulation_helpers import box, robot_spec

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.simulation import RobotPlacement, Simulation
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.raycasting.ray_scene import RayScene

FORWARD = Twist(0.3, 0.0, 0.0)


@pytest.fixture
def fleet():
    """Return a function that creates simulations of robots by name, and close them after the test."""
    simulations = []

    def make(solids=(), **robots):
        placed = {
            name: RobotPlacement(build_robot_body(robot_spec(model)), Pose2(*pose))
            for name, (model, *pose) in robots.items()
        }
        simulations.append(Simulation(merge_solids(list(solids)), [], placed, triangulate))
        return simulations[-1]

    yield make
    for simulation in simulations:
        simulation.close()


def drive(simulation, ticks, **commands):
    """Drive robots with constant commands; return the truths of all robots every 24 ticks."""
    truths = []
    for _ in range(ticks // 24):
        for name, twist in commands.items():
            simulation.robots[name].drive(twist)
        simulation.step(24)
        truths.append({name: robot.truth() for name, robot in simulation.robots.items()})
    return truths


def sample_footprint(simulation, name, body):
    """Return densely sampled points of the footprint of a robot in the world."""
    ring = np.array(body.footprint)
    edges = zip(ring, np.roll(ring, -1, axis=0), strict=True)
    points = np.concatenate([a + np.linspace(0, 1, 400)[:, None] * (b - a) for a, b in edges])
    return simulation.robots[name].base_pose().plane.apply(points)


@pytest.mark.slow
def test_clearance_between_two_robots_equals_brute_force(fleet):
    amr, turtlebot = build_robot_body(robot_spec("amr")), build_robot_body(robot_spec("turtlebot"))
    for x, y, yaw in ((1.3, 0.4, 0.7), (0.2, 1.1, 2.0), (-1.2, -0.6, -1.0)):
        simulation = fleet(a=("amr", 0.0, 0.0, 0.3), b=("turtlebot", x, y, yaw))
        outline_a, outline_b = sample_footprint(simulation, "a", amr), sample_footprint(simulation, "b", turtlebot)
        expected = np.hypot(*(outline_a[:, None] - outline_b[None]).transpose(2, 0, 1)).min()
        for name in "ab":
            assert simulation.robots[name].truth().clearance == pytest.approx(expected, abs=0.01)


def test_collision_of_two_robots_names_the_other_robot_and_the_cause(fleet):
    simulation = fleet(a=("turtlebot", 0.0, 0.0, 0.0), b=("turtlebot", 1.0, 0.0, 0.0))
    drive(simulation, 720, a=FORWARD)
    hit_of_a, hit_of_b = (simulation.robots[name].collisions()[0] for name in "ab")
    assert (hit_of_a.name, hit_of_b.name) == ("b", "a")
    assert hit_of_a.tick == hit_of_b.tick
    assert hit_of_a.data["robot_caused"] and not hit_of_b.data["robot_caused"]
    assert hit_of_a.data["speed"] == pytest.approx(hit_of_b.data["speed"], abs=1e-6)
    assert hit_of_a.data["speed"] == pytest.approx(0.3, abs=0.03)
    assert simulation.robots["b"].base_pose().x > 1.0, "robot b is pushed"


def test_each_robot_is_an_object_for_the_other(fleet):
    simulation = fleet(a=("turtlebot", 0.0, 0.0, 0.0), b=("turtlebot", 2.0, 0.0, 0.0))
    a = simulation.robots["a"]
    assert list(a.truth().objects) == ["b"]
    assert a.truth().objects["b"] == simulation.robots["b"].base_pose()
    rays = LiveRayCaster(RayScene(merge_solids([])), a)
    (front, back) = rays.cast(np.array([[0.3, 0.0, 0.1]] * 2), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), 5.0)
    radius = build_robot_body(robot_spec("turtlebot")).radius
    assert front == pytest.approx(1.7 - radius, abs=0.02)
    assert math.isinf(back), "a robot does not see itself"


def test_distant_robots_do_not_change_any_bit_of_the_motion(fleet):
    walls = [box("wall", 3.0, 0.0, 0.2, 4.0)]
    single = fleet(walls, a=("turtlebot", 0.0, 0.0, 0.1))
    several = fleet(walls, b=("jackal", 40.0, 5.0, 1.0), a=("turtlebot", 0.0, 0.0, 0.1), aa=("amr", -30.0, 5.0, 1.0))
    turn = Twist(0.3, 0.0, 0.2)
    single_truths = drive(single, 2400, a=turn)
    several_truths = drive(several, 2400, a=turn, b=Twist(0.5, 0.0, 0.5), aa=FORWARD)
    expected = [(truths["a"].pose, truths["a"].twist, truths["a"].clearance) for truths in single_truths]
    assert expected == [(truths["a"].pose, truths["a"].twist, truths["a"].clearance) for truths in several_truths]


def test_order_of_robots_does_not_change_the_run(fleet):
    robots = {"a": ("turtlebot", 0.0, 0.0, 0.0), "b": ("turtlebot", 0.9, 0.1, math.pi)}
    truths = [drive(fleet(**order), 720, a=FORWARD, b=FORWARD) for order in (robots, dict(reversed(robots.items())))]
    assert truths[0] == truths[1]
