"""Tests of shortest paths against closed forms and a visibility graph."""

import itertools
import math

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Solid, Sphere
from simscen.core.messages.goals import Goal
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.routes.shortest_paths import ShortestPaths, legs_between

RADIUS_M = 0.25


def search_among(*solids, bounds=(-5, -5, 5, 5), radius=RADIUS_M, **options):
    return ShortestPaths(merge_solids(solids), bounds, radius, **options)


def box(x, y, width, depth, name=""):
    return Solid(Box((width, depth, 1.0)), Pose3(x, y, 0.5), name)


def around_circle(a, b, radius):
    """Return the length of the shortest path around a circle at the origin: two tangents and an arc."""
    da, db = math.hypot(*a), math.hypot(*b)
    between = math.acos((a[0] * b[0] + a[1] * b[1]) / (da * db))
    arc = between - math.acos(radius / da) - math.acos(radius / db)
    return math.sqrt(da**2 - radius**2) + math.sqrt(db**2 - radius**2) + radius * arc


def test_shortest_path_in_an_empty_world_is_straight():
    assert search_among().length(Pose2(-3, -2), Pose2(4, 1)) == pytest.approx(math.hypot(7, 3))


@pytest.mark.parametrize("radius", [0.1, 0.25, 0.5])
@pytest.mark.parametrize("goal", [(3.0, 0.2), (2.0, -1.0), (2.5, 0.5)])
def test_shortest_path_around_a_post_is_two_tangents_and_an_arc(radius, goal):
    paths = search_among(Solid(Cylinder(0.8, 1.0), Pose3(0, 0, 0.5)), radius=radius)
    expected = around_circle((-3.0, 0.1), goal, 0.8 + radius)
    straight = shapely.LineString([(-3.0, 0.1), goal]).distance(shapely.Point(0, 0))
    assert straight < 0.8 + radius, "the formula holds only if the straight line is blocked"
    assert paths.length(Pose2(-3.0, 0.1), Pose2(*goal)) == pytest.approx(expected, rel=0.005)


def test_shortest_path_around_a_wall_has_an_arc_about_the_corner():
    paths = search_among(box(0.0, -3.0, 0.2, 6.0))  # its upper end is at y = 0
    x, h = 2.0, -2.0
    to_corner = math.hypot(x - 0.1, h)
    # From (-2, -2) to a tangent point of the circle about (-0.1, 0), along the top, and down again.
    rise = math.acos(RADIUS_M / to_corner)
    slope = math.atan2(h, -(x - 0.1)) % (2 * math.pi)  # direction corner -> start
    arc = slope - rise - math.pi / 2
    expected = 2 * (math.sqrt(to_corner**2 - RADIUS_M**2) + RADIUS_M * arc) + 0.2
    assert paths.length(Pose2(-x, h), Pose2(x, h)) == pytest.approx(expected, rel=0.005)


def visibility_graph(polygons, a, b, radius):
    """Return the shortest length by brute force: Dijkstra over the mutually visible corners of inflated obstacles."""
    inflated = shapely.union_all([polygon.buffer(radius, quad_segs=16) for polygon in polygons])
    shrunk = inflated.buffer(-1e-6)
    parts = getattr(inflated, "geoms", [inflated])
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    points = [a, b, *itertools.chain.from_iterable(ring.coords[:-1] for ring in rings)]
    first, second = np.triu_indices(len(points), 1)
    coordinates = np.array(points)
    lines = shapely.linestrings(np.stack((coordinates[first], coordinates[second]), axis=1))
    shapely.prepare(shrunk)
    free = ~shapely.intersects(shrunk, lines)
    graph = np.zeros((len(points), len(points)))
    graph[first[free], second[free]] = shapely.length(lines[free])
    return dijkstra(graph, directed=False, indices=0)[1]


@pytest.mark.sample(4)
@pytest.mark.parametrize("seed", range(8))
def test_shortest_path_among_random_boxes_is_that_of_a_visibility_graph_within_one_percent(seed):
    rng = np.random.default_rng(seed)
    solids, polygons = [], []
    for _ in range(9):
        x, y = rng.uniform(-3, 3, 2)
        width, depth, yaw = rng.uniform(0.3, 2.0), rng.uniform(0.3, 2.0), rng.uniform(0, 3)
        corners = np.array([(-width, -depth), (width, -depth), (width, depth), (-width, depth)]) / 2
        polygons.append(shapely.Polygon(Pose2(x, y, yaw).apply(corners)))
        solids.append(Solid(Box((width, depth, 1.0)), Pose3.planar(Pose2(x, y, yaw), 0.5)))
    start, goal = (-4.5, -4.5), (4.5, 4.5)
    expected = visibility_graph(polygons, start, goal, RADIUS_M)
    assert search_among(*solids).length(Pose2(*start), Pose2(*goal)) == pytest.approx(expected, rel=0.01)


