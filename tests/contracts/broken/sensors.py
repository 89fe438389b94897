"""Sensors, each of which breaks a promise."""

import math
import random
from dataclasses import replace

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Odometry
from simscen.model.sensors import Bumper, Lidar
from tests.contracts.broken.cases import Wrapper, breaks

SENSOR = Bumper()


@breaks(SENSOR, "a reading has the declared type name and tick", "labels a reading of tick")
class HasWrongName(Wrapper):
    def read(self, tick):
        return replace(self.inner.read(tick), sensor="other")


@breaks(SENSOR, "a reading has the declared type name and tick", "returns Odometry, not Bump")
class ReturnsWrongType(Wrapper):
    def read(self, tick):
        return Odometry(self.name, tick, Pose2(0, 0, 0), Twist())


@breaks(Lidar(), "the numbers of a reading are finite", "returns angle_min = nan")
class ReturnsNanAngle(Wrapper):
    def read(self, tick):
        return replace(self.inner.read(tick), angle_min=math.nan)


@breaks(Lidar(), "the same world", "for the same")
class UsesGlobalRandom(Wrapper):
    def read(self, tick):
        scan = self.inner.read(tick)
        return replace(scan, ranges=scan.ranges + random.random())


@breaks(Lidar(), "a reading does not change", "changes when the next one is taken")
class ReusesArray(Wrapper):
    array = None

    def read(self, tick):
        scan = self.inner.read(tick)
        self.array = scan.ranges.copy() if self.array is None else self.array
        self.array[:] = scan.ranges
        return replace(scan, ranges=self.array)
