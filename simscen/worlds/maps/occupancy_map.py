"""Convert a world to an occupancy map, as SLAM with a perfect lidar at one height would, and a map back to walls."""

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
from simscen.worlds.maps.rasterization import CellMask, filled_cells, touched_cells

MIN_OCCUPIED_VALUE = 65
"""Minimum value of an occupied cell: Nav2's default of occupied_thresh in percent. Trinary maps have only 0 and 100."""
WALLS_NAME = "map"
"""Name of the solid that represents all walls of a map."""
MAX_EDGES = 500_000
"""Maximum number of straight wall edges in one direction. A building of 16 million cells has about 10 000 in total."""


def draw_map(world: World, mesh: TriangleMesh, height: float, resolution: float = MAP_RESOLUTION_M) -> OccupancyGrid:
    """Draw the map of a world with cells of `resolution` m, from the cross section of `mesh` at `height` m.

    `mesh` consists of the static solids of the world. A cell is occupied if a solid overlaps the cell at `height`, and
    unknown if it is outside the building (see `_cells_outside_building`). If the world has its own map, the solids are
    drawn into a copy of that map, which keeps its resolution. Raises InvalidInput for more than MAX_MAP_CELLS cells.
    """
    section = cross_section(mesh, height)
    if world.grid is not None:
        cells = world.grid.cells.copy()
        cells[occupied_cells(world.grid, section)] = OCCUPIED
        return OccupancyGrid(cells, world.grid.resolution, world.grid.origin)
    bounds = _map_bounds(world, section.segments)
    if message := map_size_error(bounds, resolution):
        raise InvalidInput([Problem(world.name, 0, 0, "SC330", message, oversize_hint(world))])
    grid = empty_grid(bounds, resolution)
    occupied = occupied_cells(grid, section)
    cells = np.where(occupied, np.int8(OCCUPIED), np.int8(FREE))
    places = grid.cell_of(np.array([(pose.x, pose.y) for pose in world.places.values()]).reshape(-1, 2))
    cells[_cells_outside_building(occupied, places[grid.inside(places)])] = UNKNOWN
    return OccupancyGrid(cells, resolution, grid.origin)


def occupied_cells(grid: OccupancyGrid, section: CrossSection) -> CellMask:
    """Return the mask of the cells of `grid` that overlap the solids of a cross section in the world frame."""
    points_in_cells = grid.origin.inverse().apply(section.segments.reshape(-1, 2)) / grid.resolution
    return touched_cells(CrossSection(points_in_cells.reshape(-1, 2, 2), section.owners), grid.shape)


def empty_grid(bounds: Bounds, resolution: float) -> OccupancyGrid:
    """Return a grid of free cells of `resolution` m over `bounds` and MAP_MARGIN_M around it."""
    size = map_size(bounds, resolution)
    cells = np.zeros((size.height, size.width), dtype=np.int8)
    return OccupancyGrid(cells, resolution, Pose2(size.left * resolution, size.bottom * resolution))


def _map_bounds(world: World, segments: Array) -> Bounds:
    """Return the bounds of the world or, if they are unknown (all 0), of the `segments` of its cross section."""
    if any(world.bounds):
        return world.bounds
    if not len(segments):
        return (0.0, 0.0, 0.0, 0.0)
    points = segments.reshape(-1, 2)
    (left, bottom), (right, top) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return left, bottom, right, top


def _cells_outside_building(occupied: CellMask, places: npt.NDArray[np.int64]) -> CellMask:
    """Return the mask of the free cells outside the building; all False if the world is not a building.

    Free cells are outside if they are connected to the edge of the map, otherwise enclosed. A world is a building if
    the enclosed area is larger than the outside area within the convex hull of all walls, and none of the `places`
    (row, column) is outside.
    """
    from scipy import ndimage

    labels, _ = ndimage.label(~occupied)
    edge_labels = np.unique(np.concatenate((labels[0], labels[-1], labels[:, 0], labels[:, -1])))
    outside: CellMask = np.isin(labels, edge_labels[edge_labels > 0])
    enclosed_count = np.count_nonzero(~occupied & ~outside)
    has_place_outside = bool(outside[places[:, 0], places[:, 1]].any())
    if (
        not enclosed_count
        or has_place_outside
        or enclosed_count <= np.count_nonzero(outside & _cells_in_convex_hull(occupied))
    ):
        return np.zeros_like(occupied)
    return outside


