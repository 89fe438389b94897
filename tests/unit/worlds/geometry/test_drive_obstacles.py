"""Tests of obstacles for a robot that climbs ramps."""

import math

import pytest

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Mesh, Solid
from simscen.worlds.geometry.drive_obstacles import drive_obstacles
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.routes.shortest_paths import ShortestPaths
from simscen.worlds.world_file import ramp_solid

TURTLEBOT = 0.033, math.radians(7.9), 0.0097
BOUNDS = (-1.0, -4.0, 8.0, 4.0)


def box(name, x, y, length, width, height):
    return Solid(Box((length, width, height)), Pose3(x, y, height / 2), name)


def hall(degrees):
    """Return a hall divided by a platform that has a ramp on each side."""
    height = math.tan(math.radians(degrees))
    return (
        ramp_solid((2, 0), (3, 0), 1.5, height, "up"),
        box("platform", 3.5, 0, 1.0, 7.8, height),
        ramp_solid((5, 0), (4, 0), 1.5, height, "down"),
        box("north", 3.5, 4, 9.2, 0.2, 1.0),
        box("south", 3.5, -4, 9.2, 0.2, 1.0),
        box("west", -1, 0, 0.2, 8, 1.0),
        box("east", 8, 0, 0.2, 8, 1.0),
    )


def path_length(degrees, robot=TURTLEBOT):
    mesh = merge_solids(drive_obstacles(hall(degrees), *robot))
    return ShortestPaths(mesh, BOUNDS, 0.22).length(Pose2(1, 3, 0), Pose2(6, 3, 0))


def test_world_without_ramps_is_returned_unchanged():
    solids = (box("wall", 1, 0, 0.1, 4, 1.0),)
    assert drive_obstacles(solids, *TURTLEBOT) is solids


def test_shortest_path_leads_over_a_climbable_ramp_but_not_over_its_sides():
    # The path goes around the sides of the ramps, which are higher than a step except for their first 30 cm.
    assert 7.0 < path_length(5) < 8.5


def test_no_path_leads_over_a_ramp_that_the_robot_cannot_climb():
    assert path_length(30) == math.inf
    assert path_length(5, (0.1, 0.0, 0.0)) == math.inf


def test_ramp_and_platform_join_without_a_wall_between_them():
    names = [s.name for s in drive_obstacles(hall(5), *TURTLEBOT) if s.name in ("up", "down", "platform")]
    assert names.count("platform") == 4 + 2  # four pieces next to the ramps, two at the walls
    assert names.count("up") == names.count("down") == pytest.approx(18, abs=2)


def test_concave_solid_with_a_low_part_is_an_obstacle_as_a_whole():
    """The forks, 3 cm high, could be driven over, but the mast above them could not."""
    forks, mast = (box("jack", x, 0, length, 0.5, height) for x, length, height in ((0.5, 1.0, 0.03), (1.1, 0.2, 1.2)))
    jack = merge_solids([forks, mast])
    solids = (Solid(Mesh(jack.vertices, jack.faces), Pose3(), "jack"),)
    assert drive_obstacles(solids, *TURTLEBOT) is solids
