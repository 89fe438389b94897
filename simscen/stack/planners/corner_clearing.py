"""Exactly what a path leads over: between two looks at it, it may cut the corner of a cell where no robot can be."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.stack.planners.path_points import spaced
from simscen.stack.planners.traversal_costs import TraversalCosts

BESIDE = 0.02
"""Cells by which a path passes a corner that it would cut."""


def around_corners(rates: TraversalCosts, points: Array) -> Array | None:
    """The path (n, 2) led around each corner that it cut; None where more than a corner is in its way.

    The points of a path that cut any are then no further apart than the cells are wide.
    """
    if not np.isfinite(rates.at(points)).all():
        return None
    steps = np.diff(points, axis=0)
    path = points if np.hypot(*steps.T).max(initial=0.0) <= rates.resolution else spaced(points, rates.resolution)
    places = (path - rates.origin) / rates.resolution
    cells = np.floor(places)
    aslant = np.flatnonzero((cells[1:] != cells[:-1]).all(axis=1))  # no step is longer than a cell: over one edge each
    here, there = cells[aslant], cells[aslant + 1]
    corners = np.maximum(here, there)
    reached = (corners - places[aslant]) / (places[aslant + 1] - places[aslant])
    first = (reached[:, 0] < reached[:, 1])[:, None]  # over the edge on the left or right
    over = np.where(first, *_mixed(there, here))
    beside = np.where(first, *_mixed(here, there))
    cut = ~_free(rates, over)
    if not (np.isfinite(rates.at(path)).all() and _free(rates, beside[cut]).all()):
        return None
    if not cut.any():
        return points
    led = corners[cut] + BESIDE * np.sign(beside[cut] + 0.5 - corners[cut])
    return np.insert(path, aslant[cut] + 1, led * rates.resolution + np.array(rates.origin), axis=0)


def _mixed(one: Array, other: Array) -> tuple[Array, Array]:
    """The columns of the one with the rows of the other, and the other way round."""
    return np.column_stack((one[:, 0], other[:, 1])), np.column_stack((other[:, 0], one[:, 1]))


def _free(rates: TraversalCosts, cells: Array) -> npt.NDArray[np.bool_]:
    """Whether the robot can be in cells (n, 2), columns first."""
    columns, rows = cells.astype(np.int64).T
    return np.asarray(np.isfinite(rates.rates[rows, columns]))
