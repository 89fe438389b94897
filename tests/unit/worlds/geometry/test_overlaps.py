"""Tests of the search for a solid that overlaps a disc at the height of the robot."""

import subprocess
import sys

import numpy as np

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Solid
from simscen.worlds.geometry import overlaps
from simscen.worlds.geometry.overlaps import first_solid_in_disc

BODY = (0.05, 0.4)


def test_solid_at_or_near_a_point_is_named():
    solids = Solid(Box((1, 1, 1)), Pose3(0, 0, 0.5), "crate"), Solid(Cylinder(0.5, 1.0), Pose3(3, 0, 0.5), "post")
    assert first_solid_in_disc(solids, (0.1, 0.2), 0.0001, BODY) == "crate"
    assert first_solid_in_disc(solids, (0.7, 0.0), 0.21, BODY) == "crate"
    assert first_solid_in_disc(solids, (0.7, 0.0), 0.19, BODY) is None
    assert first_solid_in_disc(solids, (3.0, 0.65), 0.16, BODY) == "post"
    assert first_solid_in_disc(solids, (3.0, 0.65), 0.14, BODY) is None


def test_only_solids_at_the_height_of_the_robot_count():
    table = Solid(Box((2, 2, 0.05)), Pose3(0, 0, 0.75), "table")
    carpet = Solid(Box((2, 2, 0.01)), Pose3(0, 0, 0.005), "carpet")
    assert first_solid_in_disc((table, carpet), (0, 0), 0.2, BODY) is None
    assert first_solid_in_disc((table, carpet), (0, 0), 0.2, (0.05, 0.8)) == "table"


def test_distances_are_computed_only_to_solids_nearby(monkeypatch):
    rng = np.random.default_rng(0)
    posts = [
        Solid(Cylinder(0.1, 1.0), Pose3(x, y, 0.5), f"p{k}") for k, (x, y) in enumerate(rng.uniform(-30, 30, (3000, 2)))
    ]
    real, near = overlaps._horizontal_distance, []
    monkeypatch.setattr(overlaps, "_horizontal_distance", lambda solid, *args: near.append(solid) or real(solid, *args))
    assert first_solid_in_disc(posts, (posts[-1].pose.x, posts[-1].pose.y), 0.01, BODY) == "p2999"
    assert posts[-1] in near
    assert len(near) < 10


def test_overlap_check_imports_no_heavy_library():
    code = (
        "import sys; from simscen.worlds.geometry.overlaps import first_solid_in_disc;"
        "from simscen.core.geometry.shapes import Box, Solid, Extrusion;"
        "w = (Solid(Box((1, 1, 1)), name='b'), Solid(Extrusion(((0, 0), (1, 0), (0, 1)), 1.0)));"
        "assert first_solid_in_disc(w, (5, 5), 0.1, (0, 1)) is None;"
        "assert first_solid_in_disc(w, (0, 0), 0.1, (0, 1)) == 'b';"
        "print({'scipy', 'trimesh', 'embreex', 'PIL', 'pybullet'} & set(sys.modules))"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "set()"
