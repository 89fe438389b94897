"""Data of one robot for the replay page: poses, scans, particles, plans, and costmaps.

Functions return JSON data. Long arrays are added to `columns`; the data contains references to them. Data that exceeds
a limit of this module is reduced, with a note on the page.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.goals import goal_without_loop
from simscen.core.records.case import Case
from simscen.core.records.trace import Samples, Trace
from simscen.core.records.verdict import Verdict
from simscen.model.scenario import ScenarioSpec
from simscen.record import frame_names
from simscen.record.log_reader import Log
from simscen.record.sensor_messages import LoggedMessages, SensorMessages
from simscen.report.display_text import one_line
from simscen.report.replay.packed_columns import PackedColumns, evenly_spaced_indices, indices_spaced_in_time
from simscen.report.replay.signal_plots import signal_limits, signal_plots
from simscen.report.replay.source_lines import SourceLines
from simscen.report.replay.stack_report import behavior_tree_data, log_lines_data, parameters_data

MAX_BEAMS, MAX_RANGES = 360, 300_000
"""Maximum number of beams per scan, and of ranges in all scans of a lidar."""
MAX_RANGE_M = 1e6
"""Upper limit of the maximum range of a lidar, because JSON has no infinity."""
MAX_PARTICLES, MAX_CLOUDS = 250, 300
"""Maximum number of particles per cloud, and of clouds per robot."""
MAX_PLAN_POINTS, MAX_PATH_POINTS = 120, 60_000
"""Maximum number of points per plan, and in all plans together. Plans are not reduced to fewer than 8 points."""
MAX_LOCAL_PLANS = 1500
"""Maximum number of local plans per robot."""
MAX_GRID_CELLS = 2_000_000
"""Maximum number of cells in all grids of a costmap topic."""
_POINT_STEP_M, _PARTICLE_YAW_STEP_RAD = 0.01, 0.02
"""Rounding steps of positions and ranges, and of the headings of particles."""


def _lidar(topic: str, messages: LoggedMessages, sensors: SensorMessages, columns: PackedColumns) -> dict[str, Any]:
    """Return the scans of one lidar, with the ticks at which the scans were received and measured.

    Scans whose number of beams differs from the first scan are omitted.
    """
    first = sensors.decode_scan(messages[0][1])
    stride = -(-max(1, len(first.ranges)) // MAX_BEAMS)
    beams = -(-len(first.ranges) // stride)
    indices = evenly_spaced_indices(len(messages), max(1, MAX_RANGES // max(1, beams))).tolist()
    scans = [(messages[k][0], sensors.decode_scan(messages[k][1])) for k in indices]
    scans = [(tick, scan) for tick, scan in scans if len(scan.ranges) == len(first.ranges)]
    columns.note_reduction(f"scans on {one_line(topic)}", len(scans), len(messages))
    columns.note_reduction(f"beams of a scan on {one_line(topic)}", beams, len(first.ranges))
    ranges = np.array([scan.ranges[::stride] for _, scan in scans])
    ranges[~np.isfinite(ranges)] = 0.0
    return {
        "name": one_line(topic),
        "mount": _rounded(first.mount),
        "first": round(first.angle_min, 6),
        "step": round(first.angle_increment * stride, 8),
        "least": round(first.range_min, 4),
        "most": round(min(first.range_max, MAX_RANGE_M), 4),
        "beams": beams,
        "ticks": columns.add([tick for tick, _ in scans]),
        "measured": columns.add([scan.tick if sensors.stamps_are_run_times else tick for tick, scan in scans]),
        "ranges": columns.add(ranges, _POINT_STEP_M),
    }


def _particles(sensors: SensorMessages, columns: PackedColumns) -> dict[str, Any] | None:
    """Return at most MAX_CLOUDS particle clouds with at most MAX_PARTICLES particles; None if the log has none."""
    if not sensors.particles:
        return None
    indices = evenly_spaced_indices(len(sensors.particles), MAX_CLOUDS).tolist()
    clouds = [(sensors.particles[k][0], sensors.decode_particles(sensors.particles[k][1])) for k in indices]
    subsets = [cloud[evenly_spaced_indices(len(cloud), MAX_PARTICLES)] for _, cloud in clouds]
    table = np.concatenate(subsets)
    columns.note_reduction("particle clouds", len(clouds), len(sensors.particles))
    columns.note_reduction("particles of a cloud", max(map(len, subsets)), max(len(cloud) for _, cloud in clouds))
    return {
        "ticks": columns.add([tick for tick, _ in clouds]),
        "numbers": columns.add([len(cloud) for cloud in subsets]),
        "x": columns.add(table[:, 0], _POINT_STEP_M),
        "y": columns.add(table[:, 1], _POINT_STEP_M),
        "yaw": columns.add(table[:, 2], _PARTICLE_YAW_STEP_RAD),
    }


def _local_plans(sensors: SensorMessages, columns: PackedColumns) -> dict[str, Any] | None:
    """Return the controller's local plans; None without local plans."""
    indices = evenly_spaced_indices(len(sensors.local_plans), MAX_LOCAL_PLANS).tolist()
    columns.note_reduction("local plans", len(indices), len(sensors.local_plans))
    messages = [sensors.local_plans[k] for k in indices]
    return _paths([(tick, sensors.decode_path(message)) for tick, message in messages], columns)


