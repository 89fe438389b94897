"""The ground that a depth camera sees: slopes rise like obstacles, and robots drive up them.

In each column of a picture the ground is followed from the robot's feet upward, from one point that is ground to the
next: what rises no steeper than a slope is ground, a face or an edge is not.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Pixels = npt.NDArray[np.bool_]
STEP = 0.05
"""Meters that the ground has to go on for what follows to be measured from there."""
UPRIGHT = 1.0
"""What rises by more than this for each meter is a face, and the point below it belongs to it."""
WINDOW = 8
"""The part of a picture's rows that tells how what is seen first rises."""


def above_ground(away: Array, heights: Array, slope: float, low: float, known: Pixels) -> tuple[Array, Pixels]:
    """How high points (rows, columns) are above the ground, in meters, and which of them are ground.

    `away` are their distances along the plane from the camera, `heights` above the plane on which the robot stands,
    from the top row down; nan where nothing is seen. Ground rises by no more than the angle `slope`. What is seen
    first, lies higher by more than `low` than its own slope leads from the robot's feet, and is not `known` for ground,
    stands on a step that the picture does not show.
    """
    steepest, upright = math.tan(slope), _upright(away, heights)
    rows, columns = heights.shape
    far, ground = np.zeros(columns), np.zeros(columns)
    follows = ~_on_a_step(away, heights, upright, low) | known[_lowest(heights), np.arange(columns)]
    above, level = np.full(heights.shape, np.nan), np.zeros(heights.shape, dtype=bool)
    for row in range(rows - 1, -1, -1):
        r, z = away[row], heights[row]
        on = follows & (z - ground <= steepest * (r - far)) & ~upright[row]
        over = z - ground * np.minimum(1.0, r / np.maximum(far, STEP))
        above[row], level[row] = np.where(on, np.minimum(over, 0.0), over), on
        on &= r - far >= STEP
        far, ground = np.where(on, r, far), np.where(on, z, ground)
    return above, level


def _upright(away: Array, heights: Array) -> Pixels:
    """Which points are of a face: what is seen in the next row, or in the one before, is straight above or below."""
    steep: Pixels = np.diff(-heights, axis=0) > UPRIGHT * np.maximum(np.diff(-away, axis=0), 0.0)
    upright = np.zeros(heights.shape, dtype=bool)
    upright[1:] = steep
    upright[:-1] |= steep
    return upright


def _on_a_step(away: Array, heights: Array, upright: Pixels, low: float) -> Pixels:
    """In which columns what is seen first is a face, or higher than the slope on which it lies can lead."""
    rows, columns = heights.shape
    every, first = np.arange(columns), _lowest(heights)
    then = np.maximum(first - rows // WINDOW, 0)
    r, z = away[first, every], heights[first, every]
    rise = (heights[then, every] - z) / np.maximum(away[then, every] - r, STEP)
    step: Pixels = (z > low) & (upright[first, every] | ~(z - rise * r <= low))
    return step


def _lowest(heights: Array) -> npt.NDArray[np.intp]:
    """The lowest row in which anything is seen, of each column; the last one where nothing is."""
    rows: npt.NDArray[np.intp] = len(heights) - 1 - np.isfinite(heights)[::-1].argmax(axis=0)
    return rows
