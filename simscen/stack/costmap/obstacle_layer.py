"""Obstacles that a lidar sees: nav2_costmap_2d's obstacle layer, without a loop over beams or cells.

Nav2 walks along every beam. Here only the cells that are marked now are asked whether a beam passes through them,
which is the same question and a hundred times fewer cells.
"""

import cmath
import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.grid_frame import Cells, GridFrame, Numbers
from simscen.stack.localizers.beams import Plane, directions

RANGE_TOLERANCE_M = 1e-9
"""Margin before the end of the free part of a beam, within which cells are tested exactly."""


@dataclass(frozen=True, eq=False)
class ScanAmongMoving(Scan):
    """A scan of which some beams, `moving` (n,), hit what will be somewhere else: it clears as any, and marks less."""

    moving: npt.NDArray[np.bool_] = field(kw_only=True)


def hit_points(scan: Scan, base: Pose2, nearest: float, farthest: float) -> tuple[Plane, complex]:
    """Return the points x + iy (n,) where beams hit static things `nearest` to `farthest` m away.

    And where the lidar is.
    """
    place = _place(scan, base)
    points: Plane = _ends(scan, nearest, farthest) * cmath.rect(1.0, base.yaw)
    points += place
    return points, place


@lru_cache(maxsize=2)
def _ends(scan: Scan, nearest: float, farthest: float) -> Plane:
    """Return the hits x + iy in the frame of the lidar, unrotated. Cached, since two costmaps use each scan."""
    ranges = scan.ranges
    use = (ranges >= max(scan.range_min, nearest)) & (ranges <= min(scan.range_max, farthest))
    if isinstance(scan, ScanAmongMoving):
        use &= ~scan.moving
    beams = use.nonzero()[0]
    ends: Plane = ranges.take(beams) * directions(scan).take(beams)
    return ends


def _place(scan: Scan, base: Pose2) -> complex:
    """Return the position of the lidar in the map, x + iy."""
    return complex(base.x, base.y) + cmath.rect(1.0, base.yaw) * complex(scan.mount.x, scan.mount.y)


@lru_cache(maxsize=4)
def _shown_free(scan: Scan, farthest: float, inf_is_valid: bool) -> Array:
    """How far beams (n,) show free space: to their hits, or to `farthest`; nan and too near beams show 0.

    So do beams that meet nothing, unless `inf_is_valid`.
    """
    ranges = scan.ranges
    seen = np.where(ranges > scan.range_max, np.inf if inf_is_valid else 0.0, ranges)
    return np.where(seen >= scan.range_min, np.minimum(seen, farthest), 0.0)


def in_view(cells: Cells, frame: GridFrame, scan: Scan, base: Pose2) -> npt.NDArray[np.bool_]:
    """Which of the cells (n, 2) lie where the lidar looks, whatever it sees there."""
    lidar = base.compose(scan.mount)
    offset = frame.centers(cells) - np.array([lidar.x, lidar.y])
    bearing = np.arctan2(offset[:, 1], offset[:, 0])
    turned = (bearing - lidar.yaw - scan.angle_min) % (2 * math.pi)
    return np.asarray(turned <= abs(scan.angle_increment) * len(scan.ranges))


def crossed_cells(
    points: Plane, resolution: float, scan: Scan, base: Pose2, spec: CostmapSpec
) -> tuple[Numbers, float]:
    """Return the indices of the cells with centers x + iy (n,) that a beam crosses before it hits anything.

    And how far the nearest of all centers, of which there is one, is from the lidar. A line crosses a square of
    half-width h when its distance from the center is at most h (|cos| + |sin|); each cell is tested against the beam
    nearest to its center, which crosses it if any does.
    """
    first, step, half = base.yaw + scan.mount.yaw + scan.angle_min, scan.angle_increment, resolution / 2
    seen = points - _place(scan, base)
    seen *= cmath.rect(1.0, -first)
    distance, bearing = np.abs(seen), np.arctan2(seen.imag, seen.real)
    nearest = distance.min().item()
    beam, free = _nearest_beams(bearing, scan, _shown_free(scan, spec.raytrace_max_range, spec.inf_is_valid))
    near = (distance * math.cos(step / 2) + half <= free).nonzero()[0]  # most lie behind what their beams hit
    if not len(near):
        return near, nearest
    distance, length = distance.take(near), free.take(near)
    wide = half / abs(math.sin(step / 2))  # nearer than this, beams lie so close that each cell is on one
    if spec.raytrace_min_range == 0.0 and (distance <= np.minimum(length - (half + RANGE_TOLERANCE_M), wide)).all():
        return near, nearest
    off = np.remainder(bearing[near] - beam[near] * step + math.pi, 2 * math.pi) - math.pi
    direction = first + bearing[near] - off
    reach = half * (np.abs(np.cos(direction)) + np.abs(np.sin(direction)))
    along = distance * np.cos(off)
    passed = (np.abs(distance * np.sin(off)) <= reach) & (along <= length - half) & (along >= spec.raytrace_min_range)
    return near[passed], nearest


def _nearest_beams(bearing: Array, scan: Scan, values: Array) -> tuple[Numbers, Array]:
    """Return the beams nearest to directions (n,) relative to the first beam, and their values of `values`.

    The value is nan where there is no beam.
    """
    step, count = scan.angle_increment, len(values)
    turn = round(2 * math.pi / abs(step))
    even = abs(turn * abs(step) - 2 * math.pi) < 1e-6
    if even and turn == count:
        beam = np.rint(bearing / step).astype(np.int64)
        return beam, values.take(beam, mode="wrap")
    beam = np.rint((bearing % (2 * math.pi)) / step).astype(np.int64)
    if even:
        beam %= turn
    return beam, np.where((beam >= 0) & (beam < count), values.take(beam, mode="clip"), np.nan)
