"""From the outlines of solids to the cells they touch; all segments at once, nothing per cell in Python."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.worlds.geometry.cross_section import Section

Cells = npt.NDArray[np.bool_]

INWARDS = 1e-6
"""Cells by which outlines are drawn inside their solid: a wall that ends on a cell's edge stays out of the cell."""


def touched(cut: Section, shape: tuple[int, int]) -> Cells:
    """Which cells of a lattice (rows, columns) share inner points with the solids; outlines in cell units."""
    cells = filled(cut, shape)
    rows, columns = _on_outline(cut.segments)
    inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    cells[rows[inside], columns[inside]] = True
    return cells


def _on_outline(segments: Array) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The cells that the segments pass: each is cut at the lattice lines, and every piece lies in one cell."""
    start, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    owner = [np.arange(len(segments)), np.arange(len(segments))]
    along = [np.zeros(len(segments)), np.ones(len(segments))]
    for axis in (0, 1):
        low, high = np.sort(segments[:, :, axis], axis=1).T
        first, last = np.floor(low).astype(np.int64) + 1, np.ceil(high).astype(np.int64) - 1
        which, lines = ranges(first, last + 1)
        owner.append(which)
        along.append((lines - start[which, axis]) / step[which, axis])
    owners, cuts = np.concatenate(owner), np.concatenate(along)
    order = np.lexsort((cuts, owners))
    owners, cuts = owners[order], cuts[order]
    lengths = np.linalg.norm(step, axis=1)
    # A piece as short as this is a rounding error across a lattice line, not a wall in the next cell.
    same = (owners[:-1] == owners[1:]) & (np.diff(cuts) * lengths[owners[:-1]] > INWARDS)
    middles = ((cuts[:-1] + cuts[1:]) / 2)[same]
    which = owners[:-1][same]
    left = np.column_stack((-step[:, 1], step[:, 0])) / lengths[:, None]
    points = start[which] + middles[:, None] * step[which] + INWARDS * left[which]
    cells = np.floor(points).astype(np.int64)
    return cells[:, 1], cells[:, 0]


def filled(cut: Section, shape: tuple[int, int]) -> Cells:
    """The cells whose center is inside: the winding number of the outlines about it is positive.

    Rows in which an owner's outline is not closed (meshes with holes) are left to its outline, and so are owners
    that turn their inside out, such as a room modeled as a box seen from within.
    """
    rows, columns, signs, owners = _crossings(cut, shape)
    keep = _balanced(rows + shape[0] * owners.astype(np.int64), signs) & ~_inside_out(cut)[owners]
    flat = rows[keep] * (shape[1] + 1) + np.clip(columns[keep], 0, shape[1])
    steps = np.bincount(flat, weights=signs[keep], minlength=shape[0] * (shape[1] + 1))
    winding = np.cumsum(steps.reshape(shape[0], shape[1] + 1), axis=1)[:, :-1]
    inside: Cells = winding > 0.5
    return inside


def _crossings(
    cut: Section, shape: tuple[int, int]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array, npt.NDArray[np.int32]]:
    """Where outlines cross the middle lines of the rows: row, first column whose center is beyond, sign, owner."""
    (x0, y0), (x1, y1) = cut.segments[:, 0].T, cut.segments[:, 1].T
    first = np.clip(np.ceil(np.minimum(y0, y1) - 0.5), 0, shape[0]).astype(np.int64)
    last = np.clip(np.ceil(np.maximum(y0, y1) - 0.5), 0, shape[0]).astype(np.int64)
    which, rows = ranges(first, last)
    slope = (x1 - x0)[which] / (y1 - y0)[which]
    x = x0[which] + (rows + 0.5 - y0[which]) * slope
    # A solid is on the left of its outline: going up, what lies beyond (at larger x) is outside.
    signs = np.where((y1 > y0)[which], -1.0, 1.0)
    return rows, np.ceil(x - 0.5).astype(np.int64), signs, cut.owners[which]


def _balanced(keys: npt.NDArray[np.int64], signs: Array) -> Cells:
    """Which crossings belong to a (row, owner) whose signs add up to nothing."""
    _, group = np.unique(keys, return_inverse=True)
    balanced: Cells = (np.bincount(group, weights=signs) == 0)[group]
    return balanced


def _inside_out(cut: Section) -> Cells:
    """For each owner, whether its outline runs clockwise."""
    if not len(cut.owners):
        return np.zeros(0, dtype=np.bool_)
    (x0, y0), (x1, y1) = cut.segments[:, 0].T, cut.segments[:, 1].T
    clockwise: Cells = np.bincount(cut.owners, weights=x0 * y1 - x1 * y0) < 0
    return clockwise


def ranges(
    first: npt.NDArray[np.int64], stop: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """All integers of the half-open ranges, one range after the other, and which range each is from."""
    lengths = np.maximum(stop - first, 0)
    which = np.repeat(np.arange(len(first)), lengths)
    offsets = np.arange(len(which)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return which, first[which] + offsets
