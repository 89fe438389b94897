"""What a robot saw and thought of: scans, particles, plans, costmaps; as many as the page has room for."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.core.records.case import Case
from simscen.core.records.trace import Samples, Trace
from simscen.core.records.verdict import Verdict
from simscen.model.scenario import ScenarioSpec
from simscen.record import frame_names
from simscen.record.log_reader.read import Log
from simscen.record.log_reader.sensor_messages import LoggedMessages, SensorMessages
from simscen.report.display_text import one_line
from simscen.report.replay.packed_columns import PackedColumns, evenly_spaced, spaced_in_time
from simscen.report.replay.signal_plots import signal_limits, signal_plots
from simscen.report.replay.source_lines import SourceLines

MAX_BEAMS, MAX_RANGES = 360, 300_000
"""Beams of a scan that are kept, and ranges of a lidar in all."""
MAX_PARTICLES, MAX_CLOUDS = 250, 300
MAX_PLAN_POINTS, MAX_PATH_POINTS = 120, 60_000
MAX_LOCAL_PLANS = 1500
MAX_GRID_CELLS = 2_000_000
_CENTIMETER = 0.01


def scans_of(seen: SensorMessages, columns: PackedColumns) -> list[dict[str, Any]]:
    """Each lidar's scans: `ticks` at which the stack got them, `measured` when they were taken."""
    return [_lidar(topic, messages, seen, columns) for topic, messages in sorted(seen.scans.items()) if messages]