def _cells_in_convex_hull(occupied: CellMask) -> CellMask:
    """Return the mask of the cells whose center is in the convex hull of the `occupied` cells.

    The occupied cells must not be collinear.
    """
    from scipy.spatial import ConvexHull

    rows = np.flatnonzero(occupied.any(axis=1))
    first = np.argmax(occupied[rows], axis=1)
    last = occupied.shape[1] - 1 - np.argmax(occupied[rows, ::-1], axis=1)
    points = np.column_stack((np.concatenate((first, last)), np.concatenate((rows, rows)))) + 0.5
    corners = points[ConvexHull(points).vertices]  # counterclockwise
    segments = np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)
    return filled_cells(CrossSection(segments, np.zeros(len(segments), np.int32)), occupied.shape)


def walls_from_map(grid: OccupancyGrid, height: float) -> list[Solid]:
    """Return the occupied cells of a map as one closed mesh, `height` m tall; [] if no cell is occupied.

    Each straight edge becomes one rectangle. Raises InvalidInput for more than MAX_EDGES edges in one direction.
    """
    occupied = grid.cells >= MIN_OCCUPIED_VALUE
    if not occupied.any():
        return []
    corners = np.concatenate((_side_rectangles(occupied), _top_and_bottom_rectangles(occupied)))
    vertices = corners.reshape(-1, 3) * (grid.resolution, grid.resolution, height)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate((first + np.array([0, 1, 2]), first + np.array([0, 2, 3]))).astype(np.int32)
    return [Solid(Mesh(vertices, faces), Pose3.planar(grid.origin), WALLS_NAME)]


def _side_rectangles(occupied: CellMask) -> Array:
    """Return the corners (n, 4, 3) of the upright rectangles of the walls, one for each straight edge of the outline.

    x and y are in cells; z is 0 or 1.
    """
    sides = []
    for swapped, cells in ((False, occupied), (True, occupied.T)):
        change = np.diff(np.pad(cells.astype(np.int8), ((1, 1), (0, 0))), axis=0)
        for sign in (1, -1):
            line, start, stop = _intervals(change == sign).T
            # The wall must be on the left of the line from a to b.
            a, b = (start, stop) if (sign == 1) != swapped else (stop, start)
            ends = [np.column_stack((end, line) if not swapped else (line, end)) for end in (a, b, b, a)]
            sides.append(
                np.stack([np.column_stack((e, np.full(len(e), z))) for e, z in zip(ends, (0, 0, 1, 1), strict=True)], 1)
            )
    return np.concatenate(sides).astype(np.float64)


def _top_and_bottom_rectangles(occupied: CellMask) -> Array:
    """Return the corners (n, 4, 3) of the rectangles of the top and the bottom; units as in `_side_rectangles`.

    Each rectangle covers equal intervals of occupied cells in consecutive rows.
    """
    row, start, stop = _intervals(occupied).T
    order = np.lexsort((row, stop, start))
    row, start, stop = row[order], start[order], stop[order]
    begins_rectangle = np.ones(len(row), dtype=np.bool_)
    begins_rectangle[1:] = (start[1:] != start[:-1]) | (stop[1:] != stop[:-1]) | (row[1:] != row[:-1] + 1)
    first = np.flatnonzero(begins_rectangle)
    last = np.append(first[1:], len(row)) - 1
    low, high, left, right = row[first], row[last] + 1, start[first], stop[first]
    zero = np.zeros(len(first), dtype=np.int64)
    ring = [(left, low), (right, low), (right, high), (left, high)]
    top = np.stack([np.column_stack((x, y, zero + 1)) for x, y in ring], axis=1)
    bottom = np.stack([np.column_stack((x, y, zero)) for x, y in reversed(ring)], axis=1)
    return np.concatenate((top, bottom)).astype(np.float64)


def _intervals(lines: CellMask) -> npt.NDArray[np.int64]:
    """Return the intervals of True in the rows of a mask, as (n, 3): row, first column, column after the interval.

    Raises InvalidInput if there are more than MAX_EDGES intervals.
    """
    steps = np.diff(np.pad(lines.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    count = int(np.count_nonzero(steps == 1))
    if count > MAX_EDGES:
        message = f"map too ragged for walls: more than {MAX_EDGES} separate edges"
        raise InvalidInput([Problem(WALLS_NAME, 0, 0, "SC331", message, "remove the speckles from the map")])
    begin, end = np.argwhere(steps == 1), np.argwhere(steps == -1)
    return np.column_stack((begin, end[:, 1]))
