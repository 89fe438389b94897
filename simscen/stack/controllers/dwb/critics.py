"""Critics of DWB, which score trajectories and reject illegal ones (dwb_critics). Lower scores are better.

Raw scores are in cells, costs, rad, or rad/s. They are multiplied by the scale of the critic. As in Nav2, the scales of
critics that count cells are also multiplied by half the resolution.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap, wrap_array
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.collision_checker import APPROACH_TOLERANCE_M, UNCERTAINTY_SIGMAS
from simscen.stack.controllers.dwb.trajectory_generator import Trajectories
from simscen.stack.costmap.grid_frame import Cells
from simscen.stack.footprint import Footprint
from simscen.stack.moving_obstacles import Mask, MovingObstacles
from simscen.stack.protocols import NO_INFORMATION, CostmapView

BATCH_TRAJECTORIES = 50
"""Number of trajectories that are checked for collisions at once."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of n trajectories.

    raw:    raw scores (n,) by critic
    scale:  factor of the raw scores by critic
    legal:  whether each trajectory (n,) is legal, or rejected
    """

    raw: dict[str, Array]
    scale: dict[str, float]
    legal: Mask

    @property
    def total(self) -> Array:
        """Sum (n,) of the scaled scores of all critics; inf for rejected trajectories."""
        total = np.zeros(len(self.legal))
        for name, raw in self.raw.items():
            total += self.scale[name] * raw
        return np.where(self.legal, total, np.inf)


def score_trajectories(
    spec: DwbSpec, costmap: CostmapView, pose: Pose2, goal: Pose2, plan: Array, velocities: Array, ends: Array
) -> Scores:
    """Return the scores of trajectories with these velocities (n, 3) and final poses `ends` (n, 3).

    `pose` is the pose of the robot. `plan` (m, 2) is not empty. A trajectory is rejected if its end is outside the
    costmap. If an alignment critic is enabled, the point `forward_point_distance` ahead of the end counts as well.
    """
    forward_distance = spec.forward_point_distance
    forward = ends[:, :2] + forward_distance * np.column_stack((np.cos(ends[:, 2]), np.sin(ends[:, 2])))
    end_cells, end_on_map = cells_of(costmap, ends[:, :2])
    forward_cells, forward_on_map = cells_of(costmap, forward)
    is_near_goal = pose.distance(goal) <= forward_distance
    cell_scale = 0.5 * costmap.resolution
    scale = {
        "BaseObstacle": spec.base_obstacle_scale,
        "GoalAlign": cell_scale * spec.goal_align_scale,
        "PathAlign": 0.0 if is_near_goal else cell_scale * spec.path_align_scale,
        "PathDist": cell_scale * spec.path_dist_scale,
        "GoalDist": cell_scale * spec.goal_dist_scale,
        "Twirling": spec.twirling_scale,
    }
    path = plan_cells(costmap, plan)
    extended_path = plan_cells(costmap, _extend_beyond_goal(plan, pose, goal, forward_distance))
    legal = end_on_map & (forward_on_map if scale["GoalAlign"] or scale["PathAlign"] else True)
    rows, columns = np.clip(end_cells.T, 0, np.array(costmap.costs.shape)[:, None] - 1)
    raw = {
        "BaseObstacle": costmap.costs[rows, columns].astype(np.float64),
        "GoalAlign": manhattan_distances(forward_cells, extended_path[-1:]),
        "PathAlign": manhattan_distances(forward_cells, path),
        "PathDist": manhattan_distances(end_cells, path),
        "GoalDist": manhattan_distances(end_cells, path[-1:]),
        "Twirling": np.abs(velocities[:, 2]),
    }
    return Scores(raw, scale, legal)


def _extend_beyond_goal(plan: Array, pose: Pose2, goal: Pose2, distance: float) -> Array:
    """Return the plan (m, 2) with its last point moved by `distance` m in the direction from the robot to the goal."""
    angle = np.arctan2(goal.y - pose.y, goal.x - pose.x)
    extended = plan.copy()
    extended[-1] += distance * np.array((np.cos(angle), np.sin(angle)))
    return np.asarray(extended)


def cells_of(costmap: CostmapView, points: Array) -> tuple[Cells, Mask]:
    """Return the cells (n, 2) as (row, column) at points (n, 2), and which of the cells are on the costmap."""
    cells = np.floor((points[:, ::-1] - np.array(costmap.origin)[::-1]) / costmap.resolution).astype(np.int64)
    on_map: Mask = np.asarray(((cells >= 0) & (cells < np.array(costmap.costs.shape))).all(axis=1))
    return cells, on_map


def plan_cells(costmap: CostmapView, plan: Array) -> Cells:
    """Return the cells (m, 2) of the first uninterrupted part of the plan (n, 2) on known cells of the costmap."""
    cells, on_map = cells_of(costmap, plan)
    known = on_map.copy()
    known[on_map] = costmap.costs[cells[on_map, 0], cells[on_map, 1]] != NO_INFORMATION
    if not known.any():
        return cells[:0]
    first = int(known.argmax())
    unknown = np.flatnonzero(~known[first:])
    return cells[first : first + int(unknown[0])] if len(unknown) else cells[first:]


def manhattan_distances(cells: Cells, sources: Cells) -> Array:
    """Return Manhattan distances (n,) in cells from cells (n, 2) to the nearest source (m, 2); 0 without sources.

    Nav2's MapGridCritic propagates the same distances from cell to cell.
    """
    if not len(sources):
        return np.zeros(len(cells))
    distances = np.abs(cells[:, None, 0] - sources[None, :, 0]) + np.abs(cells[:, None, 1] - sources[None, :, 1])
    return np.asarray(distances.min(axis=1), dtype=np.float64)


class RotateToGoalCritic:
    """Critic at the goal, which scores the heading error. The robot must slow down to a stop, and rotate in place."""

    def __init__(self, stopped_velocity: float, slowing_factor: float) -> None:
        """Take Nav2's trans_stopped_velocity in m/s and slowing_factor."""
        self._stopped_velocity, self._slowing_factor = stopped_velocity, slowing_factor
        self.reset()

    def reset(self) -> None:
        """Prepare for a new goal."""
        self._is_rotating = False

    def scores(self, current: Twist, goal_yaw: float, velocities: Array, end_yaws: Array) -> tuple[Array, Mask]:
        """Return the scores (n,) of velocities (n, 3), and whether each velocity is legal.

        The velocities lead to the headings `end_yaws` (n,). `current` is the current velocity.
        """
        speed = math.hypot(current.vx, current.vy)
        self._is_rotating |= speed <= self._stopped_velocity
        squared_speed = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        angle = np.abs(wrap_array(end_yaws - goal_yaw))
        if self._is_rotating:
            return angle, np.asarray(squared_speed == 0.0)
        return np.asarray(squared_speed * self._slowing_factor + angle), np.asarray(squared_speed < speed**2)


