"""Tests of occupancy maps of worlds, and of walls that are built from maps."""

import math

import numpy as np
import pytest
import shapely
import trimesh

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, Mesh, Solid
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.maps.occupancy_map import draw_map, occupied_cells, walls_from_map
from simscen.worlds.world_file import wall_solids

ROOM = (
    Solid(Box((4.2, 0.1, 1.0)), Pose3(2, -0.05, 0.5), "south"),
    Solid(Box((4.2, 0.1, 1.0)), Pose3(2, 3.05, 0.5), "north"),
    Solid(Box((0.1, 3.0, 1.0)), Pose3(-0.05, 1.5, 0.5), "west"),
    Solid(Box((0.1, 3.0, 1.0)), Pose3(4.05, 1.5, 0.5), "east"),
)


def grid_of(*solids, height=0.3, resolution=0.05, **world):
    return draw_map(World("w", solids, **world), merge_solids(solids), height, resolution)


def cells_by_shapely(grid, polygon):
    """Return the cells whose interior overlaps the interior of the polygon."""
    x = grid.origin.x + np.arange(grid.shape[1]) * grid.resolution
    y = grid.origin.y + np.arange(grid.shape[0]) * grid.resolution
    xs, ys = np.meshgrid(x, y)
    epsilon = 1e-6
    squares = shapely.box(xs + epsilon, ys + epsilon, xs + grid.resolution - epsilon, ys + grid.resolution - epsilon)
    return shapely.intersects(squares, polygon)


@pytest.mark.parametrize("seed", range(6))
def test_a_cell_is_occupied_exactly_if_a_solid_is_in_it(seed):
    rng = np.random.default_rng(seed)
    solids, polygons = [], []
    for _ in range(8):
        x, y, yaw = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3)
        angles = np.sort(rng.uniform(0, 2 * math.pi, 7))
        radii = rng.uniform(0.02, 1.0, 7)
        corners = np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
        polygon = shapely.Polygon(corners)
        if not polygon.is_valid or not polygon.exterior.is_ccw:
            continue
        solids.append(Solid(Extrusion(tuple(map(tuple, corners.tolist())), 1.0), Pose3.planar(Pose2(x, y, yaw))))
        polygons.append(shapely.Polygon(Pose2(x, y, yaw).apply(corners)))
    grid = grid_of(*solids)
    expected = cells_by_shapely(grid, shapely.union_all(polygons))
    assert ((grid.cells == OCCUPIED) != expected).sum() == 0


def test_walls_on_cell_edges_fill_only_their_own_cells():
    grid = grid_of(Solid(Box((0.2, 0.1, 1.0)), Pose3(1.1, 2.05, 0.5)))
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    centers = grid.center_of(np.column_stack((rows, columns)))
    assert len(centers) == 8
    assert centers.min(axis=0) == pytest.approx([1.025, 2.025])
    assert centers.max(axis=0) == pytest.approx([1.175, 2.075])


def test_a_wall_thinner_than_a_cell_is_not_lost():
    grid = grid_of(Solid(Box((0.01, 2.0, 1.0)), Pose3(0.02, 0, 0.5)))
    assert (grid.cells == OCCUPIED).sum() == 40


def test_solids_above_or_below_the_lidar_are_not_on_the_map():
    solids = Solid(Box((1, 1, 0.1)), Pose3(0, 0, 0.05)), Solid(Box((1, 1, 0.1)), Pose3(3, 0, 2.0))
    assert not (grid_of(*solids).cells == OCCUPIED).any()


def test_cells_outside_of_a_closed_building_are_unknown():
    grid = grid_of(*ROOM)
    inside, outside = grid.values_at(np.array([[2.0, 1.5], [-0.5, -0.5]])).tolist()
    assert (inside, outside) == (FREE, UNKNOWN)


def test_outside_is_free_if_it_has_a_place_or_a_door_is_open():
    yard = grid_of(*ROOM, places={"yard": Pose2(4.5, 1.0, 0.0)}, bounds=(0, 0, 5, 3))
    open_door = grid_of(*ROOM[:3])
    for grid in (yard, open_door):
        assert not (grid.cells == UNKNOWN).any()


@pytest.mark.parametrize("yaw", [0.0, 0.4, math.pi / 4])
def test_outside_of_an_l_shaped_or_rotated_building_is_unknown(yaw):
    outline = [(0, 0), (6, 0), (6, 2), (2, 2), (2, 6), (0, 6), (0, 0)]
    corners = Pose2(0, 0, yaw).apply(np.array(outline, dtype=float)).tolist()
    grid = grid_of(*wall_solids([(x, y) for x, y in corners], 0.1, 1.0, "w"))
    inside, outside, corner = grid.values_at(Pose2(0, 0, yaw).apply(np.array([[1, 1], [-0.5, 3], [4, 4]]))).tolist()
    assert (inside, outside, corner) == (FREE, UNKNOWN, UNKNOWN)


