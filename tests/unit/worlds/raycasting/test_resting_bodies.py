"""Tests of ray casting against resting bodies."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.ray_fans import RayFan
from simscen.core.geometry.shapes import Box, Cylinder, Solid
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.raycasting import mesh_scene, ray_scene
from simscen.worlds.raycasting.ray_scene import RayScene

WALLS = merge_solids([Solid(Box((20.0, 0.2, 1.0)), Pose3(0.0, y, 0.5)) for y in (-10.0, 10.0)])
STOOL = merge_solids([Solid(Cylinder(0.2, 0.05), Pose3(z=0.4)), Solid(Box((0.05, 0.05, 0.4)), Pose3(0.1, 0.0, 0.2))])
CRATE = merge_solids([Solid(Box((0.6, 0.4, 0.5)), Pose3(z=0.25))])
RNG = np.random.default_rng(21)
REST_POSES = {f"body {k:02}": Pose3.planar(Pose2(*RNG.uniform((-9, -9, -3), (9, 9, 3)))) for k in range(30)}
LEVEL, PITCHED = Pose3(0.5, 0.2, 0.18), Pose3.from_rpy(0.4, 0.1, 0.5, 0.05, -0.3, 1.0)
FAN = RayFan(-math.pi, math.pi / 90, 180)


def bodies_at(poses):
    """Return mesh and pose of each body: a stool if its number is divisible by 3, otherwise a crate."""
    return {name: (CRATE if int(name[5:]) % 3 else STOOL, pose) for name, pose in poses.items()}


def random_rays():
    """Return the origins and directions of 400 random rays."""
    directions = np.random.default_rng(5).normal(size=(400, 3))
    origins = np.random.default_rng(6).uniform((-9, -9, 0.05), (9, 9, 0.8), (400, 3))
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


def ranges_of(scene, reach=9.0):
    """Return the ranges of a level fan, a pitched fan, and random rays."""
    sweeps = [scene.sweep(FAN, lens, reach) for lens in (LEVEL, PITCHED)]
    return np.concatenate(
        [*(np.where(ends > reach, np.inf, ends) for ends in sweeps), scene.cast(*random_rays(), reach)]
    )


def pose_sequence():
    """Yield body poses over time, in which more and more resting bodies are moved or removed."""
    poses = dict(REST_POSES)
    yield dict(poses)
    for number, (name, rest_pose) in enumerate(REST_POSES.items()):
        if number % 4 == 1:
            poses[name] = rest_pose._replace(x=rest_pose.x + 1e-6 * number, y=rest_pose.y + 0.1)
        elif number % 4 == 2:
            del poses[name]
        elif number == 12:
            poses = dict(REST_POSES)  # all bodies return
        yield dict(poses)


@pytest.mark.parametrize(
    ("triangles", "groups"), [(ray_scene.MAX_GROUP_TRIANGLES, ray_scene.REGROUPING_THRESHOLD), (60, 3)]
)
def test_reused_scene_gives_the_ranges_of_a_new_scene(monkeypatch, triangles, groups):
    """The new scene has had no bodies, or only some of the bodies, before."""
    monkeypatch.setattr(ray_scene, "MAX_GROUP_TRIANGLES", triangles)
    monkeypatch.setattr(ray_scene, "REGROUPING_THRESHOLD", groups)
    reused = RayScene(WALLS)
    for number, poses in enumerate(list(pose_sequence())[::2]):
        fresh = RayScene(WALLS)
        if number % 3:
            reused.set_bodies(bodies_at(poses), REST_POSES)
        if number % 5 == 0:
            fresh.set_bodies(bodies_at({name: REST_POSES[name] for name in list(REST_POSES)[::2]}), REST_POSES)
            fresh.sweep(FAN, LEVEL, 5.0)
        reused.set_bodies(bodies_at(poses), REST_POSES)
        fresh.set_bodies(bodies_at(poses), REST_POSES)
        assert np.array_equal(ranges_of(reused), ranges_of(fresh))


@pytest.mark.parametrize("reach", [2.5, 9.0, math.inf])
def test_merged_resting_bodies_give_the_ranges_of_separate_bodies(reach):
    merged, separate = RayScene(WALLS), RayScene(WALLS)
    for poses in list(pose_sequence())[::6]:
        merged.set_bodies(bodies_at(poses), REST_POSES)
        separate.set_bodies(bodies_at(poses), {})
        ours, theirs = ranges_of(merged, reach), ranges_of(separate, reach)
        hit = np.isfinite(ours) & np.isfinite(theirs)
        assert np.array_equal(np.isfinite(ours), np.isfinite(theirs))
        assert np.abs(ours[hit] - theirs[hit]).max() < 1e-5
        assert hit.sum() > 10 * min(reach, 8)


def test_resting_bodies_share_one_mesh_scene(monkeypatch):
    """After a body moves, only its own scene and those of the remaining halves of its group are built."""
    built = list[int]()
    make = mesh_scene.MeshScene.__init__

    def counting_init(self, mesh, middle=None):
        make(self, mesh, middle)
        built.append(len(mesh.faces))

    scene, poses = RayScene(WALLS), dict(REST_POSES)
    monkeypatch.setattr(mesh_scene.MeshScene, "__init__", counting_init)
    scene.set_bodies(bodies_at(poses), REST_POSES)
    scene.sweep(FAN, LEVEL, math.inf)
    assert len(built) == 1
    for step in range(12):
        poses["body 07"] = Pose3(3.0 + 0.01 * step, 3.0)
        scene.set_bodies(bodies_at(poses), REST_POSES)
        scene.sweep(FAN, LEVEL, math.inf)
    assert len(built) <= 1 + 1 + math.ceil(math.log2(len(REST_POSES)))


def test_height_range_of_a_scene_does_not_change_the_ranges():
    """The height range is extended only a few times while the rays tilt more and more."""
    tilts = [*np.linspace(0.0, 0.6, 20).tolist(), 0.0, -0.6]
    lenses = [Pose3.from_rpy(0.4, 0.1, 0.8, 0.5 * tilt, tilt, 0.3) for tilt in tilts]
    scene, heights = RayScene(WALLS), set()
    scene.set_bodies(bodies_at(REST_POSES), REST_POSES)
    for lens in lenses:
        full_height = RayScene(WALLS)
        full_height.set_bodies(bodies_at(REST_POSES), REST_POSES)
        full_height.cast(*random_rays(), 1e6)  # extends the height range to the maximum
        assert np.array_equal(scene.sweep(FAN, lens, 9.0), full_height.sweep(FAN, lens, 9.0))
        heights.add(scene._heights)
    assert len(heights) < 8
