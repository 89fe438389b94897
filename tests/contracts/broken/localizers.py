"""Localizers, each of which breaks a promise."""

import random
from dataclasses import replace

import numpy as np

from simscen.core.messages.navigation import Belief
from simscen.model.localizers import OdometryOnly
from tests.contracts.broken.cases import Wrapper, breaks

LOCALIZER = OdometryOnly(type="odometry")


class BeliefWrapper(Wrapper):
    @property
    def belief(self) -> Belief:
        return self.change(self.inner.belief)

    def change(self, belief: Belief) -> Belief:
        return belief


@breaks(LOCALIZER, "the same calls", "two runs differ in pose")
class UsesGlobalRandom(BeliefWrapper):
    def change(self, belief):
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + 1e-9 * random.random()))


@breaks(LOCALIZER, "without motion the belief does not drift", "drifts by")
class DriftsAtRest(BeliefWrapper):
    offset = 0.0

    def change(self, belief):
        self.offset += 1e-3
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + self.offset))


@breaks(LOCALIZER, "a belief does not change", "covariance changes")
class ReusesCovariance(BeliefWrapper):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.array = np.zeros((3, 3))

    def change(self, belief):
        self.array[:] = belief.covariance
        return replace(belief, covariance=self.array)

    def on_scan(self, scan):
        self.array += 1.0


@breaks(LOCALIZER, "a scan is neither", "changes the ranges of a scan")
class ChangesScan(Wrapper):
    def on_scan(self, scan):
        scan.ranges[:] = 1.0


@breaks(LOCALIZER, "a scan is neither", "affects the belief")
class KeepsScan(BeliefWrapper):
    scan = None

    def on_scan(self, scan):
        self.scan = scan

    def change(self, belief):
        is_blind = self.scan is not None and np.isnan(self.scan.ranges).all()
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + (1.0 if is_blind else 0.0)))


@breaks(LOCALIZER, "invalid ranges never make the belief invalid", "believes to be at")
class AcceptsNanRanges(BeliefWrapper):
    last = 0.0

    def on_scan(self, scan):
        self.last = float(scan.ranges[0]) if len(scan.ranges) else 0.0

    def change(self, belief):
        return replace(belief, pose=belief.pose._replace(x=self.last))


@breaks(LOCALIZER, "invalid odometry never makes the belief invalid", "a covariance that is not")
class AcceptsNanGyro(BeliefWrapper):
    rate = 0.0

    def on_imu(self, imu):
        self.rate = imu.angular_velocity[2]

    def change(self, belief):
        return replace(belief, covariance=belief.covariance + self.rate)


@breaks(LOCALIZER, "invalid odometry never makes the belief invalid", "not positive semidefinite")
class HasNegativeCovariance(BeliefWrapper):
    def change(self, belief):
        return replace(belief, covariance=-belief.covariance)


@breaks(LOCALIZER, "scans of any size range and mount are accepted", "raises IndexError when it receives a scan")
class RequiresAllBeams(Wrapper):
    def on_scan(self, scan):
        scan.ranges[359]


@breaks(LOCALIZER, "scans of any size range and mount are accepted", "weights that add up to")
class HasZeroWeights(BeliefWrapper):
    def change(self, belief):
        return replace(belief, particles=np.zeros((3, 4)))


@breaks(LOCALIZER, "a reset forgets", "after a reset")
class IgnoresReset(Wrapper):
    resets = 0

    def reset(self, estimate):
        self.resets += 1
        if self.resets == 1:
            self.inner.reset(estimate)