def test_field_of_posts_has_no_unknown_cells():
    posts = [Solid(Cylinder(0.2, 1.0), Pose3(x, y, 0.5)) for x in range(5) for y in range(5)]
    assert not (grid_of(*posts).cells == UNKNOWN).any()


def test_open_mesh_occupies_only_its_outline():
    box = triangulate(Box((2.0, 2.0, 1.0)))
    open_box = Mesh(box.vertices, box.faces[box.faces.min(axis=1) != 1])  # some sides are missing
    grid = grid_of(Solid(open_box, Pose3(z=0.3)))
    assert 40 < (grid.cells == OCCUPIED).sum() < 200


def test_room_with_inward_normals_has_a_free_floor():
    box = triangulate(Box((3.0, 3.0, 2.0)))
    grid = grid_of(Solid(Mesh(box.vertices, box.faces[:, ::-1]), Pose3(z=1.0)))
    assert grid.values_at(np.array([[0.0, 0.0], [1.5, 0.0]])).tolist() == [FREE, OCCUPIED]


def test_additions_to_a_ros_map_respect_its_yaw():
    ros_map = OccupancyGrid(np.full((40, 40), UNKNOWN, np.int8), 0.1, Pose2(1.0, 2.0, math.pi / 6))
    ros_map.cells[5:30, 5:30] = FREE
    place = ros_map.center_of(np.array([[20, 10]]))[0]
    grid = grid_of(Solid(Box((0.05, 0.05, 1.0)), Pose3(place[0], place[1], 0.5)), grid=ros_map)
    assert np.argwhere(grid.cells == OCCUPIED).tolist() == [[20, 10]]
    assert (grid.cells == UNKNOWN).sum() == (ros_map.cells == UNKNOWN).sum()


def test_a_map_that_would_be_too_large_is_refused_with_its_size():
    with pytest.raises(InvalidInput, match="map too large: 400040 x 400040 cells"):
        grid_of(bounds=(-1e4, -1e4, 1e4, 1e4))


def test_map_of_a_world_without_solids_contains_its_places():
    built = grid_of(places={"a": Pose2(3, 2), "b": Pose2(8, 2)}, bounds=(3, 2, 8, 2))
    assert built.values_at(np.array([[3.0, 2.0], [8.0, 2.0]])).tolist() == [FREE, FREE]


ROTATED_ORIGIN = Pose2(3.0, -2.0, 0.7)


def random_map(seed, shape=(30, 40), share=0.3):
    """Return a map of free cells with a `share` of occupied cells, and three unknown cells."""
    cells = np.where(np.random.default_rng(seed).random(shape) < share, OCCUPIED, 0).astype(np.int8)
    cells[0, :3] = UNKNOWN
    return OccupancyGrid(cells, 0.05, ROTATED_ORIGIN)


@pytest.mark.parametrize("seed", range(5))
def test_walls_built_from_a_map_give_the_same_map(seed):
    grid = random_map(seed)
    mesh = merge_solids(walls_from_map(grid, 1.0))
    redrawn = occupied_cells(grid, cross_section(mesh, 0.5))
    assert np.array_equal(redrawn, grid.cells == OCCUPIED)


def test_walls_enclose_only_the_occupied_cells_up_to_their_height():
    grid = random_map(9)
    mesh = merge_solids(walls_from_map(grid, 1.5))
    volume = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume
    assert volume == pytest.approx((grid.cells == OCCUPIED).sum() * 0.05**2 * 1.5)
    assert mesh.vertices[:, 2].min() == 0.0
    assert mesh.vertices[:, 2].max() == 1.5


def test_long_wall_has_twelve_triangles_for_any_number_of_cells():
    cells = np.zeros((100, 1000), np.int8)
    cells[20:24, 10:990] = OCCUPIED
    assert len(merge_solids(walls_from_map(OccupancyGrid(cells, 0.05), 1.0)).faces) == 12


def test_map_without_walls_gives_no_solids():
    assert walls_from_map(OccupancyGrid(np.zeros((5, 5), np.int8), 0.05), 1.0) == []


def test_sixteen_million_cells_of_a_building_are_one_solid():
    cells = np.zeros((4000, 4000), np.int8)
    cells[::100, :] = OCCUPIED
    cells[:, ::100] = OCCUPIED
    cells[50::100, 50::100] = 0
    solids = walls_from_map(OccupancyGrid(cells, 0.05), 1.0)
    assert len(World("w", tuple(solids)).solids) == 1


def test_sixteen_million_cells_of_noise_are_refused_before_memory_runs_out():
    cells = np.zeros((4000, 4000), np.int8)
    cells[::2, ::2] = OCCUPIED
    with pytest.raises(InvalidInput, match="too ragged"):
        walls_from_map(OccupancyGrid(cells, 0.05), 1.0)
