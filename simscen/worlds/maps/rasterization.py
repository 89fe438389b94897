"""Rasterize cross sections of solids: find the grid cells that the solids touch or fill.

All coordinates are in cells: the cell in row r and column c covers c ≤ x < c + 1 and r ≤ y < r + 1.
"""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.worlds.geometry.cross_section import CrossSection

CellMask = npt.NDArray[np.bool_]
"""Mask (rows, columns) of grid cells."""
Integers = npt.NDArray[np.int64]
"""One integer for each item (n,)."""

INWARD_OFFSET_CELLS = 1e-6
"""Distance by which outlines are moved inwards, so that a solid that ends at the edge of a cell does not touch it."""


def touched_cells(section: CrossSection, shape: tuple[int, int]) -> CellMask:
    """Return the mask of `shape` (rows, columns) of the cells that overlap a solid, at least partly."""
    cells = filled_cells(section, shape)
    rows, columns = _outline_cells(section.segments)
    inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    cells[rows[inside], columns[inside]] = True
    return cells


def _outline_cells(segments: Array) -> tuple[Integers, Integers]:
    """Return the rows (k,) and columns (k,) of the cells that segments (n, 2, 2) cross, possibly outside the grid."""
    # The segments are split at the grid lines, so that each piece lies in one cell.
    start, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    indices = [np.arange(len(segments)), np.arange(len(segments))]
    fractions = [np.zeros(len(segments)), np.ones(len(segments))]
    for axis in (0, 1):
        low, high = np.sort(segments[:, :, axis], axis=1).T
        first, last = np.floor(low).astype(np.int64) + 1, np.ceil(high).astype(np.int64) - 1
        segment, lines = expand_ranges(first, last + 1)
        indices.append(segment)
        fractions.append((lines - start[segment, axis]) / step[segment, axis])
    # Each cut is a fraction of its segment, from 0 (start) to 1 (end).
    segments_of_cuts, cuts = np.concatenate(indices), np.concatenate(fractions)
    order = np.lexsort((cuts, segments_of_cuts))
    segments_of_cuts, cuts = segments_of_cuts[order], cuts[order]
    lengths = np.linalg.norm(step, axis=1)
    # A shorter piece is a rounding error at a grid line, not a wall in the next cell.
    before, after = segments_of_cuts[:-1], segments_of_cuts[1:]
    is_kept = (before == after) & (np.diff(cuts) * lengths[before] > INWARD_OFFSET_CELLS)
    middles = ((cuts[:-1] + cuts[1:]) / 2)[is_kept]
    segment = before[is_kept]
    # A segment of length 0 has no direction; none of its pieces is kept.
    left = np.column_stack((-step[segment, 1], step[segment, 0])) / lengths[segment, None]
    points = start[segment] + middles[:, None] * step[segment] + INWARD_OFFSET_CELLS * left
    cells = np.floor(points).astype(np.int64)
    return cells[:, 1], cells[:, 0]


def filled_cells(section: CrossSection, shape: tuple[int, int]) -> CellMask:
    """Return the mask of `shape` (rows, columns) of the cells whose center is inside a solid.

    A center is inside if the winding number of the outlines around it is positive. A solid with inverted faces is not
    filled. A solid whose mesh has holes is not filled in rows where its outline is not closed.
    """
    rows, columns, signs, owners = _crossings(section, shape)
    # If the signs of the crossings of a row and a solid do not have the sum 0, the outline is not closed there.
    _, row_and_owner = np.unique(rows + shape[0] * owners.astype(np.int64), return_inverse=True)
    is_closed = (np.bincount(row_and_owner, weights=signs) == 0)[row_and_owner]
    (x0, y0), (x1, y1) = section.segments[:, 0].T, section.segments[:, 1].T
    is_inverted = (np.bincount(section.owners, weights=x0 * y1 - x1 * y0) < 0)[owners]
    is_kept = is_closed & ~is_inverted
    flat_index = rows[is_kept] * (shape[1] + 1) + np.clip(columns[is_kept], 0, shape[1])
    steps = np.bincount(flat_index, weights=signs[is_kept], minlength=shape[0] * (shape[1] + 1))
    winding = np.cumsum(steps.reshape(shape[0], shape[1] + 1), axis=1)[:, :-1]
    inside: CellMask = winding > 0.5
    return inside


def _crossings(
    section: CrossSection, shape: tuple[int, int]
) -> tuple[Integers, Integers, Array, npt.NDArray[np.int32]]:
    """Return row, column, sign, and owner (n,) of each crossing of an outline with the center line of a row.

    The column is the first one whose center is not left of the crossing. The sign is 1 if the solid is to the right of
    the crossing, and -1 if the solid is to the left. The owner is the index of the solid.
    """
    (x0, y0), (x1, y1) = section.segments[:, 0].T, section.segments[:, 1].T
    first = np.clip(np.ceil(np.minimum(y0, y1) - 0.5), 0, shape[0]).astype(np.int64)
    last = np.clip(np.ceil(np.maximum(y0, y1) - 0.5), 0, shape[0]).astype(np.int64)
    segment, rows = expand_ranges(first, last)
    slope = (x1 - x0)[segment] / (y1 - y0)[segment]
    x = x0[segment] + (rows + 0.5 - y0[segment]) * slope
    # A solid is on the left of its outline: beyond an upward segment (at larger x) is the outside.
    signs = np.where((y1 > y0)[segment], -1.0, 1.0)
    return rows, np.ceil(x - 0.5).astype(np.int64), signs, section.owners[segment]


def expand_ranges(first: Integers, stop: Integers) -> tuple[Integers, Integers]:
    """Concatenate the ranges first[k], …, stop[k] - 1. Return the index k of each integer, and the integers."""
    lengths = np.maximum(stop - first, 0)
    range_index = np.repeat(np.arange(len(first)), lengths)
    offsets = np.arange(len(range_index)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return range_index, first[range_index] + offsets
