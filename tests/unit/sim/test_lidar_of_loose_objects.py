"""Tests of lidar ranges of movable objects."""

import math

import numpy as np
from simulation_helpers import box

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.ray_fans import RayFan
from simscen.core.geometry.shapes import Body
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting.ray_scene import RayScene

WALL = box("wall", 4.0, 0.0, 0.2, 8.0)
CRATE = (box("crate", 0, 0, 0.3, 0.3, 0.3),)
CRATES = [Body(f"crate {k}", CRATE, Pose3.planar(Pose2(1.0 + 0.5 * k, 0.4 * (k % 3), 0.3 * k)), 3.0) for k in range(6)]
FAN = RayFan(-math.pi, math.pi / 45, 90)


def drive(simulate, every, observe):
    """Return the scans of a level fan at 5 Hz; call `observe` every `every` ticks."""
    simulation = simulate(solids=[WALL], bodies=CRATES, drive=(0.4, 0.0, 0.0))
    rays, scans = LiveRayCaster(RayScene(merge_solids([WALL])), simulation.robot), []
    for tick in range(0, 3612, 12):
        if tick in (660, 840):
            simulation.drive(Twist(-0.3, 0.0, 0.0) if tick == 660 else Twist())
        if tick == 780:
            simulation.spawn(Body("late", CRATE, Pose3(-1.0, 0.5, 0.0), 3.0))
        if tick == 876:
            simulation.remove("crate 5")
        if tick % 48 == 0:
            scans.append(np.minimum(rays.sweep(FAN, simulation.base_pose()._replace(z=0.2), 6.0), 6.0))
        if tick % every == 0:
            observe(simulation)
        simulation.step(12)
    return simulation, np.array(scans)


def test_scan_does_not_depend_on_other_lidars(simulate):
    """Pushed objects leave their rest poses, and get new ones where they come to rest."""
    other_casters, resting = [], []

    def observe(simulation):
        rest_poses = simulation.robot.rest_poses
        if not other_casters:
            scene = RayScene(merge_solids([WALL]))
            other_casters.append(LiveRayCaster(scene, simulation.robot, frozenset({"crate 1"})))
        other_casters[0].sweep(FAN, Pose3.from_rpy(0.0, 0.5, 0.3, 0.1, 0.2, 0.0), 9.0)
        resting.append({name for name, pose in simulation.robot.objects().items() if rest_poses.get(name) == pose})

    _, expected = drive(simulate, 3612, lambda _: None)
    _, observed = drive(simulate, 36, observe)
    assert np.array_equal(expected, observed)
    assert resting[0] == {body.name for body in CRATES}
    assert any(len(names) == 5 and "crate 0" not in names for names in resting), "the robot has pushed it"
    assert any(len(names) < 2 for names in resting), "spawning and removing wake all objects"
    assert resting[-1] == {"late", *(body.name for body in CRATES[:5])}, "all have come to rest"


def test_scan_equals_the_minimum_over_single_objects(simulate):
    separate = []

    def observe(simulation):
        scene = RayScene(merge_solids([WALL]))
        scene.set_bodies(
            {
                name: (merge_solids(body.solids), pose)
                for name, (body, pose) in simulation.robot.bodies_and_poses().items()
            },
            {},
        )
        separate.append(np.minimum(scene.sweep(FAN, simulation.base_pose()._replace(z=0.2), 6.0), 6.0))

    _, scans = drive(simulate, 48, observe)
    assert np.abs(scans - np.array(separate)).max() < 1e-5
    assert (scans < 6.0).sum() > 500
