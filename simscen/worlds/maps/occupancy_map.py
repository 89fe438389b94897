"""The occupancy map of a world: what SLAM with a perfect lidar at one height would have drawn."""

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.shapes import TriangleMesh
from simscen.worlds.geometry.cross_section import Section, section
from simscen.worlds.maps.map_size import RESOLUTION, map_size, too_large
from simscen.worlds.maps.rasterization import Cells, filled, touched


def map_of(world: World, mesh: TriangleMesh, height: float, resolution: float = RESOLUTION) -> OccupancyGrid:
    """The map a robot gets of a world whose static solids are `mesh`, cut at `height` in meters.

    A cell is occupied if any part of a solid is in it at that height, hollow or not; unknown if it lies outside of
    the building, where nobody ever went (see `_outside`); free otherwise. A world that came with a map of its own
    keeps it, with what was added to the world drawn in. Raises InvalidInput beyond MOST_CELLS.
    """
    cut = section(mesh, height)
    if world.grid is not None:
        return _drawn_into(world.grid, cut)
    grid = empty_grid(_bounds(world, cut.segments), resolution, world.name)
    occupied = occupied_cells(grid, cut)
    cells = np.where(occupied, np.int8(OCCUPIED), np.int8(FREE))
    cells[_outside(occupied, _places(world, grid))] = UNKNOWN
    return OccupancyGrid(cells, resolution, grid.origin)


def occupied_cells(grid: OccupancyGrid, cut: Section) -> Cells:
    """Which cells of the grid (rows, columns) share inner points with the solids of a section."""
    flat = grid.origin.inverse().apply(cut.segments.reshape(-1, 2)) / grid.resolution
    return touched(Section(flat.reshape(-1, 2, 2), cut.owners), grid.shape)


def empty_grid(bounds: tuple[float, float, float, float], resolution: float, name: str) -> OccupancyGrid:
    """A free grid over bounds (min x, min y, max x, max y) and MARGIN; its lines are multiples of `resolution`."""
    if message := too_large(bounds, resolution):
        raise InvalidInput([Problem(name, 0, 0, "SC330", message, "is something placed far away from the rest?")])
    size = map_size(bounds, resolution)
    cells = np.zeros((size.height, size.width), dtype=np.int8)
    return OccupancyGrid(cells, resolution, Pose2(size.left * resolution, size.bottom * resolution))


def _bounds(world: World, segments: Array) -> tuple[float, float, float, float]:
    """The world's own bounds, or those of its section when it states none."""
    if any(world.bounds):
        return world.bounds
    if not len(segments):
        return (0.0, 0.0, 0.0, 0.0)
    corners = segments.reshape(-1, 2)
    (left, low), (right, high) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return left, low, right, high


def _drawn_into(grid: OccupancyGrid, cut: Section) -> OccupancyGrid:
    cells = grid.cells.copy()
    cells[occupied_cells(grid, cut)] = OCCUPIED
    return OccupancyGrid(cells, grid.resolution, grid.origin)


def _places(world: World, grid: OccupancyGrid) -> npt.NDArray[np.int64]:
    """The cells (n, 2) of the named places that lie on the grid."""
    points = np.array([(pose.x, pose.y) for pose in world.places.values()]).reshape(-1, 2)
    cells = grid.cell_of(points)
    return cells[grid.inside(cells)]


def _outside(occupied: Cells, places: npt.NDArray[np.int64]) -> Cells:
    """The cells outside of a building: free, linked to the edge of the map, and not where robots are.

    A world is a building if more ground is walled off than lies open within the convex hull of all walls, and no named
    place lies in the open. A field of obstacles has hardly any ground that is walled off, so all of it stays free.
    """
    from scipy import ndimage

    labels, _ = ndimage.label(~occupied)
    edge = np.unique(np.concatenate((labels[0], labels[-1], labels[:, 0], labels[:, -1])))
    open_ground: Cells = np.isin(labels, edge[edge > 0])
    enclosed = np.count_nonzero(~occupied & ~open_ground)
    lived_in = bool(open_ground[places[:, 0], places[:, 1]].any())
    if not enclosed or lived_in or enclosed <= np.count_nonzero(open_ground & _hull(occupied)):
        return np.zeros_like(occupied)
    return open_ground


def _hull(occupied: Cells) -> Cells:
    """The cells whose middle is in the convex hull of the occupied ones; these must not all lie on one line."""
    from scipy.spatial import ConvexHull

    rows = np.flatnonzero(occupied.any(axis=1))
    first = np.argmax(occupied[rows], axis=1)
    last = occupied.shape[1] - 1 - np.argmax(occupied[rows, ::-1], axis=1)
    ends = np.column_stack((np.concatenate((first, last)), np.concatenate((rows, rows)))) + 0.5
    corners = ends[ConvexHull(ends).vertices]  # anticlockwise
    segments = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    return filled(Section(segments, np.zeros(len(segments), np.int32)), occupied.shape)