def _lidar(topic: str, messages: LoggedMessages, seen: SensorMessages, columns: PackedColumns) -> dict[str, Any]:
    first = seen.scan(messages[0][1])
    stride = -(-max(1, len(first.ranges)) // MAX_BEAMS)
    beams = -(-len(first.ranges) // stride)
    kept = evenly_spaced(len(messages), max(1, MAX_RANGES // max(1, beams))).tolist()
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


def particles_of(seen: SensorMessages, columns: PackedColumns) -> dict[str, Any] | None:
    """Clouds of particles, each thinned to an even choice of them."""
    if not seen.particles:
        return None
    kept = evenly_spaced(len(seen.particles), MAX_CLOUDS).tolist()
    clouds = [(seen.particles[k][0], seen.cloud(seen.particles[k][1])) for k in kept]
    chosen = [cloud[evenly_spaced(len(cloud), MAX_PARTICLES)] for _, cloud in clouds]
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


def plans_of(plans: Sequence[Path], columns: PackedColumns) -> dict[str, Any] | None:
    """The plans, by when they were made."""
    return _paths([(plan.tick, plan.points[:, :2]) for plan in plans], columns)


def local_plans_of(seen: SensorMessages, columns: PackedColumns) -> dict[str, Any] | None:
    """What the controller meant to drive next."""
    kept = evenly_spaced(len(seen.local_plans), MAX_LOCAL_PLANS).tolist()
    columns.thinned("local plans", len(kept), len(seen.local_plans))
    return _paths([(seen.local_plans[k][0], seen.path(seen.local_plans[k][1])) for k in kept], columns)


def _paths(paths: list[tuple[int, Array]], columns: PackedColumns) -> dict[str, Any] | None:
    if not paths:
        return None
    most = max(8, min(MAX_PLAN_POINTS, MAX_PATH_POINTS // len(paths)))
    points = [path[evenly_spaced(len(path), most)] for _, path in paths]
    table = np.concatenate(points)
    return {
        "ticks": columns.add([tick for tick, _ in paths]),
        "numbers": columns.add([len(path) for path in points]),
        "x": columns.add(table[:, 0], _CENTIMETER),
        "y": columns.add(table[:, 1], _CENTIMETER),
    }


def grid_of(grid: OccupancyGrid, columns: PackedColumns) -> dict[str, Any]:
    """A map, row by row from its lowest."""
    rows, width = grid.shape
    return {
        "width": width,
        "height": rows,
        "resolution": round(float(grid.resolution), 9),
        "origin": _rounded(grid.origin),
        "cells": columns.add(grid.cells),
    }


def costmaps_of(seen: SensorMessages, trace: Trace, columns: PackedColumns) -> list[dict[str, Any]]:
    """The costmaps as the log has them, as often as there is room for; in the map frame, wherever they live."""
    return [_costmap(topic, messages, seen, trace, columns) for topic, messages in sorted(seen.costmaps.items())]


def _costmap(
    topic: str, messages: LoggedMessages, seen: SensorMessages, trace: Trace, columns: PackedColumns
) -> dict[str, Any]:
    """Each grid whole, or its differences to the one before where that is of the same place."""
    _, first = seen.costmap(messages[0][1])
    kept = evenly_spaced(len(messages), max(1, MAX_GRID_CELLS // max(1, first.cells.size))).tolist()
    columns.thinned(f"grids on {one_line(topic)}", len(kept), len(messages))
    grids = []
    before: OccupancyGrid | None = None
    for tick, data in (messages[k] for k in kept):
        frame, grid = seen.costmap(data)
        same = before is not None and before.shape == grid.shape and before.origin == grid.origin
        cells = grid.cells.astype(np.int64) - before.cells if before is not None and same else grid.cells
        origin = grid.origin if frame == frame_names.MAP else map_from_odom(trace, tick).compose(grid.origin)
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


MAX_POSES = 12_000
"""Poses of a robot: five minutes at 40 Hz."""
MILLIMETER, MILLIRADIAN = 1e-3, 1e-3


def robot_data(
    name: str,
    log: Log,
    lines: SourceLines,
    spec: ScenarioSpec | None,
    verdicts: tuple[Verdict, ...],
    columns: PackedColumns,
) -> dict[str, Any]:
    """One robot; `name` is "" for the only one."""
    trace, case = log.trace, log.about.case
    return {
        "name": one_line(name),
        "footprint": [[round(x, 4), round(y, 4)] for x, y in case.footprint],
        "start": [round(part, 4) for part in case.start],
        "goals": _goals(case, lines),
        "truth": _poses(trace.truth, columns),
        "belief": _belief(trace.belief, columns),
        "map": None if log.about.map is None else grid_of(log.about.map, columns),
        "scans": scans_of(log.seen, columns),
        "particles": particles_of(log.seen, columns),
        "plans": plans_of(trace.plans, columns),
        "local": local_plans_of(log.seen, columns),
        "costmaps": costmaps_of(log.seen, trace, columns),
        "clock": columns.add(trace.truth.ticks),
        "strips": signal_plots(trace, case, spec, columns),
        "limits": signal_limits(verdicts, name),
    }


def _goals(case: Case, lines: SourceLines) -> list[dict[str, Any]]:
    """Each goal once: a further loop comes to the same place."""
    found: dict[tuple[str, float, float], dict[str, Any]] = {}
    for goal in case.every_goal:
        base = goal.name.partition("#")[0] if goal.name.partition("#")[0] in lines.goals else goal.name
        found.setdefault(
            (base, goal.pose.x, goal.pose.y),
            {
                "name": one_line(base),
                "pose": [round(part, 4) for part in goal.pose],
                "xy": round(goal.xy_tolerance, 4),
                "yaw": round(min(goal.yaw_tolerance, np.pi), 4),
                "via": goal.via,
                "line": lines.goals.get(base, 0),
            },
        )
    return list(found.values())


def _poses(samples: Samples, columns: PackedColumns) -> dict[str, Any]:
    kept = evenly_spaced(len(samples), MAX_POSES)
    columns.thinned("poses", len(kept), len(samples))
    x, y, yaw = samples.values[kept, :3].T
    return {
        "ticks": columns.add(samples.ticks[kept]),
        "x": columns.add(x, MILLIMETER),
        "y": columns.add(y, MILLIMETER),
        "yaw": columns.add(np.unwrap(yaw) if np.isfinite(yaw).all() else yaw, MILLIRADIAN),
    }


def _belief(samples: Samples, columns: PackedColumns) -> dict[str, Any] | None:
    if not len(samples):
        return None
    kept = evenly_spaced(len(samples), MAX_POSES)
    xx, xy, _, yy, _, aa = samples.values[kept, 3:9].T
    more = {"xx": (xx, 1e-5), "xy": (xy, 1e-5), "yy": (yy, 1e-5), "aa": (aa, 1e-5)}
    return {**_poses(samples, columns), **{key: columns.add(part, step) for key, (part, step) in more.items()}}


def moving_objects(trace: Trace, columns: PackedColumns, besides: frozenset[str]) -> list[dict[str, Any]]:
    """Things that move, by name; their poses at most twenty times a second."""
    found = []
    for name, samples in sorted(trace.objects.items()):
        if name in besides or not len(samples):
            continue
        kept = spaced_in_time(samples.ticks, max(1, trace.tick_rate // 20))
        found.append({"name": one_line(name), **_poses(Samples(samples.ticks[kept], samples.values[kept]), columns)})
    return found