class ObstacleCritic:
    """Critic that selects a trajectory free of static and moving obstacles (dwb_critics' ObstacleFootprint)."""

    def __init__(self, footprint: Footprint, preferred_clearance: float) -> None:
        """Take the footprint, and the clearance in m that trajectories should have if possible."""
        self._footprint, self._preferred_clearance = footprint, preferred_clearance

    def first_free(
        self, costmap: CostmapView, pose: Pose2, trajectories: Trajectories, order: npt.NDArray[np.intp]
    ) -> int | None:
        """Return the index of the best free trajectory among the indices in `order` (k,); None if none is free.

        A trajectory with the preferred clearance is better than one without. Among these, a trajectory is better the
        later it meets a moving obstacle, and then the earlier it is in `order`. If the robot is in collision, and if no
        trajectory is free, a trajectory that leads out of the collision counts as free.
        """
        if len(costmap.moving):
            meeting_times = self._meeting_times(costmap.moving, trajectories, order)
            order = order[np.argsort(-meeting_times, kind="stable")]
        clearance = np.empty((len(trajectories.x), len(order)), np.float32)
        for start in range(0, len(order), BATCH_TRAJECTORIES):
            batch = slice(start, start + BATCH_TRAJECTORIES)
            poses = np.moveaxis(trajectories.poses(order[batch]), -1, 0)
            clearance[:, batch] = self._footprint.discs.clearance(costmap, *poses)
            has_clearance = (clearance[:, batch] > self._preferred_clearance).all(axis=0)
            if has_clearance.any():
                return int(order[start + int(has_clearance.argmax())])
        free = (clearance > 0.0).all(axis=0)
        if not free.any():
            poses = trajectories.poses(order).reshape(-1, 3)
            free = self._footprint.free(costmap, poses).reshape(clearance.shape).all(axis=0)
        if not free.any() and self._footprint.clearance(costmap, np.array([pose]))[0] <= 0.0:
            comes_no_closer = (clearance >= clearance[0]).all(axis=0)
            free = comes_no_closer & (clearance[-1] > clearance[0] + 0.5 * costmap.resolution)
        return int(order[int(free.argmax())]) if free.any() else None

    def _meeting_times(self, moving: MovingObstacles, trajectories: Trajectories, order: npt.NDArray[np.intp]) -> Array:
        """Return the times (k,) in s at which the trajectories in `order` meet a moving obstacle, or inf."""
        times = trajectories.times[:, trajectories.yaw_index[order]]
        gaps = self._footprint.gap(moving, trajectories.poses(order), times, UNCERTAINTY_SIGMAS)
        too_close = (gaps < self._preferred_clearance) & (gaps < gaps[0] - APPROACH_TOLERANCE_M)
        return np.where(too_close.any(axis=0), times[too_close.argmax(axis=0), np.arange(len(order))], np.inf)


