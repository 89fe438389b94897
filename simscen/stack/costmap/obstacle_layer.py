"""Obstacles that a lidar sees: nav2_costmap_2d's obstacle layer, without a loop over beams or cells.

Nav2 walks along every beam. Here only the cells that are marked now are asked whether a beam passes through them,
which is the same question and a hundred times fewer cells.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Scan
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.costmap.frame import Cells, Frame


@dataclass(frozen=True, eq=False)
class ScanAmongMoving(Scan):
    """A scan of which some beams, `moving` (n,), hit what will be somewhere else: it clears as any, and marks less."""

    moving: npt.NDArray[np.bool_] = field(kw_only=True)


def hits(scan: Scan, base: Pose2, nearest: float, farthest: float) -> Array:
    """Map points (n, 2) of the beams that hit something that stands, `nearest` to `farthest` metres from the lidar."""
    ranges = scan.ranges
    use = (ranges >= max(scan.range_min, nearest)) & (ranges <= min(scan.range_max, farthest))
    if isinstance(scan, ScanAmongMoving):
        use &= ~scan.moving
    lidar, beams = base.compose(scan.mount), use.nonzero()[0]
    ranges, angles = ranges[beams], scan.angle_min + scan.angle_increment * beams + lidar.yaw
    points = np.empty((len(beams), 2))
    points[:, 0], points[:, 1] = lidar.x + ranges * np.cos(angles), lidar.y + ranges * np.sin(angles)
    return points


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


def crossed(points: Array, resolution: float, scan: Scan, base: Pose2, spec: CostmapSpec) -> npt.NDArray[np.bool_]:
    """Which of the cells with these centres (n, 2) a beam crosses before it hits anything.

    A line crosses a square of half-width h when its distance from the centre is at most h (|cos| + |sin|); each cell
    is tested against the beam nearest to its centre, which crosses it if any does.
    """
    lidar = base.compose(scan.mount)
    dx, dy = points[:, 0] - lidar.x, points[:, 1] - lidar.y
    distance, bearing = np.hypot(dx, dy), np.arctan2(dy, dx)
    step = scan.angle_increment
    place = ((bearing - lidar.yaw - scan.angle_min) % (2 * math.pi)) / step
    beam = np.rint(place).astype(np.int64)
    off = (place - beam) * step
    turn = round(2 * math.pi / abs(step))
    if abs(turn * abs(step) - 2 * math.pi) < 1e-6:
        beam %= turn
    count = len(scan.ranges)
    ranges = scan.ranges.take(beam, mode="clip")
    if beam.min() < 0 or beam.max() >= count:
        ranges = np.where((beam >= 0) & (beam < count), ranges, np.nan)  # nobody looks there
    length = _shown_free(ranges, scan, spec)
    passes = np.zeros(len(points), dtype=bool)
    near = (distance * math.cos(step / 2) <= length).nonzero()[0]  # most cells lie behind what their beams hit
    if not len(near):
        return passes
    bearing, off, distance, length = bearing[near], off[near], distance[near], length[near]
    direction = bearing - off
    half = resolution / 2
    reach = half * (np.abs(np.cos(direction)) + np.abs(np.sin(direction)))
    along = distance * np.cos(off)
    passes[near] = (
        (np.abs(distance * np.sin(off)) <= reach) & (along <= length - half) & (along >= spec.raytrace_min_range)
    )
    return passes
