"""What MPPI's rollouts are judged by: nav2_mppi_controller's critics, weights and powers as it ships them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.navigation import Goal
from simscen.stack.controllers.tracking import PathTracker
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import CostmapView

Floats = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

GOAL, GOAL_ANGLE, OBSTACLES, COLLISION = 5.0, 3.0, 1.5, 1000.0
PATH_ALIGN, PATH_FOLLOW, PATH_ANGLE, PREFER_FORWARD = 14.0, 5.0, 2.0, 5.0
NEAR_GOAL, AT_GOAL = 1.4, 0.5
"""Metres: from here on GoalCritic takes over from PathFollow; from here on GoalAngleCritic counts."""
ROOM, COMPARED = 0.03, 0.01
"""Metres: a rollout that comes nearer counts as a collision, unless the robot is that near already."""
EVERY = 4
"""Every which step is looked at by the obstacle and path critics (nav2: trajectory_point_step)."""
MARGIN = 0.25
"""Metres beyond the hull in which nearness costs."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories (n, steps): positions, headings, and the velocities that lead to them."""

    x: Floats
    y: Floats
    yaw: Floats
    vx: Floats
    wz: Floats


def score(
    rolled: Rollouts,
    track: PathTracker,
    pose: Pose2,
    costmap: CostmapView,
    goal: Goal,
    footprint: Footprint,
    fastest: float,
) -> tuple[Array, Mask]:
    """Costs (n,) and which rollouts (n,) hit something."""
    part = slice(EVERY - 1, None, EVERY)
    x, y, yaw = rolled.x[:, part], rolled.y[:, part], rolled.yaw[:, part]
    gap = footprint.discs.clearance(costmap, x, y, yaw)
    start = float(footprint.clearance(costmap, np.array([pose]))[0])
    hit: Mask = np.asarray((gap <= min(ROOM, start - COMPARED)).any(axis=1))
    cost = OBSTACLES * np.clip(1.0 - gap / MARGIN, 0.0, 1.0).mean(axis=1).astype(np.float64) + COLLISION * hit
    cost += PREFER_FORWARD * np.clip(-rolled.vx, 0.0, None).mean(axis=1)
    near = goal.pose.distance(pose)
    if near < NEAR_GOAL:
        cost += GOAL * np.hypot(x - goal.pose.x, y - goal.pose.y).mean(axis=1)
    else:
        cost += _path_critics(rolled, x, y, track, pose, fastest)
    if near < AT_GOAL:
        cost += GOAL_ANGLE * np.abs(_wrapped(yaw - np.float32(goal.pose.yaw))).mean(axis=1)
    return cost, hit


def _path_critics(rolled: Rollouts, x: Floats, y: Floats, track: PathTracker, pose: Pose2, fastest: float) -> Array:
    """PathFollow (get far), PathAlign (stay on it) and PathAngle (face it)."""
    reach = max(0.5, fastest * x.shape[1] * EVERY * 0.05)
    along = track.along[track.index]
    end = max(2, int(np.searchsorted(track.along, along + reach)) - track.index)
    ahead = track.points[track.index : track.index + end]
    target = ahead[-1]
    cost = PATH_FOLLOW * np.hypot(rolled.x[:, -1] - target[0], rolled.y[:, -1] - target[1]).astype(np.float64)
    sparse = ahead[::2]
    dx = x[:, :, None] - sparse[:, 0].astype(np.float32)
    dy = y[:, :, None] - sparse[:, 1].astype(np.float32)
    cost += PATH_ALIGN * np.sqrt((dx * dx + dy * dy).min(axis=2)).mean(axis=1)
    bearing = np.arctan2(target[1] - pose.y, target[0] - pose.x)
    if abs(_wrapped(np.array(bearing - pose.yaw))) > 1.0:
        cost += PATH_ANGLE * np.abs(_wrapped(rolled.yaw[:, -1] - np.float32(bearing)))
    return np.asarray(cost)


def _wrapped(angles: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
