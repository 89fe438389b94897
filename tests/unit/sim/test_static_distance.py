"""Tests of the distance between a robot and the static world."""

import math
from dataclasses import replace

import numpy as np
import pybullet
import pytest
import shapely
import trimesh
from simulation_helpers import box, robot_spec

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Mesh, Solid
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.bullet.collision_shapes import create_hull_of_solids, split_into_tiles
from simscen.sim.bullet.engine import create_static_body
from simscen.sim.contact.static_distance import StaticDistance, max_displacement
from simscen.sim.contact.triangles import encloses, encloses_along_line, point_to_triangles
from simscen.worlds.geometry.triangulation import merge_solids


def test_distances_to_triangles_equal_those_of_trimesh():
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(300, 3, 3))
    point = rng.normal(size=3)
    closest = trimesh.triangles.closest_point(corners, np.tile(point, (300, 1)))
    assert point_to_triangles(point, corners) == pytest.approx(np.linalg.norm(closest - point, axis=1))


def test_distance_to_a_triangle_without_area_is_that_to_its_edges():
    flat = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]])
    assert point_to_triangles(np.array([1.5, 2.0, 0.0]), flat) == pytest.approx([2.0])


def test_max_displacement_is_a_tight_upper_bound():
    rng, extent = np.random.default_rng(5), 0.4
    points = rng.normal(size=(400, 3))
    points *= extent / np.linalg.norm(points, axis=1, keepdims=True)
    for turn in (0.0, 1e-3, 0.1, 1.0, 3.0):
        for flip in (1.0, -1.0):  # a quaternion and its opposite are the same heading
            before = Pose3.from_rpy(*rng.normal(size=3), *rng.uniform(-1, 1, 3))
            step = Pose3.from_rpy(*rng.normal(0.0, 0.1, 3), 0.0, turn, 0.0)
            after = before.compose(step)
            signed = Pose3(*after.position, *(flip * part for part in after.quaternion))
            displacements = np.linalg.norm(after.apply(points) - before.apply(points), axis=1)
            assert displacements.max() <= max_displacement(before, signed, extent) + 1e-12
            if flip > 0:
                farthest = math.dist(before.position, after.position) + 2 * extent * math.sin(turn / 2)
                assert max_displacement(before, signed, extent) <= 1.5 * farthest


@pytest.fixture
def static_distance():
    solids = [
        box("shelf", 0, 0, 2, 2),
        Solid(Cylinder(0.3, 1), Pose3(3, 0, 0.5), "post"),
        Solid(Extrusion(((0, 0), (2, 0), (2, 0.2), (0.2, 0.2), (0.2, 2), (0, 2)), 1.0), Pose3(5, 5), "corner"),
        Solid(Box((20, 20, 0.1)), Pose3(z=-0.05), "floor"),
    ]
    query = StaticDistance(merge_solids(solids), build_robot_body(robot_spec("turtlebot")), 2.0)
    yield query
    query.close()


def test_nearest_solid_name_is_that_of_the_nearest_surface(static_distance):
    assert static_distance.nearest_solid_name((1.01, 0.5, 0.2)) == "shelf"
    assert static_distance.nearest_solid_name((2.71, 0.0, 0.2)) == "post"
    assert static_distance.nearest_solid_name((50.0, 0.0, 0.2)) == ""


def test_distance_is_to_the_nearest_solid_except_the_floor(static_distance):
    assert static_distance.distance(Pose3(1.9, 0.0)) == pytest.approx(0.8 - 0.22, abs=1e-3)
    assert static_distance.distance(Pose3(1.5, 0.0)) == pytest.approx(0.5 - 0.22, abs=1e-3)
    assert static_distance.distance(Pose3(-9.0, -9.0)) == math.inf


def test_concave_solid_is_not_replaced_by_its_convex_hull(static_distance):
    assert static_distance.distance(Pose3(6.0, 6.0)) == pytest.approx(0.8 - 0.22, abs=1e-3)


def test_distance_does_not_depend_on_earlier_queries(static_distance):
    first = static_distance.distance(Pose3(1.9, 0.3))
    for x in range(10):
        static_distance.distance(Pose3(x, x / 2))
    assert static_distance.distance(Pose3(1.9, 0.3)) == first


def drum_robot(radius, height):
    """Return a robot whose hull is an upright cylinder."""
    return replace(
        build_robot_body(robot_spec("turtlebot")),
        casters=(),
        hull=(Solid(Cylinder(radius, height), Pose3(z=height / 2)),),
    )


