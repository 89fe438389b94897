"""What a robot saw and thought of: scans, particles, plans, costmaps; as many as the page has room for."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Trace
from simscen.record import frames
from simscen.record.seen import Messages, Seen
from simscen.report.replay.columns import Columns
from simscen.report.replay.thin import evenly
from simscen.report.text import one_line

BEAMS, RANGES = 360, 300_000
"""Beams of a scan that are kept, and ranges of a lidar in all."""
PARTICLES, CLOUDS = 250, 300
PLAN_POINTS, POINTS = 120, 60_000
LOCAL_PLANS = 1500
CELLS = 2_000_000
_CENTIMETER = 0.01


def scans_of(seen: Seen, columns: Columns) -> list[dict[str, Any]]:
    """Each lidar's scans: `ticks` at which the stack got them, `measured` when they were taken."""
    return [_lidar(topic, messages, seen, columns) for topic, messages in sorted(seen.scans.items()) if messages]


def _lidar(topic: str, messages: Messages, seen: Seen, columns: Columns) -> dict[str, Any]:
    first = seen.scan(messages[0][1])
    stride = -(-max(1, len(first.ranges)) // BEAMS)
    beams = -(-len(first.ranges) // stride)
    kept = evenly(len(messages), max(1, RANGES // max(1, beams))).tolist()
    scans = [(messages[k][0], seen.scan(messages[k][1])) for k in kept]
    scans = [(tick, scan) for tick, scan in scans if len(scan.ranges) == len(first.ranges)]
    columns.thinned(f"scans on {one_line(topic)}", len(scans), len(messages))
    columns.thinned(f"beams of a scan on {one_line(topic)}", beams, len(first.ranges))
    ranges = np.array([scan.ranges[::stride] for _, scan in scans])
    ranges[~np.isfinite(ranges)] = 0.0
    return {
        "name": one_line(topic),
        "mount": _rounded(first.mount),
        "first": round(first.angle_min, 6),
        "step": round(first.angle_increment * stride, 8),
        "least": round(first.range_min, 4),
        "most": round(first.range_max, 4),
        "beams": beams,
        "ticks": columns.add([tick for tick, _ in scans]),
        "measured": columns.add([scan.tick if seen.stamped else tick for tick, scan in scans]),
        "ranges": columns.add(ranges, _CENTIMETER),
    }


def particles_of(seen: Seen, columns: Columns) -> dict[str, Any] | None:
    """Clouds of particles, each thinned to an even choice of them."""
    if not seen.particles:
        return None
    kept = evenly(len(seen.particles), CLOUDS).tolist()
    clouds = [(seen.particles[k][0], seen.cloud(seen.particles[k][1])) for k in kept]
    chosen = [cloud[evenly(len(cloud), PARTICLES)] for _, cloud in clouds]
    table = np.concatenate(chosen)
    columns.thinned("particle clouds", len(clouds), len(seen.particles))
    columns.thinned("particles of a cloud", max(map(len, chosen)), max(len(cloud) for _, cloud in clouds))
    return {
        "ticks": columns.add([tick for tick, _ in clouds]),
        "numbers": columns.add([len(cloud) for cloud in chosen]),
        "x": columns.add(table[:, 0], _CENTIMETER),
        "y": columns.add(table[:, 1], _CENTIMETER),
        "yaw": columns.add(table[:, 2], 0.02),
    }


def plans_of(plans: Sequence[Path], columns: Columns) -> dict[str, Any] | None:
    """The plans, by when they were made."""
    return _paths([(plan.tick, plan.points[:, :2]) for plan in plans], columns)


def local_plans_of(seen: Seen, columns: Columns) -> dict[str, Any] | None:
    """What the controller meant to drive next."""
    kept = evenly(len(seen.local_plans), LOCAL_PLANS).tolist()
    columns.thinned("local plans", len(kept), len(seen.local_plans))
    return _paths([(seen.local_plans[k][0], seen.path(seen.local_plans[k][1])) for k in kept], columns)


def _paths(paths: list[tuple[int, Array]], columns: Columns) -> dict[str, Any] | None:
    if not paths:
        return None
    most = max(8, min(PLAN_POINTS, POINTS // len(paths)))
    points = [path[evenly(len(path), most)] for _, path in paths]
    table = np.concatenate(points)
    return {
        "ticks": columns.add([tick for tick, _ in paths]),
        "numbers": columns.add([len(path) for path in points]),
        "x": columns.add(table[:, 0], _CENTIMETER),
        "y": columns.add(table[:, 1], _CENTIMETER),
    }


def grid_of(grid: OccupancyGrid, columns: Columns) -> dict[str, Any]:
    """A map, row by row from its lowest."""
    rows, width = grid.shape
    return {
        "width": width,
        "height": rows,
        "resolution": round(float(grid.resolution), 9),
        "origin": _rounded(grid.origin),
        "cells": columns.add(grid.cells),
    }


def costmaps_of(seen: Seen, trace: Trace, columns: Columns) -> list[dict[str, Any]]:
    """The costmaps as the log has them, as often as there is room for; in the map frame, wherever they live."""
    return [_costmap(topic, messages, seen, trace, columns) for topic, messages in sorted(seen.costmaps.items())]


def _costmap(topic: str, messages: Messages, seen: Seen, trace: Trace, columns: Columns) -> dict[str, Any]:
    """Each grid whole, or its differences to the one before where that is of the same place."""
    _, first = seen.costmap(messages[0][1])
    kept = evenly(len(messages), max(1, CELLS // max(1, first.cells.size))).tolist()
    columns.thinned(f"grids on {one_line(topic)}", len(kept), len(messages))
    grids = []
    before: OccupancyGrid | None = None
    for tick, data in (messages[k] for k in kept):
        frame, grid = seen.costmap(data)
        same = before is not None and before.shape == grid.shape and before.origin == grid.origin
        cells = grid.cells.astype(np.int64) - before.cells if before is not None and same else grid.cells
        origin = grid.origin if frame == frames.MAP else map_from_odom(trace, tick).compose(grid.origin)
        told = grid_of(OccupancyGrid(cells, grid.resolution, origin), columns)
        grids.append({"tick": tick, "changes": same, **told})
        before = grid
    return {"name": one_line(topic), "grids": grids}


def map_from_odom(trace: Trace, tick: int) -> Pose2:
    """The correction of the newest belief; none for a robot without belief or odometry."""
    if not len(trace.belief) or not len(trace.odometry):
        return Pose2(0.0, 0.0)
    newest = trace.belief.ticks[max(int(np.searchsorted(trace.belief.ticks, tick, side="right")) - 1, 0)]
    at = np.array([newest])
    believed, rolled = Pose2(*trace.belief.at(at)[0, :3].tolist()), Pose2(*trace.odometry.at(at)[0, :3].tolist())
    return believed.compose(rolled.inverse())


def _rounded(pose: Sequence[float]) -> list[float]:
    return [round(float(part), 6) for part in pose]