def test_shortest_path_keeps_the_radius_of_the_robot_from_obstacles():
    rng = np.random.default_rng(3)
    posts = [(x, y) for x, y in rng.uniform(-4, 4, (30, 2)).tolist() if abs(x) + abs(y) < 7]
    paths = search_among(*(Solid(Cylinder(0.2, 1.0), Pose3(x, y, 0.5)) for x, y in posts))
    path = shapely.LineString(paths.path(Pose2(-4.8, -4.8), Pose2(4.8, 4.8)))
    assert min(path.distance(shapely.Point(post)) for post in posts) > 0.2 + RADIUS_M - 0.01


def test_path_out_of_a_room_needs_a_door_that_is_wide_enough():
    def room(door):
        walls = [box(0, -2, 4.2, 0.1), box(-2.05, 0, 0.1, 4.0), box(2.05, 0, 0.1, 4.0)]
        half = (4.2 - door) / 2
        return [*walls, box(-2.1 + half / 2, 2, half, 0.1), box(2.1 - half / 2, 2, half, 0.1)]

    inside, outside = Pose2(0, 0), Pose2(0, 4)
    assert search_among(*room(0.0)).length(inside, outside) == math.inf
    assert search_among(*room(2 * RADIUS_M - 0.03)).length(inside, Pose2(1, 4)) == math.inf
    assert search_among(*room(2 * RADIUS_M + 0.10)).length(inside, Pose2(1, 4)) == pytest.approx(4.19, abs=0.06)


def test_no_path_leads_to_a_goal_where_the_disc_does_not_fit():
    paths = search_among(box(0, 0, 1, 1))
    assert paths.length(Pose2(-3, 0), Pose2(0, 0)) == math.inf
    assert paths.length(Pose2(-3, 0), Pose2(0.6, 0)) == math.inf
    assert paths.length(Pose2(-3, 0), Pose2(-0.5 - RADIUS_M - 0.001, 0)) == pytest.approx(2.25, abs=0.01)


def test_only_solids_at_the_height_of_the_robot_block_the_path():
    carpet, lamp = Solid(Box((2, 9, 0.02)), Pose3(0, 0, 0.01)), Solid(Box((2, 9, 1.0)), Pose3(0, 0, 2.0))
    assert search_among(carpet, lamp).length(Pose2(-3, 0), Pose2(3, 0)) == 6.0
    ball = search_among(Solid(Sphere(0.4), Pose3(0, 0, 0.4)))
    expected = around_circle((-3, 0), (3, 0), 0.4 + RADIUS_M)
    assert ball.length(Pose2(-3, 0), Pose2(3, 0)) == pytest.approx(expected, rel=0.005)


def test_a_point_cannot_pass_through_a_sheet():
    wall = [box(0, 0, 0.01, 20.0)]
    assert search_among(*wall, radius=0.0).length(Pose2(-1, 0), Pose2(1, 0)) > 20.0


def test_lengths_are_given_for_each_leg_even_outside_the_bounds():
    built = build_world_and_map(World("w", (Solid(Extrusion(((0, 0), (1, 0), (1, 1)), 1.0)),)), 0.2)
    stops = [Pose2(-3, 3), Pose2(-3, 8), Pose2(6, 8), Pose2(0.7, 0.3)]
    legs = legs_between(built, [(start, Goal("g", goal)) for start, goal in itertools.pairwise(stops)], RADIUS_M)
    assert [leg.length for leg in legs] == pytest.approx([5.0, 9.0, math.inf])


def test_the_path_through_sixty_walls_is_little_longer_than_the_straight_line():
    rng = np.random.default_rng(1)
    walls = [box(x, y, *((3.0, 0.1) if k % 2 else (0.1, 3.0))) for k, (x, y) in enumerate(rng.uniform(-9, 9, (60, 2)))]
    found = search_among(*walls, bounds=(-10, -10, 10, 10)).length(Pose2(-9.7, -9.7), Pose2(9.7, 9.7))
    assert 27 < found < 35