def test_distances_along_a_path_among_many_solids_equal_those_of_shapely():
    rng = np.random.default_rng(11)
    corner = Extrusion(((0, 0), (1, 0), (1, 0.2), (0.2, 0.2), (0.2, 1), (0, 1)), 1.0)
    kinds = (Box((0.6, 0.4, 1.0)), Cylinder(0.3, 1.0), corner)
    places = [Pose3.from_rpy(x, y, 0.5, 0.0, 0.0, yaw) for x, y, yaw in rng.uniform((0, 0, -3), (24, 24, 3), (160, 3))]
    mesh = merge_solids([Solid(kinds[k % 3], pose, str(k)) for k, pose in enumerate(places)])
    corners = mesh.vertices[mesh.faces]
    floor_plan = shapely.union_all(shapely.polygons(corners[np.ptp(corners[:, :, 2], axis=1) == 0][:, :, :2]))
    poses = [Pose3(2.0, 2.0)]
    for turn in rng.normal(0.0, 0.15, 800).tolist():
        next_pose = poses[-1].compose(Pose3.from_rpy(0.06, 0.0, 0.0, 0.0, 0.0, turn))
        poses.append(next_pose if 0 < next_pose.x < 24 and 0 < next_pose.y < 24 else Pose3(*rng.uniform(0, 24, 2)))
    expected = floor_plan.distance(shapely.points([pose[:2] for pose in poses])) - 0.25
    expected[expected > 1.0] = math.inf
    query = StaticDistance(mesh, drum_robot(0.25, 1.2), 1.0)
    measured = np.array([query.distance(pose) for pose in poses])
    query.close()
    outside = expected > 0
    assert outside.sum() > 500
    assert np.isinf(expected).sum() > 100
    assert measured[outside] == pytest.approx(expected[outside], abs=1e-4)
    assert (measured[~outside] <= 0).all()


