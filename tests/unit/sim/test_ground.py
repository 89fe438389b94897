"""Tests of wheels on uneven ground against closed forms."""

import math

import numpy as np
import pytest
from simulation_helpers import box, robot_spec

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.meshes import drivable_solids
from simscen.core.geometry.shapes import Body, Box, Mesh, Solid
from simscen.sim.body.climb_limits import compute_climb_limits, grip_angle
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.body.robot_body import add_payload
from simscen.worlds.geometry.drive_obstacles import drive_obstacles
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.world_file import ramp_solid

TICKS = 240
RAMP_START_M = 0.5


def ramp(degrees, length=2.0, friction=1.0, width=2.0):
    """Return a ramp that starts at x = RAMP_START_M."""
    height = length * math.tan(math.radians(degrees))
    return ramp_solid((RAMP_START_M, 0.0), (RAMP_START_M + length, 0.0), width, height, "ramp", friction)


@pytest.fixture
def on_ground(simulate):
    """Return a function that creates a simulation whose robot knows which obstacles it can climb."""

    def make(robot, solids, **options):
        body = build_robot_body(robot_spec(robot))
        reach = max((wheel.radius for wheel in body.wheels), default=0.0)
        return simulate(
            body,
            solids,
            obstacles=merge_solids(drive_obstacles(tuple(solids), reach, *compute_climb_limits(body))),
            **options,
        )

    return make


def pitch(pose):
    return math.asin(2 * (pose.qw * pose.qy - pose.qz * pose.qx))


def drive_for(simulation, seconds):
    """Step the simulation for `seconds`; return the names of the solids that the robot hits."""
    hit = []
    for _ in range(round(seconds * TICKS / 24)):
        simulation.step(24)
        simulation.truth()
        hit += [event.name for event in simulation.robot.collisions()]
    return hit


@pytest.mark.parametrize("robot", ["turtlebot", "amr", "jackal", "car"])
def test_robot_climbs_a_ramp_of_5_degrees_and_odometry_measures_along_it(on_ground, robot):
    simulation = on_ground(robot, [ramp(5)], drive=(0.4, 0.0, 0.0))
    start = simulation.encoders()[0]
    assert drive_for(simulation, 4.5) == []
    pose = simulation.truth().pose
    height = (pose.x - RAMP_START_M) * math.tan(math.radians(5))
    assert pose.z == pytest.approx(height, abs=2e-3)
    assert pitch(pose) == pytest.approx(-math.radians(5), abs=2e-3)
    radius = robot_spec(robot).drive.wheel_radius
    distance = RAMP_START_M + (pose.x - RAMP_START_M) / math.cos(math.radians(5))
    assert (simulation.encoders()[0] - start) * radius == pytest.approx(distance, rel=0.01)
    assert simulation.truth().clearance > 0.1  # a ramp that the robot can climb is no obstacle


@pytest.mark.parametrize("robot", ["turtlebot", "amr"])
def test_robot_collides_with_a_ramp_of_30_degrees(on_ground, robot):
    simulation = on_ground(robot, [ramp(30)], drive=(0.4, 0.0, 0.0))
    assert "ramp" in drive_for(simulation, 4)
    assert simulation.truth().pose.z < 0.02


def test_robot_on_a_ramp_stays_at_rest(on_ground):
    simulation = on_ground("turtlebot", [ramp(5)], pose=Pose2(RAMP_START_M + 1.0, 0.2, math.pi / 2))
    drive_for(simulation, 2)
    pose = simulation.truth().pose
    assert pose.x == pytest.approx(RAMP_START_M + 1.0, abs=2e-3)
    assert pose.z == pytest.approx(math.tan(math.radians(5)), abs=2e-3)
    assert pitch(pose) == pytest.approx(0.0, abs=2e-3)  # the robot faces across the slope: the slope is a roll angle


@pytest.mark.parametrize(
    ("robot", "share", "climbs"),
    [
        ("turtlebot", 0.9, True),
        ("turtlebot", 1.4, False),
        ("amr", 0.9, True),
        ("amr", 1.4, False),
        ("jackal", 0.9, True),  # the robot also climbs higher steps, because its rear wheels push
    ],
)
def test_driven_wheels_climb_steps_up_to_the_limit_of_their_friction(on_ground, robot, share, climbs):
    """Without a run-up, the limit is r (1 - 1 / sqrt(1 + mu²))."""
    body = build_robot_body(robot_spec(robot))
    step = share * compute_climb_limits(body).step
    simulation = on_ground(robot, [box("step", 1.0, 0, 1.0, 2, step)], pose=Pose2(0.3, 0, 0), drive=(0.05, 0, 0))
    drive_for(simulation, 12)
    assert (simulation.truth().pose.x > 0.7) == climbs


def test_robot_drives_over_a_sill_of_6_mm_without_a_collision(on_ground):
    simulation = on_ground("turtlebot", [box("sill", RAMP_START_M, 0, 0.05, 2, 0.006)], drive=(0.4, 0, 0))
    heights = []
    for _ in range(30):
        assert drive_for(simulation, 0.1) == []
        heights.append(simulation.truth().pose.z)
    assert max(heights) == pytest.approx(0.006, abs=1e-3)
    assert simulation.truth().pose.x > 1.0


def test_robot_collides_with_a_step_that_its_hull_cannot_pass(on_ground):
    simulation = on_ground("turtlebot", [box("step", 1.0, 0, 1, 2, 0.05)], drive=(0.4, 0, 0))
    assert "step" in drive_for(simulation, 2)


