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
from simscen.core.sensing import Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.frame import Cells, Frame, Numbers
from simscen.stack.localizers.beams import Plane, directions


@dataclass(frozen=True, eq=False)
class ScanAmongMoving(Scan):
    """A scan of which some beams, `moving` (n,), hit what will be somewhere else: it clears as any, and marks less."""

    moving: npt.NDArray[np.bool_] = field(kw_only=True)


def hits(scan: Scan, base: Pose2, nearest: float, farthest: float) -> tuple[Plane, complex]:
    """Map points x + iy (n,) of the beams that hit something that stands, `nearest` to `farthest` metres away.

    And where the lidar is.
    """
    place = _place(scan, base)
    points: Plane = _ends(scan, nearest, farthest) * cmath.rect(1.0, base.yaw)
    points += place
    return points, place


@lru_cache(maxsize=2)
def _ends(scan: Scan, nearest: float, farthest: float) -> Plane:
    """The same from the lidar, unturned: two costmaps take in each scan."""
    ranges = scan.ranges
    use = (ranges >= max(scan.range_min, nearest)) & (ranges <= min(scan.range_max, farthest))
    if isinstance(scan, ScanAmongMoving):
        use &= ~scan.moving
    beams = use.nonzero()[0]
    ends: Plane = ranges.take(beams) * directions(scan).take(beams)
    return ends


def _place(scan: Scan, base: Pose2) -> complex:
    """Where the lidar is in the map, x + iy."""
    return complex(base.x, base.y) + cmath.rect(1.0, base.yaw) * complex(scan.mount.x, scan.mount.y)


def _shown_free(ranges: Array, scan: Scan, spec: CostmapSpec) -> Array:
    """How far beams (n,) show free space: to their hits, or to raytrace_max_range; nan and too near beams show 0.

    So do beams that meet nothing, unless `inf_is_valid`.
    """
    seen = np.where(ranges > scan.range_max, np.inf if spec.inf_is_valid else 0.0, ranges)
    return np.where(seen >= scan.range_min, np.minimum(seen, spec.raytrace_max_range), 0.0)


def in_view(cells: Cells, frame: Frame, scan: Scan, base: Pose2) -> npt.NDArray[np.bool_]:
    """Which of the cells (n, 2) lie where the lidar looks, whatever it sees there."""
    lidar = base.compose(scan.mount)
    offset = frame.centres(cells) - np.array([lidar.x, lidar.y])
    bearing = np.arctan2(offset[:, 1], offset[:, 0])
    turned = (bearing - lidar.yaw - scan.angle_min) % (2 * math.pi)
    return np.asarray(turned <= abs(scan.angle_increment) * len(scan.ranges))


def crossed(points: Plane, resolution: float, scan: Scan, base: Pose2, spec: CostmapSpec) -> Numbers:
    """Indices of those cells with these centres x + iy (n,) that a beam crosses before it hits anything.

    A line crosses a square of half-width h when its distance from the centre is at most h (|cos| + |sin|); each cell
    is tested against the beam nearest to its centre, which crosses it if any does.
    """
    first, step, half = base.yaw + scan.mount.yaw + scan.angle_min, scan.angle_increment, resolution / 2
    seen = (points - _place(scan, base)) * cmath.rect(1.0, -first)
    distance, bearing = np.abs(seen), np.arctan2(seen.imag, seen.real)
    beam, ranges = _nearest_beams(bearing, scan)
    near = (distance * math.cos(step / 2) + half <= ranges).nonzero()[0]  # most lie behind what their beams hit
    if not len(near):
        return near
    distance, bearing, length = distance[near], bearing[near], _shown_free(ranges[near], scan, spec)
    off = np.remainder(bearing - beam[near] * step + math.pi, 2 * math.pi) - math.pi
    direction = first + bearing - off
    reach = half * (np.abs(np.cos(direction)) + np.abs(np.sin(direction)))
    along = distance * np.cos(off)
    passed = (np.abs(distance * np.sin(off)) <= reach) & (along <= length - half) & (along >= spec.raytrace_min_range)
    crossed_by: Numbers = near[passed]
    return crossed_by


def _nearest_beams(bearing: Array, scan: Scan) -> tuple[Numbers, Array]:
    """The beams nearest to directions (n,) that are counted from the first beam, and their ranges; nan beyond them."""
    step, count = scan.angle_increment, len(scan.ranges)
    turn = round(2 * math.pi / abs(step))
    even = abs(turn * abs(step) - 2 * math.pi) < 1e-6
    if even and turn == count:
        beam = np.rint(bearing / step).astype(np.int64)
        return beam, scan.ranges.take(beam, mode="wrap")
    beam = np.rint((bearing % (2 * math.pi)) / step).astype(np.int64)
    if even:
        beam %= turn
    ranges = scan.ranges.take(beam, mode="clip")
    return beam, np.where((beam >= 0) & (beam < count), ranges, np.nan)
