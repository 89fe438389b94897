"""Log of a robot with a lidar, odometry, and AMCL, written with rosbags from its own message definitions."""

import functools
import sys
from pathlib import Path

import numpy as np
import synthetic_drives as drives

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
import foreign_logs as logs

LIDAR_SILENT = (8.0, 9.5)
"""Begin and end of the time in s in which the log has no scans."""
GOAL = (6.9, 2.9)
"""Position of the goal in the map frame, in m."""


def walk(time):
    """Return the position at a time in s of a person who crosses the path of the robot."""
    return 5.0, 0.8 + 0.4 * time


@functools.cache
def scans(with_person):
    return drives.scans((lambda time: [drives.body(*walk(time), 0.0, (0.25,))]) if with_person else None)


def messages(with_map=True, with_goal=True, idle=0.0, with_person=False):
    """Return the log of a robot with a lidar, odometry, and AMCL. It stands for `idle` s before it gets its goal."""
    measured = scans(with_person)
    times = np.arange(0.0, drives.DURATION_S, 0.05)
    poses = drives.poses(times)
    rng = np.random.default_rng(7)
    recorded = []

    def add(topic, time, message):
        recorded.append(logs.Message(topic, logs.BEGIN + round((time + idle) * logs.SECOND) + 5_000_000, message))

    def stamp(time):
        return logs.BEGIN + round((time + idle) * logs.SECOND)

    add("/tf_static", -idle, logs.link(stamp(-idle), "base_link", "lidar", 0.0))
    if with_map:
        add("/map", -idle, occupancy_grid(stamp(-idle)))
    if with_goal:
        add("/goal_pose", 0.0, goal(stamp(0.0)))
    standing = [(-1.0 * wait, poses[0]) for wait in np.arange(idle, 0.0, -0.05).tolist()]
    for time, (x, y, yaw) in [*standing, *zip(times.tolist(), poses, strict=True)]:
        add("/odom", time, odometry(stamp(time), x - 1.0, y - 3.0, yaw))
        if round(time * 20) % 4 == 0:
            add("/amcl_pose", time, amcl_pose(stamp(time), x + rng.normal(0, 0.01), y + rng.normal(0, 0.01), yaw))
    for time, ranges in zip(measured.times.tolist(), measured.ranges, strict=True):
        if not LIDAR_SILENT[0] <= time < LIDAR_SILENT[1]:
            add("/scan", time, scan(stamp(time), ranges))
    return sorted(recorded, key=lambda entry: entry.time)


def occupancy_grid(time):
    grid = drives.room().grid
    T = logs.T
    info = T["nav_msgs/msg/MapMetaData"](
        map_load_time=logs.stamp_of(0), resolution=grid.resolution, width=grid.shape[1], height=grid.shape[0],
        origin=logs.pose(grid.origin.x, grid.origin.y),
    )  # fmt: skip
    return T["nav_msgs/msg/OccupancyGrid"](header=logs.header(time, "map"), info=info, data=grid.cells.reshape(-1))


def goal(time):
    return logs.T["geometry_msgs/msg/PoseStamped"](header=logs.header(time, "map"), pose=logs.pose(*GOAL))


def odometry(time, x, y, yaw):
    message = logs.odometry(time, "odom", x, drives.SPEED_M_S)
    message.pose.pose = logs.pose(x, y, yaw)
    return message


def amcl_pose(time, x, y, yaw):
    message = logs.estimated_pose(time, x)
    message.pose.pose = logs.pose(x, y, yaw)
    return message


def scan(time, ranges):
    return logs.T["sensor_msgs/msg/LaserScan"](
        header=logs.header(time, "lidar"), angle_min=float(drives.ANGLES[0]), angle_max=float(drives.ANGLES[-1]),
        angle_increment=float(drives.ANGLES[1] - drives.ANGLES[0]), time_increment=0.0, scan_time=0.1,
        range_min=0.12, range_max=12.0, ranges=ranges.astype(np.float32), intensities=np.zeros(0, dtype=np.float32),
    )  # fmt: skip
