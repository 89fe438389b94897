"""Tests of lidar ranges of scripted objects."""

import math

import numpy as np
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.ray_fans import RayFan
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.run.live_world import ray_caster
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting.ray_scene import RayScene

WALL = box("wall", 4.0, 0.0, 0.2, 8.0)
PARTS = (box("cart", 0.2, 0, 0.5, 0.3, 0.4),)
MESH = merge_solids(PARTS)
FAN = RayFan(-math.pi, math.pi / 45, 90)
RANGE_M = 2.0
CARTS = [f"cart {number}" for number in range(16)]


def carts() -> list[Body]:
    """Return carts that cross the center of a square of 20 m, and two stationary bodies."""
    rng, bodies = np.random.default_rng(1), []
    for name in CARTS:
        start = Pose2(*rng.uniform(-10, 10, 2).tolist())
        end = Pose2(*(-rng.uniform(0.7, 1.3, 2) * start[:2]).tolist())
        start_s, duration_s = rng.uniform(0, 9), rng.uniform(6, 12)
        path = MotionPath((0.0, float(duration_s)), (start, end), start=float(start_s))
        bodies.append(Body(name, PARTS, Pose3.planar(start), path=path))
    return [*bodies, Body("shelf", PARTS, Pose3(1.0, 1.0)), Body("late", PARTS, Pose3(-6.0, 6.0))]


def test_scan_equals_that_of_a_complete_scene(simulate, monkeypatch) -> None:
    """This holds with other queries at other places as well, and after an object gets a path."""
    monkeypatch.setattr(ray_caster, "REFRESH_DISTANCE_M", 0.5)
    simulation, rng = simulate(solids=[WALL], bodies=carts(), drive=(0.02, 0.0, 0.1)), np.random.default_rng(2)
    robot, complete = simulation.robot, RayScene(merge_solids([WALL]))
    rays, queried = (LiveRayCaster(RayScene(merge_solids([WALL])), robot) for _ in range(2))
    precomputed, in_range = 0, set[str]()
    for beat in range(130):
        robot.sample(24)
        if beat == 30:
            simulation.move("late", MotionPath((0.0, 8.0), (Pose2(-6.0, 6.0), Pose2(6.0, -6.0))))
        objects, pose = robot.objects(), simulation.base_pose()._replace(z=0.2)
        complete.set_bodies({name: (MESH, object_pose) for name, object_pose in objects.items()}, {})
        expected = complete.sweep(FAN, pose, RANGE_M)
        if beat % 2 == 1:
            queried.sweep(FAN, Pose3(*rng.uniform(-5, 5, 2).tolist(), 0.2), float(rng.uniform(1, 5)))
        assert np.array_equal(rays.sweep(FAN, pose, RANGE_M), expected)
        assert np.array_equal(queried.sweep(FAN, pose, RANGE_M), expected)
        if beat % 10 == 0:
            assert np.array_equal(queried.cast(*FAN.at(pose), RANGE_M), complete.cast(*FAN.at(pose), RANGE_M))
        precomputed += type(objects) is PosesAtTick
        in_range |= {name for name, position in objects.items() if math.dist(position[:2], pose[:2]) < RANGE_M}
        simulation.step(24)
    assert precomputed > 120, "poses are nearly always precomputed"
    assert in_range > {"shelf", "late"}
    assert len(in_range.intersection(CARTS)) > 5
