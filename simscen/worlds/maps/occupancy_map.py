"""Occupancy map of a world, as SLAM with a perfect lidar at one height would build it, and walls from such a map."""

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Mesh, Solid, TriangleMesh
from simscen.worlds.extent import oversize_hint
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
    bounds = _map_bounds(world, section.segments)
    if message := map_size_error(bounds, resolution):
        raise InvalidInput([Problem(world.name, 0, 0, "SC330", message, oversize_hint(world))])
    grid = empty_grid(bounds, resolution, world.name)
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
    corners = points[ConvexHull(points).vertices]  # counterclockwise
    segments = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    return filled_cells(CrossSection(segments, np.zeros(len(segments), np.int32)), occupied.shape)


Runs = npt.NDArray[np.int64]

MIN_OCCUPIED_VALUE = 65
"""Cells with values from this to 100 are walls: Nav2's occupied_thresh, for maps in mode scale or raw."""
MAX_EDGES = 500_000
"""Maximum number of straight edges. A building of 16 million cells has about 10 000, noise has one per cell."""


def walls_from_map(grid: OccupancyGrid, height: float, name: str = "map") -> list[Solid]:
    """Return the occupied cells of a map as one closed mesh, `height` m tall; empty without occupied cells.

    A straight edge of any length becomes one face, and there are no faces between cells, so that no object can catch on
    a seam. Raises InvalidInput for a map with more than MAX_EDGES straight edges.
    """
    occupied = grid.cells >= MIN_OCCUPIED_VALUE
    if not occupied.any():
        return []
    corners = np.concatenate((_sides(occupied, name), _caps(occupied, name)))
    vertices = corners.reshape(-1, 3) * (grid.resolution, grid.resolution, height)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate((first + np.array([0, 1, 2]), first + np.array([0, 2, 3]))).astype(np.int32)
    return [Solid(Mesh(vertices, faces), Pose3.planar(grid.origin), name)]


def _sides(occupied: Cells, name: str) -> Array:
    """Return the upright faces (n, 4, 3) in cells, with height 1: one for each straight edge of the outline."""
    sides = []
    for swapped, cells in ((False, occupied), (True, occupied.T)):
        change = np.diff(np.pad(cells.astype(np.int8), ((1, 1), (0, 0))), axis=0)
        for sign in (1, -1):
            line, start, stop = _runs(change == sign, name).T
            # The wall must be on the left of the line from a to b.
            a, b = (start, stop) if (sign == 1) != swapped else (stop, start)
            ends = [np.column_stack((end, line) if not swapped else (line, end)) for end in (a, b, b, a)]
            sides.append(
                np.stack([np.column_stack((e, np.full(len(e), z))) for e, z in zip(ends, (0, 0, 1, 1), strict=True)], 1)
            )
    return np.concatenate(sides).astype(np.float64)


def _caps(occupied: Cells, name: str) -> Array:
    """Return the faces (n, 4, 3) of bottom and top, one for equal runs of cells in consecutive rows."""
    row, start, stop = _runs(occupied, name).T
    order = np.lexsort((row, stop, start))
    row, start, stop = row[order], start[order], stop[order]
    new = np.ones(len(row), dtype=np.bool_)
    new[1:] = (start[1:] != start[:-1]) | (stop[1:] != stop[:-1]) | (row[1:] != row[:-1] + 1)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(row)) - 1
    low, high, left, right = row[first], row[last] + 1, start[first], stop[first]
    zero = np.zeros(len(first), dtype=np.int64)
    ring = [(left, low), (right, low), (right, high), (left, high)]
    top = np.stack([np.column_stack((x, y, zero + 1)) for x, y in ring], axis=1)
    under = np.stack([np.column_stack((x, y, zero)) for x, y in reversed(ring)], axis=1)
    return np.concatenate((top, under)).astype(np.float64)


def _runs(lines: Cells, name: str) -> Runs:
    """Return the runs of True along the rows (n, 3): row, first column, column after the last."""
    steps = np.diff(np.pad(lines.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    count = int(np.count_nonzero(steps == 1))
    if count > MAX_EDGES:
        message = f"map too ragged for walls: more than {MAX_EDGES} separate edges"
        raise InvalidInput([Problem(name, 0, 0, "SC331", message, "remove the speckles from the map")])
    begin, end = np.argwhere(steps == 1), np.argwhere(steps == -1)
    return np.column_stack((begin, end[:, 1]))
