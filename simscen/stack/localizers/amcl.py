"""AMCL localizer (nav2_amcl): updates a particle filter with scans, and moves the pose by odometry between updates."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import AmclParameters
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.particles import covariance_about, summarize
from simscen.stack.odometry_history import OdometryHistory


@dataclass(frozen=True, eq=False)
class Correction:
    """Estimate after the latest update of the particle filter.

    pose:        pose of the robot in the map frame at the time of the update
    covariance:  covariance (3, 3) of x, y, yaw of the pose
    odometry:    pose of the robot in the odom frame at the same time
    tick:        tick of the newest scan that the estimate is based on
    """

    pose: Pose2
    covariance: Array
    odometry: Pose2
    tick: int

    @cached_property
    def base_from_odom(self) -> Pose2:
        """Pose of the odom frame in the base frame at the time of the update."""
        return self.odometry.inverse()

    @cached_property
    def map_from_odom(self) -> Pose2:
        """Pose of the odom frame in the map frame, which nav2_amcl publishes as a transform."""
        return self.pose.compose(self.base_from_odom)


class AmclLocalizer:
    """Adaptive Monte Carlo localization on an occupancy grid.

    The first scan of each lidar updates the filter. A later scan updates the filter if the robot has moved by
    `update_min_d` m or turned by `update_min_a` rad since the last update. Scans wait for the odometry of their tick.

    Between updates, odometry moves the pose, and the motion model increases the covariance. Subclasses may override
    `reset`, `_correct`, and `_propagated_covariance`.
    """

    def __init__(
        self, spec: AmclParameters, particle_filter: ParticleFilter, motion: MotionModel, estimate: Estimate,
        tick_rate: int,
    ) -> None:  # fmt: skip
        self._spec, self._filter, self._motion, self._tick_rate = spec, particle_filter, motion, tick_rate
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate, as in `ParticleFilter.reset`."""
        self._odometry, self._has_odometry = OdometryHistory(self._tick_rate), False
        self._filter.reset(estimate)
        self._initial_estimate = estimate
        self.__dict__.pop("_correction", None)  # the next access computes it from the initial estimate
        self._last_update: Pose2 | None = None
        """Pose in the odom frame at the last filter update."""
        self._update_due: dict[str, bool] = {}
        """Whether the next scan updates the filter, by lidar."""
        self._waiting: dict[str, Scan] = {}
        """Newest scan that waits for the odometry of its tick, by lidar."""
        self._belief: Belief | None = None

    @cached_property
    def _correction(self) -> Correction:
        """The latest correction; before the first update, the initial estimate."""
        initial = self._initial_estimate
        if initial.pose is None:
            pose, covariance = summarize(self._filter.particles)
        else:
            pose, covariance = initial.pose, np.diag(np.square(initial.std))
        return Correction(pose, covariance, Pose2(0, 0, 0), 0)

    def on_odometry(self, odometry: Odometry) -> None:
        """Store the odometry, and process the scans that have waited for it."""
        if not self._odometry.add(odometry.tick, odometry.pose):
            return
        if not self._has_odometry:
            start, self._has_odometry = self._correction, True
            self._correction = replace(start, odometry=odometry.pose)
        self._belief = None
        if self._waiting:
            ready = [name for name, scan in self._waiting.items() if self._odometry.reaches(scan.tick)]
            for name in ready:
                self._process(self._waiting.pop(name))

    def on_scan(self, scan: Scan) -> None:
        """Process a scan, or keep it until the odometry of its tick has arrived."""
        if self._odometry.reaches(scan.tick):
            self._process(scan)
        else:
            # Later changes of the ranges must not affect the belief (a promise of LocalizerContract).
            self._waiting[scan.sensor] = replace(scan, ranges=scan.ranges.copy())

    def on_imu(self, imu: Imu) -> None:
        """Ignore the reading."""

    @property
    def belief(self) -> Belief:
        """The last correction, moved by the odometry since this correction."""
        if self._belief is None:
            last = self._correction
            delta = last.base_from_odom.compose(self._odometry.latest_pose)
            covariance = self._propagated_covariance(last, delta)
            self._belief = Belief(self.pose, covariance, last.map_from_odom, self._filter.particles.table, last.tick)
        return self._belief

    @property
    def pose(self) -> Pose2:
        """The pose of the belief, without the time to compute the covariance."""
        return self._correction.map_from_odom.compose(self._odometry.latest_pose)

    def _process(self, scan: Scan) -> None:
        """Update the filter if an update by this lidar is due. After enough motion, one update by each lidar is due."""
        odometry = self._odometry.at(scan.tick)
        if odometry is None or not scan.range_max > 0:
            return
        delta = None if self._last_update is None else self._last_update.between(odometry)
        if delta is not None:
            distance, angle = math.hypot(delta.x, delta.y), abs(delta.yaw)
            if distance > self._spec.update_min_d or angle > self._spec.update_min_a:
                self._update_due = dict.fromkeys(self._update_due, True)
        if self._update_due.get(scan.sensor, True):
            self._correct(scan, odometry, delta)

    def _correct(self, scan: Scan, odometry: Pose2, delta: Pose2 | None) -> None:
        """Update the filter: move the particles by `delta`, and weight them by the scan.

        `odometry` is the pose in the odom frame at the time of the scan. `delta` is the motion since the last update in
        the base frame; None at the first update.
        """
        if delta is not None:
            self._filter.move(delta)
        self._mark_updated(scan, odometry)
        estimate = self._filter.correct(scan)
        if estimate is not None:
            self._correction = Correction(*estimate, odometry, scan.tick)
        else:
            last = self._correction
            pose = last.map_from_odom.compose(odometry)
            self._correction = Correction(pose, covariance_about(self._filter.particles, pose), odometry, last.tick)

    def _mark_updated(self, scan: Scan, odometry: Pose2) -> None:
        """Record that the lidar of a scan has updated the filter at this odometry pose."""
        self._update_due[scan.sensor], self._last_update, self._belief = False, odometry, None

    def _propagated_covariance(self, last: Correction, delta: Pose2) -> Array:
        """Return the covariance (3, 3) after moving by `delta` (in the base frame) since the last correction."""
        return self._motion.propagate(last.covariance, last.pose.yaw, delta)