def _paths(paths: list[tuple[int, Array]], columns: PackedColumns) -> dict[str, Any] | None:
    """Return `paths`, pairs of a tick and positions (n, 2) in m, as JSON data; None without paths."""
    if not paths:
        return None
    max_points = max(8, min(MAX_PLAN_POINTS, MAX_PATH_POINTS // len(paths)))
    points = [path[evenly_spaced_indices(len(path), max_points)] for _, path in paths]
    table = np.concatenate(points)
    return {
        "ticks": columns.add([tick for tick, _ in paths]),
        "numbers": columns.add([len(path) for path in points]),
        "x": columns.add(table[:, 0], _POINT_STEP_M),
        "y": columns.add(table[:, 1], _POINT_STEP_M),
    }


def occupancy_grid_data(grid: OccupancyGrid, columns: PackedColumns) -> dict[str, Any]:
    """Return a grid with the cells in row-major order, as in nav_msgs/OccupancyGrid."""
    rows, width = grid.shape
    return {
        "width": width,
        "height": rows,
        "resolution": round(float(grid.resolution), 9),
        "origin": _rounded(grid.origin),
        "cells": columns.add(grid.cells),
    }


def costmaps_data(sensors: SensorMessages, trace: Trace, columns: PackedColumns) -> list[dict[str, Any]]:
    """Return the grids of each costmap topic in the map frame."""
    return [_costmap(topic, messages, sensors, trace, columns) for topic, messages in sorted(sensors.costmaps.items())]


def _costmap(
    topic: str, messages: LoggedMessages, sensors: SensorMessages, trace: Trace, columns: PackedColumns
) -> dict[str, Any]:
    """Return the grids of a topic. A grid with the origin and size of the previous grid is stored as differences."""
    _, first = sensors.decode_costmap(messages[0][1])
    indices = evenly_spaced_indices(len(messages), max(1, MAX_GRID_CELLS // max(1, first.cells.size))).tolist()
    columns.note_reduction(f"grids on {one_line(topic)}", len(indices), len(messages))
    grids = []
    previous: OccupancyGrid | None = None
    for tick, data in (messages[k] for k in indices):
        frame, grid = sensors.decode_costmap(data)
        is_same_grid = previous is not None and previous.shape == grid.shape and previous.origin == grid.origin
        cells = grid.cells.astype(np.int64) - previous.cells if previous is not None and is_same_grid else grid.cells
        origin = grid.origin if frame == frame_names.MAP else map_from_odom(trace, tick).compose(grid.origin)
        grid_data = occupancy_grid_data(OccupancyGrid(cells, grid.resolution, origin), columns)
        grids.append({"tick": tick, "changes": is_same_grid, **grid_data})
        previous = grid
    return {"name": one_line(topic), "grids": grids}


def map_from_odom(trace: Trace, tick: int) -> Pose2:
    """Return the pose of the odom frame in the map frame, from the newest belief at `tick`.

    Without belief or odometry, or if one of the two poses is not finite, return the identity.
    """
    if not len(trace.belief) or not len(trace.odometry):
        return Pose2(0.0, 0.0)
    newest = trace.belief.ticks[max(int(np.searchsorted(trace.belief.ticks, tick, side="right")) - 1, 0)]
    ticks = np.array([newest])
    belief, odometry = (samples.at(ticks)[0, :3] for samples in (trace.belief, trace.odometry))
    if not (np.isfinite(belief).all() and np.isfinite(odometry).all()):
        return Pose2(0.0, 0.0)
    return Pose2(*belief.tolist()).compose(Pose2(*odometry.tolist()).inverse())


def _rounded(pose: Sequence[float]) -> list[float]:
    """Return x, y, and yaw of a pose with six decimal places."""
    return [round(float(part), 6) for part in pose]


MAX_POSES = 12_000
"""Maximum number of poses per robot: five minutes at 40 Hz."""
POSITION_STEP_M, YAW_STEP_RAD = 1e-3, 1e-3
"""Rounding steps of the poses of robots and objects."""


def robot_data(
    name: str,
    log: Log,
    lines: SourceLines,
    spec: ScenarioSpec | None,
    verdicts: tuple[Verdict, ...],
    columns: PackedColumns,
) -> dict[str, Any]:
    """Return the data of one robot.

    `name` is "" for a single robot. `lines` are line numbers in the scenario file. `spec` is the specification of the
    scenario, for plots of the signals in temporal criteria; None if the scenario is invalid.
    """
    trace, case = log.trace, log.header.case
    return {
        "name": one_line(name),
        "footprint": [[round(x, 4), round(y, 4)] for x, y in case.footprint],
        "start": [round(part, 4) for part in case.start],
        "goals": _goals(case, lines),
        "truth": _poses(trace.truth, columns),
        "belief": _belief(trace.belief, columns),
        "map": None if log.header.map is None else occupancy_grid_data(log.header.map, columns),
        "scans": [_lidar(*scans, log.sensors, columns) for scans in sorted(log.sensors.scans.items()) if scans[1]],
        "particles": _particles(log.sensors, columns),
        "plans": _paths([(plan.tick, plan.points[:, :2]) for plan in trace.plans], columns),
        "local": _local_plans(log.sensors, columns),
        "costmaps": costmaps_data(log.sensors, trace, columns),
        "tree": behavior_tree_data(log, columns),
        "lines": log_lines_data(log, columns),
        "parameters": parameters_data(log, columns),
        "clock": columns.add(trace.truth.ticks),
        "strips": signal_plots(trace, case, spec, columns),
        "limits": signal_limits(verdicts, name),
    }


def _goals(case: Case, lines: SourceLines) -> list[dict[str, Any]]:
    """Return each goal once, even if the robot drives to the goal in several loops."""
    goals: dict[tuple[str, float, float], dict[str, Any]] = {}
    for goal in case.every_goal:
        base = goal_without_loop(goal.name)
        goals.setdefault(
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
    return list(goals.values())


def _poses(samples: Samples, columns: PackedColumns) -> dict[str, Any]:
    """Return at most MAX_POSES poses with their ticks. Headings are unwrapped."""
    indices = evenly_spaced_indices(len(samples), MAX_POSES)
    columns.note_reduction("poses", len(indices), len(samples))
    x, y, yaw = samples.values[indices, :3].T
    return {
        "ticks": columns.add(samples.ticks[indices]),
        "x": columns.add(x, POSITION_STEP_M),
        "y": columns.add(y, POSITION_STEP_M),
        "yaw": columns.add(np.unwrap(yaw) if np.isfinite(yaw).all() else yaw, YAW_STEP_RAD),
    }


def _belief(samples: Samples, columns: PackedColumns) -> dict[str, Any] | None:
    """Return the estimated poses with their covariances; None without estimates."""
    if not len(samples):
        return None
    indices = evenly_spaced_indices(len(samples), MAX_POSES)
    xx, xy, _, yy, _, aa = samples.values[indices, 3:9].T
    covariance = {"xx": xx, "xy": xy, "yy": yy, "aa": aa}
    return {**_poses(samples, columns), **{key: columns.add(part, 1e-5) for key, part in covariance.items()}}


def moving_objects(trace: Trace, columns: PackedColumns, robots: frozenset[str]) -> list[dict[str, Any]]:
    """Return the poses of moving objects, at most 20 per second. `robots` are the names of objects to omit."""
    objects = []
    for name, samples in sorted(trace.objects.items()):
        if name in robots or not len(samples):
            continue
        indices = indices_spaced_in_time(samples.ticks, max(1, trace.tick_rate // 20))
        objects.append({"name": one_line(name), **_poses(samples.select(indices), columns)})
    return objects
