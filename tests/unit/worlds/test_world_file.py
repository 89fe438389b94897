"""Tests of worlds from world files."""

import math

import numpy as np
import pytest

from simscen.core.environment.occupancy_grid import OCCUPIED, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Solid
from simscen.model.world import WorldSpec
from simscen.worlds.world_file import world_from_spec


def spec(**parts):
    return WorldSpec.model_validate({"simscen": 1, **parts})


def test_walls_obstacles_and_objects_have_the_poses_of_the_file():
    world = world_from_spec(
        spec(
            walls=[{"points": [[0.0, 0.0], [5.0, 0.0]]}, {"name": "shelf", "points": [[0.0, 2.0], [5.0, 2.0]]}],
            obstacles=[
                {"name": "crate", "box": [1.0, 2.0, 0.5], "pose": {"x": 1.0, "y": 1.0, "yaw": "90 deg"}},
                {"name": "lamp", "cylinder": [0.2, 0.4], "z": 1.0, "pose": {"x": 3.0, "y": 1.0}},
            ],
            objects=[{"name": "cart", "box": [1.0, 0.5, 0.8], "pose": {"x": 2.0, "y": 1.0}, "mass": 20.0}],
            places={"dock": {"x": -1.0, "y": 0.5}},
            regions={"lane": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]},
        ),
        "depot",
    )
    assert world.name == "depot"
    assert [solid.name for solid in world.solids] == ["wall_1", "shelf", "crate", "lamp"]
    crate, lamp = world.solids[2:]
    assert crate.shape == Box((1.0, 2.0, 0.5))
    assert crate.pose.position == pytest.approx((1.0, 1.0, 0.25))
    assert crate.pose.yaw == pytest.approx(math.pi / 2)
    assert lamp == Solid(Cylinder(0.2, 0.4), Pose3(3.0, 1.0, 1.2), "lamp")
    assert world.bodies[0].mass == 20.0
    assert world.bodies[0].pose.plane == Pose2(2.0, 1.0, 0.0)
    assert world.places == {"dock": Pose2(-1.0, 0.5, 0.0)}
    assert world.regions == {"lane": ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))}
    assert world.bounds == pytest.approx((-1.0, -0.05, 5.0, 2.05))


def test_a_door_hangs_on_its_first_post_and_opens_by_a_quarter_turn():
    doors = [
        {"name": "shut", "points": [[1.0, 0.0], [1.0, 0.9]], "closed": True},
        {"name": "ajar", "points": [[1.0, 3.0], [1.0, 3.9]]},
    ]
    shut, ajar = world_from_spec(spec(doors=doors), "w").bodies
    panel = shut.pose.compose(shut.solids[0].pose)
    assert shut.solids[0].shape == Box((0.9, 0.05, 1.0))
    assert panel.position == pytest.approx((1.0, 0.45, 0.5))
    assert ajar.pose.plane == pytest.approx((1.0, 3.0, math.pi))


def test_moving_object_keeps_its_speed_and_start_time():
    move = {"through": [[4.0, 1.0], [4.0, 3.0]], "speed": 0.5, "repeat": "back_and_forth", "start": "2 s"}
    objects = [{"name": "cart", "box": [0.5, 0.5, 0.5], "pose": {"x": 2.0, "y": 1.0}, "move": move}]
    path = world_from_spec(spec(objects=objects), "w").bodies[0].path
    assert path.times == (0.0, 3.75, 4.0, 4.25, 8.0)
    assert (path.mode, path.start) == ("back_and_forth", 2.0)
    assert path.poses[-1] == pytest.approx((4.0, 3.0, math.pi / 2))


def test_map_of_a_world_is_kept_and_gives_its_walls():
    cells = np.zeros((20, 20), np.int8)
    cells[5, 5:15] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, Pose2(1.0, 1.0, 0.0))
    world = world_from_spec(spec(map="m.yaml", map_height=2.0), "w", grid=grid, notes=("m.pgm: a warning",))
    assert world.notes == ("m.pgm: a warning",)
    assert [solid.name for solid in world.solids] == ["map"]
    assert world.grid is grid
    assert world.bounds == pytest.approx((1.0, 1.0, 3.0, 3.0))


def test_additions_to_an_imported_world_take_precedence():
    base = World("gz", (Solid(Box((1, 1, 1)), name="theirs"),), places={"a": Pose2(0, 0), "b": Pose2(1, 1)})
    additions = spec(
        obstacles=[{"name": "ours", "box": [1.0, 1.0, 1.0], "pose": {"x": 3.0, "y": 0.0}}],
        places={"a": {"x": 5.0, "y": 5.0}},
    )
    world = world_from_spec(additions, "w", base=base)
    assert [solid.name for solid in world.solids] == ["theirs", "ours"]
    assert world.places == {"a": Pose2(5, 5), "b": Pose2(1, 1)}
