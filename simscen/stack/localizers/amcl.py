"""Adaptive Monte Carlo localisation, with nav2_amcl's parameters and rhythm.

Thrun, Burgard & Fox, Probabilistic Robotics, chapter 8; Fox, KLD-Sampling (IJRR 2003).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simscen.core.belief import Belief, Estimate
from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Imu, Odometry, Scan
from simscen.model.stack import Amcl
from simscen.stack.localizers.beams import select_beams
from simscen.stack.localizers.clusters import spread, summarise
from simscen.stack.localizers.kld import KldBound
from simscen.stack.localizers.likelihood_field import SensorModel
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.odometry_track import OdometryTrack
from simscen.stack.localizers.particles import FreeSpace, Particles
from simscen.stack.localizers.recovery import Recovery
from simscen.stack.localizers.resampling import adaptive, systematic

CONVERGED_WITHIN = 0.5  # nav2_amcl's pf.dist_threshold, in m


@dataclass(frozen=True, eq=False)
class _Correction:
    """What the particles last said: `pose` and `covariance` in the map, when odometry was at `odometry`."""

    pose: Pose2
    covariance: Array
    odometry: Pose2
    tick: int

    @cached_property
    def map_from_odom(self) -> Pose2:
        return self.pose.compose(self.odometry.inverse())


class AmclLocalizer:
    """A particle filter on a map.

    A scan corrects when the robot has moved by update_min_d or update_min_a since the last correction; the first
    scan always does. A scan waits for the odometry of its own tick, as tf2's message filter makes it wait. Between
    corrections map→odom stands still, odometry carries the pose on and the motion model its covariance.
    """

    def __init__(
        self, spec: Amcl, motion: MotionModel, sensor: SensorModel, anywhere: FreeSpace,
        estimate: Estimate, chance: np.random.Generator, tick_rate: int,
    ) -> None:  # fmt: skip
        self._spec, self._motion, self._sensor, self._anywhere = spec, motion, sensor, anywhere
        self._chance, self._tick_rate = chance, tick_rate
        most = max(spec.min_particles, spec.max_particles)
        self._bound = KldBound(spec.pf_err, spec.pf_z, spec.min_particles, most)
        self.reset(estimate)

    def reset(self, estimate: Estimate) -> None:
        """Start over: particles around the estimate's pose, or over all free space when it has none."""
        self._track = OdometryTrack(10 * self._tick_rate)
        self._recovery = Recovery(self._spec.recovery_alpha_slow, self._spec.recovery_alpha_fast)
        self._particles = self._anywhere.begin(estimate, self._bound.most, self._chance)
        pose, covariance = summarise(self._particles)
        if estimate.pose is not None:
            pose, covariance = estimate.pose, np.diag(np.square(estimate.std))
        self._correction = _Correction(pose, covariance, Pose2(0, 0, 0), 0)
        self._moved_to: Pose2 | None = None
        self._due: dict[str, bool] = {}
        self._waiting: dict[str, Scan] = {}
        self._updates = 0
        self._belief: Belief | None = None

    def on_odometry(self, odometry: Odometry) -> None:
        """Carry the pose on, and use scans that waited for this odometry."""
        first = self._track.newest is None
        if not self._track.add(odometry):
            return
        if first:
            start = self._correction
            self._correction = _Correction(start.pose, start.covariance, odometry.pose, start.tick)
        self._belief = None
        ready = [name for name, scan in self._waiting.items() if self._track.reaches(scan.tick)]
        for name in ready:
            self._use(self._waiting.pop(name))

    def on_scan(self, scan: Scan) -> None:
        """Correct with a scan, at once or when the odometry of its tick is there."""
        if self._track.reaches(scan.tick):
            self._use(scan)
        else:
            self._waiting[scan.sensor] = replace(scan, ranges=scan.ranges.copy())

    def on_imu(self, imu: Imu) -> None:
        """Nothing: AMCL trusts its odometry."""

    @property
    def belief(self) -> Belief:
        """The last correction, carried on by odometry."""
        if self._belief is None:
            last, now = self._correction, self._track.newest or self._correction.odometry
            covariance = self._motion.carry(last.covariance, last.pose.yaw, last.odometry.between(now))
            pose = last.map_from_odom.compose(now)
            self._belief = Belief(pose, covariance, last.map_from_odom, self._particles.table, last.tick)
        return self._belief

    def _use(self, scan: Scan) -> None:
        """Correct with a scan if its lidar is due; after enough motion all lidars are due once."""
        odometry = self._track.at(scan.tick)
        if odometry is None or not scan.range_max > 0:
            return
        delta = self._moved_to.between(odometry) if self._moved_to is not None else None
        if delta is None or self._moved_enough(delta):
            self._due = dict.fromkeys(self._due, True)
        if not self._due.get(scan.sensor, True):
            return
        self._due[scan.sensor] = False
        poses = self._particles.poses
        if delta is not None:
            poses = self._motion.sample(poses, delta, self._chance)
        self._moved_to = odometry
        self._particles = Particles(poses, self._particles.weights)
        if self._weigh(scan):
            self._correction = _Correction(*summarise(self._particles), odometry, scan.tick)
            self._resample()
        else:
            carried = self._correction.map_from_odom.compose(odometry)
            self._correction = _Correction(carried, spread(self._particles, carried), odometry, self._correction.tick)
        self._belief = None

    def _moved_enough(self, delta: Pose2) -> bool:
        return bool(np.hypot(delta.x, delta.y) > self._spec.update_min_d or abs(delta.yaw) > self._spec.update_min_a)

    def _weigh(self, scan: Scan) -> bool:
        """Weigh the particles by a scan; False when it says nothing about where the robot is.

        A scan that no particle can explain leaves them equally likely, as in nav2_amcl, and counts as likelihood zero
        for the recovery.
        """
        spec, (poses, weights) = self._spec, (self._particles.poses, self._particles.weights)
        beams = select_beams(scan, spec.max_beams, spec.laser_min_range, spec.laser_max_range)
        converged = spec.do_beamskip and self._particles.within(CONVERGED_WITHIN)
        logarithm = self._sensor.log_likelihood(poses, beams, converged)
        best = logarithm.max()
        if best == -np.inf:
            self._recovery.observe(0.0)
            self._particles = Particles.equal(poses)
            return True
        if best == logarithm.min():
            return False
        weights = weights * np.exp(logarithm - best)
        total = weights.sum()
        self._recovery.observe(float(np.exp(best) * total))
        self._particles = Particles(poses, weights / total)
        return True

    def _resample(self) -> None:
        """Draw new particles, on every resample_interval-th update and, if selective, when too few carry weight."""
        self._updates += 1
        lopsided = self._particles.effective <= len(self._particles.weights) / 2
        if self._updates % self._spec.resample_interval == 0 and (lopsided or not self._spec.selective_resampling):
            self._particles = Particles.equal(adaptive(self._draw, self._bound))

    def _draw(self, count: int) -> Array:
        """Poses (count, 3) in random order: most from the particles, the recovery's share from anywhere."""
        poses = self._particles.poses[systematic(self._particles.weights, count, self._chance)]
        if self._recovery.share > 0:
            lost = self._chance.random(count) < self._recovery.share
            poses[lost] = self._anywhere.draw(int(lost.sum()), self._chance)
        return self._chance.permutation(poses)
