"""AMCL that matches each scan with earlier ones, and searches the whole map when the robot is lost."""

from simscen.advanced.localizers.covariance_estimator import CovarianceEstimator, MapResiduals
from simscen.advanced.localizers.global_search import GlobalSearch
from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.matched_motion import MatchedMotion
from simscen.advanced.localizers.particle_filter import ScanMatchingParticleFilter
from simscen.advanced.localizers.pose_prior import ObservedMotion
from simscen.advanced.localizers.relocalization import UNOBSERVED_MOTION, Relocalizer
from simscen.advanced.localizers.scan_matcher import ScanMatcher
from simscen.advanced.spec import ScanMatchingAmcl
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.amcl import AmclLocalizer, Correction
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particles import covariance_about

CERTAIN_AFTER_UPDATES = 8
"""Number of consecutive updates in which map, scan matching and odometry must agree before scans may be skipped."""


class ScanMatchingAmclLocalizer(AmclLocalizer):
    """AMCL with scan matching as motion model, and with optional relocalization and covariance estimation.

    `_correct` and `_propagated_covariance` are hooks that AmclLocalizer calls.
    """

    _spec: ScanMatchingAmcl
    _filter: ScanMatchingParticleFilter

    def __init__(
        self, spec: ScanMatchingAmcl, particle_filter: ScanMatchingParticleFilter, motion: MotionModel,
        estimate: Estimate, tick_rate: int, search: tuple[GlobalSearch, MapTrust] | None = None,
        residuals: MapResiduals | None = None,
    ) -> None:  # fmt: skip
        """Create the localizer.

        search:     arguments of Relocalizer; None if only random particles find a lost robot
        residuals:  input of the CovarianceEstimator; None to use the covariance of the particles
        """
        self._search, self._residuals = search, residuals
        self._update_interval = spec.sure_update_interval if residuals is None else 1
        super().__init__(spec, particle_filter, motion, estimate, tick_rate)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate, as in `ParticleFilter.reset`."""
        super().reset(estimate)
        settling = self._spec.settling_distance
        self._relocalizer = None if self._search is None else Relocalizer(*self._search, estimate, settling)
        self._matcher = ScanMatcher() if self._spec.match_scans else None
        estimates_covariance = self._residuals is not None and self._matcher is not None
        self._covariance_estimator = CovarianceEstimator() if estimates_covariance else None
        self._matched: tuple[str, Pose2] | None = None  # lidar and odometry of the last matched scan
        self._observed_motion = UNOBSERVED_MOTION  # the motion since the last update
        self._consistent_updates = 0  # consecutive updates in which map, scans and wheels agreed
        self._skipped = 0  # consecutive scans that were not compared with the map

    def _correct(self, scan: Scan, odometry: Pose2, delta: Pose2 | None) -> None:
        """Update the pose with a scan, then search the map if the robot may be lost. `delta` is as in `_update`."""
        self._update(scan, odometry, delta)
        if self._relocalizer is not None:
            self._relocalize(self._relocalizer, scan, odometry)

    def _update(self, scan: Scan, odometry: Pose2, delta: Pose2 | None) -> None:
        """Move the particles, and weight them by a scan, unless `sure_update_interval` skips the scan.

        `delta` is the motion by odometry since the last update; None at the first one.
        """
        matched = None if self._matcher is None else self._match(self._matcher, scan, odometry)
        was_carried = None if self._matcher is None else self._matcher.was_carried
        self._observed_motion = observed = ObservedMotion(delta, matched, was_carried)
        self._move(matched, odometry, delta)
        self._mark_updated(scan, odometry)
        is_certain = observed.agrees and not was_carried and self._consistent_updates >= CERTAIN_AFTER_UPDATES
        self._skipped = self._skipped + 1 if is_certain and self._skipped + 1 < self._update_interval else 0
        estimate = None if self._skipped else self._filter.correct(scan)
        if estimate is not None:
            pose, covariance = estimate
            if self._covariance_estimator is not None and self._residuals is not None:
                residuals = self._residuals.residuals(self._filter.beams(scan), pose)
                covariance = self._covariance_estimator.estimate(pose, covariance, residuals)
            self._correction = Correction(pose, covariance, odometry, scan.tick)
        else:
            last = self._correction
            pose = last.map_from_odom.compose(odometry) if matched is None else last.pose.compose(matched.delta)
            tick = scan.tick if self._skipped else last.tick
            self._correction = Correction(pose, covariance_about(self._filter.particles, pose), odometry, tick)
        if not self._skipped:
            is_consistent = observed.agrees and estimate is not None and self._filter.is_certain
            self._consistent_updates = self._consistent_updates + 1 if is_consistent else 0

    def _move(self, matched: MatchedMotion | None, odometry: Pose2, delta: Pose2 | None) -> None:
        """Move the particles by `matched`, the motion by scan matching, or else by `delta`. Arguments as in `_update`.

        The covariance estimator, if any, learns from both motions.
        """
        estimator = self._covariance_estimator
        if delta is not None and matched is not None:
            self._filter.move_by_scan_matching(matched, delta)
            if estimator is not None:
                estimator.learn_odometry_error(matched.delta, delta)
        elif delta is not None:
            self._filter.move(delta)
        if estimator is not None:
            estimator.propagate_poses(self._base(odometry), None if matched is None else matched.covariance)

    def _match(self, matcher: ScanMatcher, scan: Scan, odometry: Pose2) -> MatchedMotion | None:
        """Return the motion since the last update, from scans of the first lidar only; None if the match fails."""
        sensor, previous = self._matched or (scan.sensor, odometry)
        if scan.sensor != sensor:
            return None
        step = matcher.step(scan, previous.between(odometry))
        self._matched = sensor, odometry
        return step if previous == self._last_update else None

    def _relocalize(self, relocalizer: Relocalizer, scan: Scan, odometry: Pose2) -> None:
        """Redistribute the particles if the relocalizer finds the robot elsewhere."""
        range_limits = self._spec.laser_min_range, self._spec.max_used_range
        base = self._base(odometry)
        if self._skipped:
            relocalizer.add_scan(scan, base, range_limits, self._observed_motion)
            return
        estimated = self._correction.map_from_odom.compose(odometry)
        fitting_share = self._filter.fitting_share if self._consistent_updates else None
        found = relocalizer.update(scan, base, estimated, range_limits, self._observed_motion, fitting_share)
        if found is not None:
            self._correction = Correction(*self._filter.redistribute(*found), odometry, scan.tick)
            self._last_update, self._belief, self._consistent_updates = odometry, None, 0
            if self._covariance_estimator is not None:
                self._covariance_estimator.forget_poses()

    def _base(self, odometry: Pose2) -> Pose2:
        """Return the robot's pose in the drifting frame of the scan matcher, or `odometry` without scan matching."""
        if self._matcher is None or self._matched is None:
            return odometry
        return self._matcher.pose.compose(self._matched[1].between(odometry))

    def _propagated_covariance(self, last: Correction, delta: Pose2) -> Array:
        """Return the covariance (3, 3) after the motion `delta` by odometry since the `last` correction."""
        return (self._covariance_estimator or self._motion).propagate(last.covariance, last.pose.yaw, delta)
