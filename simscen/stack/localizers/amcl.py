"""When a particle filter is corrected and what it tells the world meanwhile: nav2_amcl's rhythm (amcl_node.cpp)."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.localization import Belief, Estimate
from simscen.core.messages.sensor_data import Imu, Odometry, Scan
from simscen.model.localizers import Amcl
from simscen.stack.localizers.clusters import spread, summarise
from simscen.stack.localizers.finder import UNSEEN, Finder
from simscen.stack.localizers.global_search import GlobalSearch
from simscen.stack.localizers.map_trust import TOGETHER, MapTrust
from simscen.stack.localizers.misfit import MapMisfit
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.scan_matcher import ScanMatcher, Step
from simscen.stack.localizers.scatter import Scatter
from simscen.stack.localizers.sure import Moved
from simscen.stack.odometry_history import OdometryHistory

SURE_AFTER = 8
"""Corrections in a row in which nothing was amiss, after which a robot is sure of its place."""
SHOWN = 0.7
"""Share of what a scan shows that those before it must have shown, for particles to be weighed by it that are no narrow
group: who steps before the lidar hides most of the room, and fits wherever something is as near."""


@dataclass(frozen=True, eq=False)
class _Correction:
    """What the filter last said: `pose` and `covariance` in the map, when odometry was at `odometry`.

    `tick` is that of the newest scan that said something.
    """

    pose: Pose2
    covariance: Array
    odometry: Pose2
    tick: int

    @cached_property
    def before(self) -> Pose2:
        """The odom frame seen from where the robot was then."""
        return self.odometry.inverse()

    @cached_property
    def map_from_odom(self) -> Pose2:
        return self.pose.compose(self.before)


class AmclLocalizer:
    """A particle filter on a map.

    A scan corrects when the robot has moved by update_min_d or update_min_a since the last correction; the first
    scan always does. A scan waits for the odometry of its own tick, as tf2's message filter makes it wait. Between
    corrections map→odom stands still, odometry carries the pose on and the motion model its covariance.
    """

    def __init__(
        self, spec: Amcl, particle_filter: ParticleFilter, motion: MotionModel, estimate: Estimate, tick_rate: int,
        search: tuple[GlobalSearch, MapTrust] | None = None, misfit: MapMisfit | None = None,
    ) -> None:  # fmt: skip
        """`search` is what finds a robot that is lost; without, that is left to random particles.

        `misfit` says what beams tell of the covariance; without, only the particles do.
        """
        self._spec, self._filter, self._motion, self._tick_rate = spec, particle_filter, motion, tick_rate
        self._search, self._misfit = search, misfit
        self._every = spec.sure_update_interval if misfit is None else 1
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over: particles around the estimate's pose, or over all free space when it has none."""
        self._odometry, self._begun = OdometryHistory(self._tick_rate), False
        self._filter.begin(estimate)
        settling = self._spec.settling_distance
        self._finder = None if self._search is None else Finder(*self._search, estimate, settling)
        self._told = estimate
        self.__dict__.pop("_correction", None)
        self._moved_to: Pose2 | None = None
        self._matcher = ScanMatcher() if self._spec.match_scans else None
        self._scatter = Scatter() if self._misfit is not None and self._matcher is not None else None
        self._matched: tuple[str, Pose2] | None = None
        self._came, self._calm, self._passed = UNSEEN, 0, 0
        self._due: dict[str, bool] = {}
        self._waiting: dict[str, Scan] = {}
        self._belief: Belief | None = None

    @cached_property
    def _correction(self) -> _Correction:
        """The newest; before there is any, what was told. Particles anywhere take 4 ms to sum up, if anyone asks."""
        if self._told.pose is None:
            pose, covariance = summarise(self._filter.particles)
        else:
            pose, covariance = self._told.pose, np.diag(np.square(self._told.std))
        return _Correction(pose, covariance, Pose2(0, 0, 0), 0)

    def on_odometry(self, odometry: Odometry) -> None:
        """Carry the pose on, and use scans that waited for this odometry."""
        if not self._odometry.add(odometry.tick, odometry.pose):
            return
        if not self._begun:
            start, self._begun = self._correction, True
            self._correction = _Correction(start.pose, start.covariance, odometry.pose, start.tick)
        self._belief = None
        if self._waiting:
            ready = [name for name, scan in self._waiting.items() if self._odometry.reaches(scan.tick)]
            for name in ready:
                self._use(self._waiting.pop(name))

    def on_scan(self, scan: Scan) -> None:
        """Correct with a scan, at once or when the odometry of its tick is there."""
        if self._odometry.reaches(scan.tick):
            self._use(scan)
        else:
            self._waiting[scan.sensor] = replace(scan, ranges=scan.ranges.copy())

    def on_imu(self, imu: Imu) -> None:
        """Nothing: AMCL trusts its odometry."""

    @property
    def belief(self) -> Belief:
        """The last correction, carried on by odometry."""
        if self._belief is None:
            last = self._correction
            delta = last.before.compose(self._odometry.now)
            covariance = (self._scatter or self._motion).carry(last.covariance, last.pose.yaw, delta)
            self._belief = Belief(self.pose, covariance, last.map_from_odom, self._filter.particles.table, last.tick)
        return self._belief

    @property
    def pose(self) -> Pose2:
        """That of the belief."""
        return self._correction.map_from_odom.compose(self._odometry.now)

    def _use(self, scan: Scan) -> None:
        """Correct with a scan if its lidar is due; after enough motion all lidars are due once."""
        odometry = self._odometry.at(scan.tick)
        if odometry is None or not scan.range_max > 0:
            return
        delta = None if self._moved_to is None else self._moved_to.between(odometry)
        if delta is not None and self._moved_enough(delta):
            self._due = dict.fromkeys(self._due, True)
        if self._due.get(scan.sensor, True):
            self._correct(scan, odometry, delta)
            if self._finder is not None:
                self._look_elsewhere(self._finder, scan, odometry)

    def _correct(self, scan: Scan, odometry: Pose2, delta: Pose2 | None) -> None:
        """Move the particles by what was driven since the last correction, and weigh them by a scan.

        Who is sure of its place need not compare each with the map: in between scans show how it goes.
        """
        matched = None if self._matcher is None else self._matched_step(self._matcher, scan, odometry)
        self._came = Moved(step=matched, parted=None if self._matcher is None else self._matcher.parted)
        agreed = False
        if delta is not None and matched is not None:
            self._filter.follow(matched, delta)
            if not (agreed := matched.agrees(delta)):
                self._came = replace(self._came, torn=delta.between(matched.delta))
            if self._scatter is not None:
                self._scatter.compare(matched.delta, delta)
        elif delta is not None:
            self._filter.move(delta)
        if self._scatter is not None:
            self._scatter.drive(self._base(odometry), None if matched is None else matched.covariance)
        self._due[scan.sensor], self._moved_to, self._belief = False, odometry, None
        sure = agreed and not self._came.parted and self._calm >= SURE_AFTER
        self._passed = self._passed + 1 if sure and self._passed + 1 < self._every else 0
        answer = None if self._passed or self._hidden else self._filter.correct(scan)
        if answer is not None:
            pose, covariance = answer
            if self._scatter is not None and self._misfit is not None:
                covariance = self._scatter.widened(pose, covariance, self._misfit.of(self._filter.beams(scan), pose))
            self._correction = _Correction(pose, covariance, odometry, scan.tick)
        else:
            last = self._correction
            carried = last.map_from_odom.compose(odometry) if matched is None else last.pose.compose(matched.delta)
            covariance = spread(self._filter.particles, carried)
            self._correction = _Correction(carried, covariance, odometry, scan.tick if self._passed else last.tick)
        if not self._passed:
            self._calm = self._calm + 1 if agreed and answer is not None and self._filter.sure else 0

    @property
    def _hidden(self) -> bool:
        """Whether somebody hides the room from particles that may be anywhere about, so that no map can tell."""
        again = None if self._matcher is None else self._matcher.again
        return again is not None and again < SHOWN and not self._filter.particles.within(TOGETHER)

    def _matched_step(self, matcher: ScanMatcher, scan: Scan, odometry: Pose2) -> Step | None:
        """The motion since the last correction as the first lidar saw it; None where it did not see it."""
        sensor, before = self._matched or (scan.sensor, odometry)
        if scan.sensor != sensor:
            return None
        step = matcher.step(scan, before.between(odometry))
        self._matched = sensor, odometry
        return step if before == self._moved_to else None

    def _look_elsewhere(self, finder: Finder, scan: Scan, odometry: Pose2) -> None:
        """Put the particles where the robot may be if it is not where it was thought to be."""
        limits = self._spec.laser_min_range, self._spec.farthest
        base = self._base(odometry)
        if self._passed:
            finder.passed(scan, base, limits, self._came)
            return
        believed = self._correction.map_from_odom.compose(odometry)
        fit = self._filter.fitting if self._calm else None
        if (places := finder.places(scan, base, believed, limits, self._came, fit)) is not None:
            self._correction = _Correction(*self._filter.put(*places), odometry, scan.tick)
            self._moved_to, self._belief, self._calm = odometry, None, 0
            if self._scatter is not None:
                self._scatter.forget()

    def _base(self, odometry: Pose2) -> Pose2:
        """Where the robot is at `odometry` in a frame that drifts: by what its scans show of its motion, if they do."""
        if self._matcher is None or self._matched is None:
            return odometry
        return self._matcher.pose.compose(self._matched[1].between(odometry))

    def _moved_enough(self, delta: Pose2) -> bool:
        return math.hypot(delta.x, delta.y) > self._spec.update_min_d or abs(delta.yaw) > self._spec.update_min_a
