"""`off`: an instance falls silent."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import apply_correction
from simscen.spec.base import Spec


class Off(Spec, Fault):
    """No message arrives any more, as when a cable comes loose or a node dies.

    A base that hears no command stops after its `command_timeout`. Without its localizer a robot goes on by odometry:
    the correction from map to odometry stays what it was, as it does on /tf.

    Example: `{sensor: lidar, off: {}, when: {time: 10 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Silence."""
        return _Silence()


class _Silence(Disturbance):
    def __init__(self) -> None:
        self._correction: Pose2 | None = None

    def reading(self, reading: Reading) -> Reading | None:
        return None

    def command(self, command: Twist) -> Twist | None:
        return None

    def belief(self, belief: Belief) -> Belief:
        if self._correction is None:
            self._correction = belief.map_from_odom
        return apply_correction(belief, self._correction)
