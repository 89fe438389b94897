"""Simulated ring of ultrasonic sensors: each measures the nearest hit of a fan of rays in its cone."""

import math

import numpy as np

from simscen.plugin import Pose2, Scan, SensorSetting
from yardwork.sonar import Sonar

RAYS = 9
"""In each cone."""


class SonarRing:
    """Measures in all cones at once."""

    def __init__(self, spec: Sonar, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._setting = spec, setting
        self._step = 2 * math.pi / spec.sensors
        mount = spec.mount
        self._mount = Pose2(mount.x, mount.y, mount.yaw)
        fan = np.linspace(-spec.cone / 2, spec.cone / 2, RAYS)
        angles = mount.yaw + (np.arange(spec.sensors)[:, np.newaxis] * self._step + fan).ravel()
        self._directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
        self._origin = np.array([[mount.x, mount.y, mount.z]])

    def read(self, tick: int) -> Scan:
        """One range from each sensor; inf where nothing answers."""
        spec, pose = self._spec, self._setting.view.base_pose()
        origins = np.repeat(pose.apply(self._origin), len(self._directions), axis=0)
        found = self._setting.rays.cast(origins, self._directions @ pose.rotation().T)
        ranges = found.reshape(spec.sensors, RAYS).min(axis=1)
        ranges = ranges + self._setting.rng.normal(0.0, spec.noise, spec.sensors)
        ranges = np.where(ranges > spec.max_range, np.inf, np.maximum(ranges, spec.min_range))
        return Scan(self.name, tick, ranges, 0.0, self._step, spec.min_range, spec.max_range, self._mount)
