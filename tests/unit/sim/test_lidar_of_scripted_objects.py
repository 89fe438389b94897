"""Tests of lidar ranges of scripted objects."""

import math

import numpy as np
from playground import box

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
REACH = 2.0
CARTS = [f"cart {number}" for number in range(16)]


def carts() -> list[Body]:
    """One after the other they cross a square of 20 m, about its middle."""
    rng, bodies = np.random.default_rng(1), []
    for name in CARTS:
        begin = Pose2(*rng.uniform(-10, 10, 2).tolist())
        end = Pose2(*(-rng.uniform(0.7, 1.3, 2) * begin[:2]).tolist())
        start, lasts = rng.uniform(0, 9), rng.uniform(6, 12)
        path = MotionPath((0.0, float(lasts)), (begin, end), start=float(start))
        bodies.append(Body(name, PARTS, Pose3.planar(begin), path=path))
    return [*bodies, Body("shelf", PARTS, Pose3(1.0, 1.0)), Body("late", PARTS, Pose3(-6.0, 6.0))]


def test_scan_equals_that_of_a_complete_scene(simulate, monkeypatch) -> None:
    """Whoever else looks, from wherever and however far; also once something is given a script."""
    monkeypatch.setattr(ray_caster, "REFRESH_DISTANCE_M", 0.5)
    simulation, rng = simulate(solids=[WALL], bodies=carts(), drive=(0.02, 0.0, 0.1)), np.random.default_rng(2)
    robot, told = simulation.robot, RayScene(merge_solids([WALL]))
    rays, watched = (LiveRayCaster(RayScene(merge_solids([WALL])), robot) for _ in range(2))
    ahead, met = 0, set[str]()
    for beat in range(130):
        robot.sample(24)
        if beat == 30:
            simulation.move("late", MotionPath((0.0, 8.0), (Pose2(-6.0, 6.0), Pose2(6.0, -6.0))))
        objects, pose = robot.objects(), simulation.base_pose()._replace(z=0.2)
        told.set_bodies({name: (MESH, there) for name, there in objects.items()})
        seen = told.sweep(FAN, pose, REACH)
        if beat % 2 == 1:
            watched.sweep(FAN, Pose3(*rng.uniform(-5, 5, 2).tolist(), 0.2), float(rng.uniform(1, 5)))
        assert np.array_equal(rays.sweep(FAN, pose, REACH), seen)
        assert np.array_equal(watched.sweep(FAN, pose, REACH), seen)
        if beat % 10 == 0:
            assert np.array_equal(watched.cast(*FAN.at(pose), REACH), told.cast(*FAN.at(pose), REACH))
        ahead += type(objects) is PosesAtTick
        met |= {name for name, there in objects.items() if math.dist(there[:2], pose[:2]) < REACH}
        simulation.step(24)
    assert ahead > 120, "worked out ahead, nearly always"
    assert met > {"shelf", "late"}
    assert len(met.intersection(CARTS)) > 5