@pytest.mark.parametrize(("share", "climbs"), [(0.9, False), (1.15, True)])
@pytest.mark.parametrize("robot", ["jackal", "turtlebot"])
def test_robot_climbs_a_slope_only_with_enough_friction(on_ground, robot, share, climbs):
    """The limit is tan θ = μ times the share of the weight on driven wheels."""
    degrees, body = 6.0, build_robot_body(robot_spec(robot))
    low, high = 0.01, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if grip_angle(body, middle) < math.radians(degrees) else (low, middle)
    surface = ramp(degrees, friction=share * high)
    simulation = on_ground(robot, [surface], pose=Pose2(RAMP_START_M + 0.8, 0, 0), drive=(0.3, 0, 0))
    drive_for(simulation, 2)
    assert (simulation.truth().pose.x > RAMP_START_M + 0.8) == climbs


def test_robot_climbs_a_height_field_like_a_ramp(on_ground):
    steps = np.linspace(0.0, 3.0, 31)
    x, y = np.meshgrid(steps, np.linspace(-1.0, 1.0, 21))
    z = np.clip(x - RAMP_START_M, 0.0, 1.0) * math.tan(math.radians(5))
    number = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    sw, se, nw, ne = (part.ravel() for rows in (number[:-1], number[1:]) for part in (rows[:, :-1], rows[:, 1:]))
    faces = np.concatenate((np.column_stack((sw, se, ne)), np.column_stack((sw, ne, nw))))
    terrain = Solid(Mesh(np.column_stack((x.ravel(), y.ravel(), z.ravel())), faces), Pose3(), "terrain")
    simulation = on_ground("turtlebot", [terrain], drive=(0.4, 0.0, 0.0))
    assert drive_for(simulation, 5) == []
    assert simulation.truth().pose.z == pytest.approx(math.tan(math.radians(5)), abs=3e-3)


def test_planar_base_is_stopped_by_a_ramp(on_ground):
    simulation = on_ground("omni", [ramp(10)], drive=(0.4, 0.0, 0.0))
    assert "ramp" in drive_for(simulation, 4)
    assert simulation.truth().pose.z == 0.0


def test_walls_leave_the_ground_flat(simulate):
    """Walls contain no drivable surfaces."""
    mesh = merge_solids([box("wall", 1, 0, 0.1, 4), box("crate", -1, 0, 0.5, 0.5, 0.4), box("line", 0, 1, 1, 1, 0.004)])
    assert drivable_solids(mesh, 0.1) == frozenset()
    simulation = simulate(solids=[box("wall", 1, 0, 0.1, 4)], drive=(0.2, 0, 0))
    simulation.drive(Twist(0.1, 0, 0))
    simulation.step(24)
    assert abs(simulation.truth().pose.z) < 1e-4


def test_objects_and_robots_are_placed_on_top_of_a_platform(on_ground):
    """A crate that is spawned on a platform stays at rest on it."""
    simulation = on_ground("turtlebot", [box("platform", 3.0, 0, 2.0, 2.0, 0.03)])
    crate = (Solid(Box((0.2, 0.2, 0.2)), Pose3(z=0.1), "crate"),)
    simulation.spawn(Body("crate", crate, Pose3(3.5, 0.5, 0.0), mass=2.0))
    simulation.place_robot(Pose2(2.8, -0.2, 0.5))
    assert drive_for(simulation, 1) == []
    assert simulation.truth().pose.z == pytest.approx(0.03, abs=1e-3)
    assert simulation.robot.objects()["crate"].z == pytest.approx(0.03, abs=2e-3)


def test_imu_on_a_slope_measures_gravity_along_x(on_ground):
    simulation = on_ground("turtlebot", [ramp(5)], pose=Pose2(RAMP_START_M + 1.0, 0.0, 0.0))
    drive_for(simulation, 1)
    base_from_world = simulation.truth().pose.rotation().T
    assert (base_from_world @ (0.0, 0.0, 9.81))[0] == pytest.approx(9.81 * math.sin(math.radians(5)), abs=0.02)


def test_robot_that_tips_over_a_caster_climbs_no_slope():
    body = build_robot_body(robot_spec("turtlebot"))
    assert compute_climb_limits(add_payload(body, 100.0, (1.0, 0.0, 0.2))).slope == 0.0


def test_object_is_placed_on_the_ground_at_its_new_position(on_ground):
    platform = box("platform", 3.0, 0.0, 1.0, 1.0, 0.02)
    crate = Body("crate", (box("crate", 0, 0, 0.3, 0.3, 0.3),), Pose3(0.0, 2.0, 0.1))
    simulation = on_ground("turtlebot", [platform], bodies=[crate])
    for place, height in (((3.0, 0.0), 0.12), ((3.2, 0.1), 0.12), ((0.0, -2.0), 0.1)):
        simulation.place("crate", Pose2(*place, 0.5))
        assert simulation.object_pose("crate").position == pytest.approx((*place, height), abs=1e-6)


@pytest.mark.parametrize(("z", "height"), [(0.0, 0.02), (0.02, 0.02), (0.1, 0.1)])
def test_object_that_stands_on_a_platform_is_not_raised_again(on_ground, z, height):
    platform = box("platform", 3.0, 0.0, 1.0, 1.0, 0.02)
    crate = Body("crate", (box("crate", 0, 0, 0.3, 0.3, 0.3),), Pose3(3.0, 0.0, z))
    simulation = on_ground("turtlebot", [platform], bodies=[crate])
    assert simulation.object_pose("crate").z == pytest.approx(height, abs=1e-6)
