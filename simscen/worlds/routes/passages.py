"""Find the passages of a path: gaps between two solids that a robot has to cross, such as doors.

The two sides of a passage are points of `ClearanceField.outline`, which are points on the surfaces of all solids.
"""

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.polylines import polyline_length, resample_polyline
from simscen.core.records.case import Passage, Point
from simscen.worlds.routes.clearance import ClearanceField

MAX_WIDTH_M = 4.0
"""Maximum width of a passage. Wider gaps are not reported."""
PROBE_SPACING_M, MAX_PROBES = 0.25, 80
"""Minimum distance between the points of the path at which passages are searched, and maximum number of points."""
NARROW_WIDTH_M = 2.0
"""Maximum width of a passage that is measured at its narrowest point. Wider ones are measured on the path."""
RAY_ROTATIONS = np.array(
    [[[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]] for a in np.radians(np.arange(-60, 61, 10))]
)
"""Rotation matrices (n, 2, 2) of the rays that search the other side of a passage: -60° to 60°."""
MAX_POINTS_PER_SIDE = 400
"""Approximate maximum number of points of the outline that are compared on each side of a passage."""


def find_passages(path: Array, goal: str, field: ClearanceField) -> tuple[Passage, ...]:
    """Return the passages of a path (n, 2) to the goal named `goal`, in the order in which the path crosses them.

    The widths of passages are exact to about 2 cm.
    """
    if field.outline is None:
        return ()
    points = resample_polyline(path, max(PROBE_SPACING_M, polyline_length(path) / MAX_PROBES))
    found: dict[tuple[int, int], float] = {}
    for point in points:
        for pair in _candidate_pairs(point, field):
            index = _crossing_index(field.outline.data[list(pair)], points)
            if index is not None:
                found.setdefault((min(pair), max(pair)), index)
                break
    return tuple(_passage(goal, pair, field) for pair in sorted(found, key=lambda pair: found[pair]))


def passage_between(sides: tuple[Point, ...], goal: str, field: ClearanceField) -> Passage:
    """Return the passage between the two points `sides`, which are moved to the nearest points of the outline."""
    assert field.outline is not None
    first, second = (int(field.outline.query(np.array(side))[1]) for side in sides)
    return _passage(goal, (first, second), field)


def _passage(goal: str, pair: tuple[int, int], field: ClearanceField) -> Passage:
    """Return the passage between two points of the outline, given by their indices. Points are rounded to 1 mm."""
    assert field.outline is not None
    (ax, ay), (bx, by) = field.outline.data[list(pair)].tolist()
    first_name, second_name = (field.names[owner] for owner in field.owners[list(pair)])
    ends = (round(ax, 3), round(ay, 3)), (round(bx, 3), round(by, 3))
    return Passage(goal, ends, (first_name, second_name))


def _candidate_pairs(point: Array, field: ClearanceField) -> Iterator[tuple[int, int]]:
    """Yield pairs of outline points, by index, that may be the two sides of a passage at a point of the path.

    Preferred pairs come first.
    """
    assert field.outline is not None
    distance, first = field.outline.query(point)
    if not 0 < distance < MAX_WIDTH_M:
        return
    hits = _ray_hits(point, field.outline.data[first], float(distance), field)
    rays = np.flatnonzero(np.isfinite(hits[:, 0]))
    if not len(rays):
        return
    shortest = int(rays[np.argmin(np.linalg.norm(hits[rays] - point, axis=1))])
    straightest = int(rays[np.argmin(np.abs(rays - len(RAY_ROTATIONS) // 2))])
    for ray in dict.fromkeys((shortest, straightest)):
        second = int(field.outline.query(hits[ray])[1])
        yield _narrowest_pair(int(first), second, field)
        yield int(first), second


def _ray_hits(point: Array, side: Array, distance: float, field: ClearanceField) -> Array:
    """Return for each of the RAY_ROTATIONS the point (n, 2) where a ray from `point` hits a solid; nan without a hit.

    The rays point away from `side`, which is `distance` m from `point`.
    """
    steps = np.arange(0.0, MAX_WIDTH_M - distance, field.grid.resolution / 2)
    rays = point + steps[None, :, None] * (RAY_ROTATIONS @ ((point - side) / distance))[:, None]
    cells = field.grid.cell_of(rays.reshape(-1, 2))
    inside = field.grid.inside(cells)
    is_solid = inside & (field.cell_clearance[tuple(np.where(inside[:, None], cells, 0).T)] <= 0)
    is_solid = is_solid.reshape(len(RAY_ROTATIONS), -1)
    numbers, first = np.arange(len(RAY_ROTATIONS)), is_solid.argmax(axis=1)
    hits: Array = np.where(is_solid[numbers, first][:, None], rays[numbers, first], np.nan)
    return hits


def _crossing_index(ends: Array, path: Array) -> float | None:
    """Return where the line between two points `ends` (2, 2) first crosses a path (n, 2); None without a crossing.

    The result is an index of the path: 2.5 means halfway between the points 2 and 3.
    """
    (ax, ay), (bx, by) = ends.tolist()
    # A cross product is positive for points on the left of a line, and negative on its right.
    across = (bx - ax) * (path[:, 1] - ay) - (by - ay) * (path[:, 0] - ax)
    step = np.diff(path, axis=0)
    a, b = (step[:, 0] * (y - path[:-1, 1]) - step[:, 1] * (x - path[:-1, 0]) for x, y in ((ax, ay), (bx, by)))
    pieces = np.flatnonzero((across[:-1] * across[1:] <= 0) & (a * b <= 0))
    if not len(pieces):
        return None
    first = int(pieces[0])
    before, after = abs(float(across[first])), abs(float(across[first + 1]))
    return first + (before / (before + after) if before + after else 0.0)


def _narrowest_pair(first: int, second: int, field: ClearanceField) -> tuple[int, int]:
    """Return the two sides of a passage at its narrowest point near the sides `first` and `second`.

    Sides are indices of outline points. Sides that are more than NARROW_WIDTH_M apart are returned unchanged.
    """
    assert field.outline is not None
    data = field.outline.data
    width = float(np.linalg.norm(data[first] - data[second]))
    if width > NARROW_WIDTH_M:
        return first, second
    middle = (data[first] + data[second]) / 2
    around: npt.NDArray[np.int64] = np.array(field.outline.query_ball_point(middle, 0.75 * width, return_sorted=True))
    offsets = data[around] - middle
    cosines = offsets @ (data[first] - middle) / np.maximum(np.linalg.norm(offsets, axis=1) * width / 2, 1e-9)
    near, far = _subsample(around[cosines > 0.5], first), _subsample(around[cosines < -0.5], second)
    distances = np.linalg.norm(data[near][:, None] - data[far][None], axis=2)
    j, k = np.unravel_index(int(np.argmin(distances)), distances.shape)
    return int(near[j]), int(far[k])


def _subsample(indices: npt.NDArray[np.int64], required: int) -> npt.NDArray[np.int64]:
    """Return about MAX_POINTS_PER_SIDE of the indices, evenly spaced, and the index `required`."""
    return np.append(indices[:: 1 + len(indices) // MAX_POINTS_PER_SIDE], required)