def test_distance_is_correct_while_the_nearest_solid_alternates():
    query = StaticDistance(
        merge_solids([box("left", 0, 0.9, 1, 1), box("right", 0, -0.9, 1, 1)]), drum_robot(0.2, 0.4), 2.0
    )
    for k in range(20):
        y = 0.05 * (-1) ** (k // 2)
        assert query.distance(Pose3(0.01 * k - 0.1, y)) == pytest.approx(0.15, abs=1e-6)
    query.close()


def test_distance_beyond_the_range_is_infinite():
    query = StaticDistance(merge_solids([box("ahead", 2.0, 0, 1, 1)]), drum_robot(0.2, 0.4), 1.0)
    assert query.distance(Pose3(0.2995)) == math.inf
    assert query.distance(Pose3(0.3005)) == pytest.approx(0.9995, abs=1e-6)
    assert query.distance(Pose3(0.2995)) == math.inf
    query.close()


def test_distance_of_a_tilted_robot_is_measured_from_its_top():
    query = StaticDistance(
        merge_solids([box("ahead", 1.5, 0, 1, 4, 4), box("behind", -1.15, 0, 1, 4, 4)]), drum_robot(0.2, 1.5), 2.0
    )
    overhang = 1.5 * math.sin(0.3) + 0.2 * math.cos(0.3)
    assert query.distance(Pose3.from_rpy(0.0, 0.0, 0.0, 0.0, 0.3, 0.0)) == pytest.approx(1.0 - overhang, abs=1e-3)
    query.close()


def test_distant_solids_are_built_only_when_needed():
    rows = [box(f"{y} {k}", 1.0 * k, y, 1.1, 0.4) for y in (-0.8, 0.8, -1.4, 1.4) for k in range(30)]
    query = StaticDistance(merge_solids(rows), drum_robot(0.2, 0.4), 2.0)
    for k in range(200):
        assert query.distance(Pose3(0.1 * k)) == pytest.approx(0.4, abs=1e-6)
    assert 20 <= len(query._shape_pairs) <= 44
    query.close()


def wall_of_many_triangles(columns, rows):
    """Return the plane x = 5 from y = -10 to 10, up to 2 m, without vertices shared by triangles."""
    y, z = np.meshgrid(np.linspace(-10, 10, columns + 1), np.linspace(0, 2, rows + 1), indexing="ij")
    grid = np.stack((np.full_like(y, 5.0), y, z), axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    corners = np.stack((np.stack((a, b, c), axis=-2), np.stack((a, c, d), axis=-2))).reshape(-1, 3)
    return Mesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


@pytest.mark.slow
def test_distance_to_a_solid_with_more_triangles_than_bullet_supports():
    wall = wall_of_many_triangles(400, 60)
    assert len(wall.faces) == 48_000
    query = StaticDistance(merge_solids([Solid(wall, Pose3(), "wall")]), build_robot_body(robot_spec("turtlebot")), 2.0)
    for y in (-9.0, -3.3, 0.0, 9.5):
        assert query.distance(Pose3(4.0, y)) == pytest.approx(1.0 - 0.22, abs=1e-3)
    query.close()


def test_every_face_is_in_one_tile():
    wall = wall_of_many_triangles(400, 60)
    found = np.concatenate(split_into_tiles(wall.vertices, wall.faces))
    assert sorted(map(tuple, found.tolist())) == sorted(map(tuple, wall.faces.tolist()))
    assert [len(tile) for tile in split_into_tiles(wall.vertices, wall.faces)] == [40_000, 8_000]


def test_hull_of_more_points_than_bullet_supports_keeps_its_bounds():
    points = np.random.default_rng(4).uniform(-0.2, 0.2, size=(150_000, 3))
    query = StaticDistance(merge_solids([]), build_robot_body(robot_spec("turtlebot")), 2.0)
    shape = create_hull_of_solids(query._client, [Solid(Mesh(points, np.empty((0, 3), np.int32)), Pose3(), "cloud")])
    low, high = pybullet.getAABB(create_static_body(query._client, shape), physicsClientId=query._client)
    assert low == pytest.approx(points.min(axis=0), abs=0.05)
    assert high == pytest.approx(points.max(axis=0), abs=0.05)
    query.close()


def test_only_the_part_of_a_large_solid_near_the_robot_is_built():
    wall = wall_of_many_triangles(400, 60)
    query = StaticDistance(merge_solids([Solid(wall, Pose3(), "wall")]), build_robot_body(robot_spec("turtlebot")), 2.0)
    assert query.distance(Pose3(4.0, 0.0)) == pytest.approx(1.0 - 0.22, abs=1e-3)
    assert sum(len(query._parts.faces(part)) for part in query._shape_pairs) < 0.5 * len(wall.faces)
    assert query.nearest_solid_name((5.0, 1.0, 0.5)) == "wall"
    assert query.enclosing_solids((4.0, 0.0, 0.5)) == []


def block_of_many_triangles():
    """Return a closed box of 12 x 12 x 2 m, centered on the origin, with some thousand triangles."""
    box = trimesh.creation.box((12.0, 12.0, 2.0)).subdivide().subdivide().subdivide().subdivide()
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32))


def test_point_inside_a_solid_of_many_tiles_is_enclosed():
    query = StaticDistance(
        merge_solids([Solid(block_of_many_triangles(), Pose3(z=1.0), "block"), box("shelf", 20, 0, 2, 2)]),
        build_robot_body(robot_spec("turtlebot")),
        2.0,
    )
    assert [query.name(k) for k in query.enclosing_solids((1.0, 1.0, 0.5))] == ["block"]
    assert [query.name(k) for k in query.enclosing_solids((20.0, 0.0, 0.5))] == ["shelf"]
    assert query.distance(Pose3(6.5, 0.0)) == pytest.approx(0.5 - 0.22, abs=1e-3)
    assert not query.is_convex(0)
    assert query.is_convex(1)


def test_enclosure_along_a_line_equals_that_of_trimesh():
    """The result is None if the line meets a corner or passes through a hole."""
    rng = np.random.default_rng(8)
    block, ring = trimesh.creation.box((2.0, 2.0, 2.0)).subdivide(), trimesh.creation.annulus(0.5, 1.5, 3.0)
    combined = trimesh.util.concatenate([block, ring.apply_translation((1.0, 0.4, 0.3))])
    places = rng.uniform(-2.5, 2.5, (300, 3))
    inside = block.contains(places) | ring.contains(places)
    found = [encloses_along_line(combined.triangles, tuple(place)) for place in places.tolist()]
    assert 20 < inside.sum() < 280
    assert found == inside.tolist()
    assert encloses_along_line(block.triangles, (1.0, 1.0, 1.0)) is None  # a corner
    lidless = block.triangles[block.triangles[:, :, 2].min(axis=1) < 0.99]
    assert encloses_along_line(lidless, (0.1, 0.2, 0.0)) is None
    assert encloses(lidless, (0.1, 0.2, 0.0))
