import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from simscen.core.geometry import Pose2, Pose3
from simscen.core.grid import OCCUPIED
from simscen.core.shapes import Body, Box, Cone, Cylinder, Extrusion, Solid
from simscen.core.world import World
from simscen.model.world import WorldSpec
from simscen.worlds.build import build
from simscen.worlds.convert import world_yaml
from simscen.worlds.meshing import fuse
from simscen.worlds.own import build_own
from simscen.worlds.rays import RayScene
from simscen.worlds.sdf import load_sdf

DATA = Path(__file__).parents[3].parent / "shared" / "data"


def read(text):
    return build_own(WorldSpec.model_validate(yaml.safe_load(text)), "again")


def test_what_the_language_can_say_comes_back_exactly():
    original = World(
        "a: depot",
        (
            Solid(Box((1.0, 2.0, 0.5)), Pose3.from_rpy(1, 2, 0.25, 0, 0, 0.5), "crate"),
            Solid(Cylinder(0.2, 0.5), Pose3(3, 0, 1.25), "lamp"),
            Solid(Extrusion(((0, 0), (1, 0), (0, 1)), 0.8), Pose3.planar(Pose2(-2, 0, 1.0)), "wedge"),
        ),
        bodies=(Body("cart", (Solid(Box((1, 1, 1)), Pose3(z=0.5), "cart"),), Pose3(4, 4, 0), 20.0),),
        places={"dock": Pose2(1, 1, math.pi / 2)},
        regions={"lane": ((0, 0), (1, 0), (1, 1))},
    )
    text, notes = world_yaml(original, 0.2)
    again = read(text)
    assert notes == ()
    assert again.name == "a: depot"
    for ours, theirs in zip(again.solids, original.solids, strict=True):
        assert (ours.name, ours.shape) == (theirs.name, theirs.shape)
        assert ours.pose == pytest.approx(theirs.pose, abs=1e-6)
    (cart,) = again.bodies
    assert (cart.mass, cart.pose.plane) == (20.0, Pose2(4, 4, 0))
    assert again.places["dock"] == pytest.approx(Pose2(1, 1, math.pi / 2), abs=1e-6)
    assert again.regions == original.regions


def test_an_own_world_converts_to_itself():
    spec = {
        "simscen": 1,
        "walls": [{"points": [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]}],
        "doors": [{"name": "d", "points": [[1.0, 1.0], [1.0, 2.0]], "closed": True}],
    }
    first = build_own(WorldSpec.model_validate(spec), "w")
    again = read(world_yaml(first, 0.2)[0])
    assert np.array_equal(build(first, 0.2).map.cells, build(again, 0.2).map.cells)
    assert again.bodies == first.bodies
    assert again.doors == first.doors


def test_a_box_sunk_into_the_ground_is_written_from_the_ground_up():
    text, _ = world_yaml(World("w", (Solid(Box((1, 1, 1)), Pose3(z=0.2), "b"),)), 0.2)
    (box,) = read(text).solids
    assert box.shape == Box((1, 1, 0.7))
    assert box.pose.z == pytest.approx(0.35)


def test_what_has_no_word_becomes_thin_walls_and_is_told():
    cone = Solid(Cone(1.0, 2.0), Pose3(0, 0, 1.0), "cone")
    high = Solid(Cone(1.0, 1.0), Pose3(5, 5, 3.0), "hat")
    text, notes = world_yaml(World("w", (cone, high)), 0.5)
    assert [note.split(":")[0] for note in notes] == ["cone", "hat"]
    grid = build(read(text), 0.5).map
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    radii = np.linalg.norm(grid.centre_of(np.column_stack((rows, columns))), axis=1)
    assert radii.min() > 0.70
    assert radii.max() < 0.80


@pytest.mark.skipif(not DATA.is_dir(), reason=f"needs {DATA.name}, which is not part of the project")
def test_a_gazebo_warehouse_converted_shows_the_lidar_the_same_walls():
    home = DATA / "aws_small_warehouse"
    world = load_sdf(home / "worlds" / "small_warehouse.world", root=DATA, search=[home / "models"], lenient=True)
    again = read(world_yaml(world, 0.2)[0])
    free = np.argwhere(build(world, 0.2).map.cells == 0)
    rng = np.random.default_rng(0)
    places = build(world, 0.2).map.centre_of(free[rng.choice(len(free), 3000)])
    angles = rng.uniform(0, 2 * math.pi, 3000)
    origins = np.column_stack((places, np.full(3000, 0.2)))
    directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(3000)))
    ours = RayScene(fuse(again.solids)).cast(origins, directions)
    theirs = RayScene(fuse(world.solids)).cast(origins, directions)
    assert (np.abs(ours - theirs) < 0.03).mean() > 0.97
