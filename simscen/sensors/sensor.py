"""What a sensor is, and what it may look at."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose3
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages.sensor_data import Reading
from simscen.model.robot import Drive

Vector = tuple[float, float, float]


class SensorView(Protocol):
    """The truth, as far as sensors may see it."""

    def base_pose(self) -> Pose3:
        """The robot's base frame in the world."""
        ...

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Linear (m/s) and angular (rad/s) velocity of the base frame along the world's axes."""
        ...

    def encoders(self) -> tuple[float, ...]:
        """What has been rolled so far.

        On wheels: the mean angle in rad of the driven wheels on the left, and of those on the right. Mecanum: the
        angles in rad of the wheels front left, front right, rear left, rear right. Omnidirectional: meters forward,
        meters to the left, and radians.
        """
        ...

    def touching(self) -> bool:
        """Whether the hull touches anything but the ground."""
        ...

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Colors (h, w, 3) and depths (h, w) in meters along the optical axis, inf beyond `far`.

        `mount` is where the camera is in the base frame; it looks along its x axis. `field_of_view` is horizontal,
        in rad.
        """
        ...


@dataclass(frozen=True, eq=False)
class SensorSetting:
    """All that a sensor may know besides its specification: `Class(specification, setting)`. SI units.

    name:     what the robot's file calls it; its readings carry it
    period:   ticks between two readings
    seconds:  the same in seconds
    chance:   its own random generator, `sensor.<name>` of the run's seed
    view:     the truth, as far as sensors may see it
    rays:     distances to what is around
    drive:    what the robot drives with, for what is measured at its wheels
    """

    name: str
    period: int
    seconds: float
    chance: np.random.Generator
    view: SensorView
    rays: RayCaster
    drive: Drive


class Sensor(Protocol):
    """Takes readings at a fixed rate.

    *Given* the same world and generator *then* the same readings, bit for bit.
    *Given* noise *then* no two scans or inertial readings of a robot at rest are equal; without noise all are.
    *Given* a reading *then* nothing changes it later.
    """

    @property
    def name(self) -> str:
        """The instance, as faults call it."""
        ...

    @property
    def period(self) -> int:
        """Ticks between two readings."""
        ...

    def read(self, tick: int) -> Reading:
        """Measure now, at `tick`. Called once every `period` ticks, in order."""
        ...