class DirectionHistory:
    """Last direction of one velocity component, and the direction that is allowed since its last reversal."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Allow both directions."""
        self._sign = 0.0
        self.allowed_sign = 0.0
        """1 or -1 if only this sign is allowed; 0 if both signs are allowed."""

    def update(self, velocity: float) -> bool:
        """Record a commanded velocity. Return whether it reverses the direction."""
        if velocity == 0.0:
            return False
        sign = math.copysign(1.0, velocity)
        has_reversed = self._sign == -sign
        if has_reversed:
            self.allowed_sign = sign
        self._sign = sign
        return has_reversed


class OscillationCritic:
    """Critic that rejects a second reversal of the direction until the robot has moved or rotated far enough."""

    def __init__(self, reset_distance: float, reset_angle: float, x_only_threshold: float) -> None:
        """Take Nav2's oscillation_reset_dist (m), oscillation_reset_angle (rad), and x_only_threshold (m/s)."""
        self._reset_distance, self._reset_angle = reset_distance, reset_angle
        self._x_only_threshold = x_only_threshold
        self._directions = (DirectionHistory(), DirectionHistory(), DirectionHistory())
        self._reversed_at = Pose2(0.0, 0.0)

    def reset(self) -> None:
        """Allow all directions."""
        for direction in self._directions:
            direction.reset()

    def is_legal(self, velocities: Array) -> Mask:
        """Return which of the velocities (n, 3) are legal."""
        legal: Mask = np.ones(len(velocities), dtype=bool)
        for direction, velocity in zip(self._directions, velocities.T, strict=True):
            legal &= velocity * direction.allowed_sign >= 0.0
        return legal

    def record(self, pose: Pose2, command: Twist) -> None:
        """Record the command at this pose. Reversals of vy and wz count only if |vx| is at most x_only_threshold."""
        x, y, theta = self._directions
        has_reversed = x.update(command.vx)
        if abs(command.vx) <= self._x_only_threshold:
            has_reversed |= y.update(command.vy)
            has_reversed |= theta.update(command.wz)
        if has_reversed:
            self._reversed_at = pose
        if any(direction.allowed_sign for direction in self._directions) and self._has_moved(pose):
            self.reset()

    def _has_moved(self, pose: Pose2) -> bool:
        """Return whether the robot has moved or rotated far enough since the last reversal."""
        angle = abs(wrap(pose.yaw - self._reversed_at.yaw))
        return pose.distance(self._reversed_at) > self._reset_distance or angle > self._reset_angle
