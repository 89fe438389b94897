"""Occupancy map of a world: the map that SLAM with a perfect lidar at one height would build."""

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.worlds.geometry.cross_section import CrossSection, cross_section
from simscen.worlds.maps.map_size import MAP_RESOLUTION_M, Bounds, map_size, map_size_error
from simscen.worlds.maps.rasterization import Cells, filled_cells, touched_cells


def draw_map(world: World, mesh: TriangleMesh, height: float, resolution: float = MAP_RESOLUTION_M) -> OccupancyGrid:
    """Draw the map of a world whose static solids form `mesh`, cut at `height` in meters.

    A cell is occupied if any part of a solid, hollow or not, lies in the cell at that height. A cell is unknown if it
    lies outside the building (see `_cells_outside_building`). All other cells are free. If the world has its own map,
    the solids are drawn into a copy of that map. Raises InvalidInput beyond MAX_MAP_CELLS.
    """
    section = cross_section(mesh, height)
    if world.grid is not None:
        cells = world.grid.cells.copy()
        cells[occupied_cells(world.grid, section)] = OCCUPIED
        return OccupancyGrid(cells, world.grid.resolution, world.grid.origin)
    grid = empty_grid(_map_bounds(world, section.segments), resolution, world.name)
    occupied = occupied_cells(grid, section)
    cells = np.where(occupied, np.int8(OCCUPIED), np.int8(FREE))
    cells[_cells_outside_building(occupied, _cells_of_places(world, grid))] = UNKNOWN
    return OccupancyGrid(cells, resolution, grid.origin)


def occupied_cells(grid: OccupancyGrid, section: CrossSection) -> Cells:
    """Return the cells of the grid (rows, columns) that share inner points with the solids of a cross section."""
    points_in_cells = grid.origin.inverse().apply(section.segments.reshape(-1, 2)) / grid.resolution
    return touched_cells(CrossSection(points_in_cells.reshape(-1, 2, 2), section.owners), grid.shape)


def empty_grid(bounds: Bounds, resolution: float, name: str) -> OccupancyGrid:
    """Return a free grid over `bounds` and a margin; raises InvalidInput beyond MAX_MAP_CELLS.

    The grid lines are multiples of `resolution`. `name` names the world in the error.
    """
    if message := map_size_error(bounds, resolution):
        raise InvalidInput([Problem(name, 0, 0, "SC330", message, "is something placed far away from the rest?")])
    size = map_size(bounds, resolution)
    cells = np.zeros((size.height, size.width), dtype=np.int8)
    return OccupancyGrid(cells, resolution, Pose2(size.left * resolution, size.bottom * resolution))


def _map_bounds(world: World, segments: Array) -> Bounds:
    """Return the bounds of the world, or those of its cross section if the world states none."""
    if any(world.bounds):
        return world.bounds
    if not len(segments):
        return (0.0, 0.0, 0.0, 0.0)
    points = segments.reshape(-1, 2)
    (left, bottom), (right, top) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return left, bottom, right, top


def _cells_of_places(world: World, grid: OccupancyGrid) -> npt.NDArray[np.int64]:
    """Return the cells (n, 2) of the named places that lie on the grid."""
    points = np.array([(pose.x, pose.y) for pose in world.places.values()]).reshape(-1, 2)
    cells = grid.cell_of(points)
    return cells[grid.inside(cells)]


def _cells_outside_building(occupied: Cells, places: npt.NDArray[np.int64]) -> Cells:
    """Return the free cells outside the building; none if the world is not a building.

    Cells are outside if they are connected to the edge of the map. A world is a building if the enclosed free area is
    larger than the outside area within the convex hull of all walls, and no named place lies outside. A field of
    obstacles encloses hardly any area, so all of its free cells stay free.
    """
    from scipy import ndimage

    labels, _ = ndimage.label(~occupied)
    edge_labels = np.unique(np.concatenate((labels[0], labels[-1], labels[:, 0], labels[:, -1])))
    outside: Cells = np.isin(labels, edge_labels[edge_labels > 0])
    enclosed_count = np.count_nonzero(~occupied & ~outside)
    has_place_outside = bool(outside[places[:, 0], places[:, 1]].any())
    if (
        not enclosed_count
        or has_place_outside
        or enclosed_count <= np.count_nonzero(outside & _cells_in_convex_hull(occupied))
    ):
        return np.zeros_like(occupied)
    return outside


def _cells_in_convex_hull(occupied: Cells) -> Cells:
    """Return the cells with their center in the convex hull of the occupied ones, which must not be collinear."""
    from scipy.spatial import ConvexHull

    rows = np.flatnonzero(occupied.any(axis=1))
    first = np.argmax(occupied[rows], axis=1)
    last = occupied.shape[1] - 1 - np.argmax(occupied[rows, ::-1], axis=1)
    points = np.column_stack((np.concatenate((first, last)), np.concatenate((rows, rows)))) + 0.5
    corners = points[ConvexHull(points).vertices]  # anticlockwise
    segments = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    return filled_cells(CrossSection(segments, np.zeros(len(segments), np.int32)), occupied.shape)
