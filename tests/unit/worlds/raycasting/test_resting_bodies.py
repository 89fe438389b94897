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
CHANCE = np.random.default_rng(21)
HOMES = {f"thing {k:02}": Pose3.planar(Pose2(*CHANCE.uniform((-9, -9, -3), (9, 9, 3)))) for k in range(30)}
LEVEL, NODDING = Pose3(0.5, 0.2, 0.18), Pose3.from_rpy(0.4, 0.1, 0.5, 0.05, -0.3, 1.0)
FAN = RayFan(-math.pi, math.pi / 90, 180)


def placed(poses):
    return {name: (CRATE if int(name[6:]) % 3 else STOOL, pose) for name, pose in poses.items()}


def scattered():
    directions = np.random.default_rng(5).normal(size=(400, 3))
    origins = np.random.default_rng(6).uniform((-9, -9, 0.05), (9, 9, 0.8), (400, 3))
    return origins, directions / np.linalg.norm(directions, axis=1)[:, None]


def seen(scene, reach=9.0):
    """What a level fan, one that nods, and rays from anywhere meet."""
    swept = [scene.sweep(FAN, lens, reach) for lens in (LEVEL, NODDING)]
    return np.concatenate([*(np.where(ends > reach, np.inf, ends) for ends in swept), scene.cast(*scattered(), reach)])


def changes():
    """Where things are, time and again: most at home, and more and more elsewhere; some have gone, or have come."""
    poses = dict(HOMES)
    yield dict(poses)
    for number, (name, home) in enumerate(HOMES.items()):
        if number % 4 == 1:
            poses[name] = home._replace(x=home.x + 1e-6 * number, y=home.y + 0.1)
        elif number % 4 == 2:
            del poses[name]
        elif number == 12:
            poses = dict(HOMES)  # all are back
        yield dict(poses)


@pytest.mark.parametrize(("many", "several"), [(ray_scene.MAX_GROUP_TRIANGLES, ray_scene.MAX_GROUPS), (60, 3)])
def test_order_of_bodies_does_not_change_the_result(monkeypatch, many, several):
    """A scene that has seen all of it says what one says that sees it for the first time, or heard of less before."""
    monkeypatch.setattr(ray_scene, "MAX_GROUP_TRIANGLES", many)
    monkeypatch.setattr(ray_scene, "MAX_GROUPS", several)
    old = RayScene(WALLS)
    for number, poses in enumerate(list(changes())[::2]):
        fresh = RayScene(WALLS)
        if number % 3:
            old.set_bodies(placed(poses), HOMES)
        if number % 5 == 0:
            fresh.set_bodies(placed({name: HOMES[name] for name in list(HOMES)[::2]}), HOMES)
            fresh.sweep(FAN, LEVEL, 5.0)
        old.set_bodies(placed(poses), HOMES)
        fresh.set_bodies(placed(poses), HOMES)
        assert np.array_equal(seen(old), seen(fresh))


@pytest.mark.parametrize("reach", [2.5, 9.0, math.inf])
def test_merged_resting_bodies_give_the_ranges_of_separate_bodies(reach):
    together, alone = RayScene(WALLS), RayScene(WALLS)
    for poses in list(changes())[::6]:
        together.set_bodies(placed(poses), HOMES)
        alone.set_bodies(placed(poses))
        ours, theirs = seen(together, reach), seen(alone, reach)
        met = np.isfinite(ours) & np.isfinite(theirs)
        assert np.array_equal(np.isfinite(ours), np.isfinite(theirs))
        assert np.abs(ours[met] - theirs[met]).max() < 1e-5
        assert met.sum() > 10 * min(reach, 8)


def test_resting_bodies_share_one_mesh_scene(monkeypatch):
    """One is for all; then those of the halves that are left of it, and of who went."""
    built = list[int]()
    make = mesh_scene.MeshScene.__init__

    def counted(part, mesh, middle=None):
        make(part, mesh, middle)
        built.append(len(mesh.faces))

    scene, poses = RayScene(WALLS), dict(HOMES)
    monkeypatch.setattr(mesh_scene.MeshScene, "__init__", counted)
    scene.set_bodies(placed(poses), HOMES)
    scene.sweep(FAN, LEVEL, math.inf)
    assert len(built) == 1
    for step in range(12):
        poses["thing 07"] = Pose3(3.0 + 0.01 * step, 3.0)
        scene.set_bodies(placed(poses), HOMES)
        scene.sweep(FAN, LEVEL, math.inf)
    assert len(built) <= 1 + 1 + math.ceil(math.log2(len(HOMES)))


def test_height_range_of_a_scene_does_not_change_the_ranges():
    """Rays that tilt ever more have what they may meet taken anew, and only so often."""
    tilts = [*np.linspace(0.0, 0.6, 20).tolist(), 0.0, -0.6]
    lenses = [Pose3.from_rpy(0.4, 0.1, 0.8, 0.5 * tilt, tilt, 0.3) for tilt in tilts]
    scene, taken = RayScene(WALLS), set()
    scene.set_bodies(placed(HOMES), HOMES)
    for lens in lenses:
        whole = RayScene(WALLS)
        whole.set_bodies(placed(HOMES), HOMES)
        whole.cast(*scattered(), 1e6)  # whose rays go up and down as far as that
        assert np.array_equal(scene.sweep(FAN, lens, 9.0), whole.sweep(FAN, lens, 9.0))
        taken.add(scene._heights)
    assert len(taken) < 8
