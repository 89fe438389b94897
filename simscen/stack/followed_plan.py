"""The plan that the robot follows: progress, obstacles on the plan, and transformation for the controller."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import distances
from simscen.stack.frames import Frames, transform_poses
from simscen.stack.localizers.beams import ComplexPoints
from simscen.stack.protocols import Controller, CostmapView

WATCH_DISTANCE_M = 0.5
"""Costmap changes within this distance of the plan cause a new check of the plan. The inscribed radius, if larger, is
used instead."""
WATCH_EVERY_POINTS = 4
"""Only every n-th point of the plan is compared with the positions of costmap changes."""
MAX_DEFERRED_MOTION_M = 0.5
"""Motion of the robot after which its position on the plan is updated even if nothing needs the position."""
MAX_CROSS_TRACK_M, MIN_REMAINING_M = 0.2, 0.03
"""A car has missed its plan if it is farther than 0.2 m from the plan, or if less than 0.03 m of the plan remain."""
COMPARISON_DISTANCE_M = 1.0
"""Distance from the robot at which a shift between map and odom frame is measured."""
MIN_SHIFT_M = 0.01
"""Shift of the map frame in the odom frame above which the controller gets the path again."""
ROUNDING_M = 1e-9
"""Maximum shift of the map frame in the odom frame that rounding can cause."""


class FollowedPlan:
    """A plan in the map frame and the position of the robot on it."""

    def __init__(self, path: Path, radius: float, costmap: CostmapView) -> None:
        """Take a path, the inscribed `radius` of the robot in m, and the costmap that shows the occupied points."""
        self.path, self._radius = path, radius
        self._tracker = PathTracker(path)
        self._pending_pose: Pose2 | None = None
        """Latest pose of the robot, if its position on the plan has not been computed yet."""
        self._located_pose = Pose2(*path.points[0].tolist())
        """Latest pose for which the position on the plan has been computed."""
        self._complex_points: ComplexPoints = path.points[:, 0] + 1j * path.points[:, 1]
        self._watch_distance = max(radius, WATCH_DISTANCE_M) + WATCH_EVERY_POINTS * self._tracker.longest_step
        self._revision = costmap.revision
        self.update_occupied(costmap)

    def update_occupied_if_changed(self, costmap: LayeredCostmap) -> None:
        """Update the occupied points if the costmap has changed near the points ahead of the robot."""
        ahead = self._complex_points[self._updated_tracker.index :: WATCH_EVERY_POINTS]
        if costmap.changed_near(self._revision, ahead, self._watch_distance):
            self.update_occupied(costmap.view)
        self._revision = costmap.revision

    def update_occupied(self, costmap: CostmapView) -> None:
        """Determine the occupied points of the plan, where the inscribed circle of the robot does not fit."""
        self._occupied = distances(costmap, self.path.points[:, :2]) <= np.float32(self._radius)

    def locate(self, pose: Pose2) -> None:
        """Set the pose of the robot in the map frame. The position on the plan is computed when needed."""
        self._pending_pose, (x, y, _) = pose, self._located_pose
        if self._tracker.has_cusps or abs(pose.x - x) + abs(pose.y - y) > MAX_DEFERRED_MOTION_M:
            self._update_tracker(pose)

    def _update_tracker(self, pose: Pose2) -> None:
        """Compute the position of the robot on the plan for this pose."""
        self._tracker.locate(pose)
        self._located_pose, self._pending_pose = pose, None

    @property
    def _updated_tracker(self) -> PathTracker:
        """The tracker, updated to the last pose."""
        if self._pending_pose is not None:
            self._update_tracker(self._pending_pose)
        return self._tracker

    @property
    def points_ahead(self) -> Array:
        """Points (n, 3) of the plan ahead of the robot."""
        tracker = self._updated_tracker
        points: Array = tracker.points[tracker.index :]
        return points

    def sampled_points(self, every: int) -> list[complex]:
        """Return every n-th point of the plan ahead of the robot as x + iy; `every` is n."""
        return self._updated_tracker.sampled_points(every)

    def is_missed(self, pose: Pose2) -> bool:
        """Return whether a car is too far from the plan, or too near its end, to reach the goal on this plan."""
        tracker = self._updated_tracker
        x, y, _ = tracker.points[tracker.index].tolist()
        return math.hypot(pose.x - x, pose.y - y) > MAX_CROSS_TRACK_M or self.remaining() < MIN_REMAINING_M

    def remaining(self) -> float:
        """Return the length of the plan ahead in m."""
        return self._updated_tracker.remaining()

    def is_blocked(self) -> bool:
        """Return whether any point ahead of the robot is occupied.

        Every second point is checked. Occupied points before the first free point are ignored, so that a robot that
        touches an obstacle can drive away.
        """
        occupied = self._occupied[self._updated_tracker.index :: 2]
        if not occupied.any():
            return False
        first_free = int((~occupied).argmax())
        return bool(occupied[first_free:].any())


class LocalPathSender:
    """Passes each plan to the controller, transformed to the odom frame.

    When the transform from map to odom frame has changed, the controller gets the remaining part of the plan again.
    """

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._plan: FollowedPlan | None = None
        self._odom_from_map = Pose2(0.0, 0.0)
        """The current transform from map to odom frame."""
        self._sent_odom_from_map = self._odom_from_map
        """The transform with which the path was passed to the controller."""
        self._goal: Goal | None = None
        self._local_goal: Goal | None = None

    def update(self, plan: FollowedPlan, goal: Goal, frames: Frames) -> Goal:
        """Update the controller's path. `plan` and `goal` are in the map frame. Return the goal in the odom frame."""
        is_unchanged = frames.map_shift(self._odom_from_map, COMPARISON_DISTANCE_M) <= ROUNDING_M
        if not is_unchanged:
            self._odom_from_map = frames.odom_from_map
        if plan is not self._plan:
            self._send(plan, plan.path.points)
        elif not is_unchanged and frames.map_shift(self._sent_odom_from_map, COMPARISON_DISTANCE_M) > MIN_SHIFT_M:
            plan.locate(frames.pose)
            self._send(plan, plan.points_ahead)
        local_goal = self._local_goal
        if local_goal is None or goal is not self._goal or not is_unchanged:
            self._goal, self._local_goal = goal, (local_goal := goal.at(self._odom_from_map.compose(goal.pose)))
        return local_goal

    def _send(self, plan: FollowedPlan, points: Array) -> None:
        """Pass `points` (n, 3) of the plan to the controller."""
        self._plan, self._sent_odom_from_map = plan, self._odom_from_map
        self._controller.set_path(Path(transform_poses(self._sent_odom_from_map, points), plan.path.tick))
