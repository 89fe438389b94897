"""Protocol of sensors, arguments of a sensor's constructor, and random numbers for noise."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose3, Vector
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages.sensor_data import Reading
from simscen.model.robot import Drive

BUFFER_SIZE = 384
"""Number of random numbers that NormalStream draws at once."""


class SensorView(Protocol):
    """The part of the true state that sensors may use."""

    def base_pose(self) -> Pose3:
        """Return the pose of the base frame in the world."""
        ...

    def base_velocity(self) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of the base frame along the world axes."""
        ...

    def placements(self) -> int:
        """Return how many times the robot has been teleported (action `kidnap`)."""
        ...

    def encoders(self) -> tuple[float, ...]:
        """Return the accumulated rotation of the wheels; the elements depend on the drive.

        Differential, skid-steer, Ackermann: mean angle in rad of the left and of the right driven wheels.
        Mecanum: angle in rad of the front left, front right, rear left, and rear right wheel.
        Omnidirectional: distance in m driven forward, distance in m driven to the left, and turned angle in rad.
        """
        ...

    def touching(self) -> bool:
        """Return whether the robot touches anything besides the ground, or did so within the last 0.1 s."""
        ...

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Return colors (height, width, 3) and depths (height, width) in m along the optical axis, inf beyond `far` m.

        `mount` is the pose of the camera in the base frame; its x axis is the optical axis. `width` and `height` are in
        pixels. `field_of_view` is horizontal, in rad.
        """
        ...


@dataclass(frozen=True, eq=False)
class SensorSetting:
    """Robot and run of a sensor: the second argument of each sensor's constructor.

    name:     name of the sensor in the robot's file and in its readings
    period:   time between two readings in ticks
    seconds:  time between two readings in s
    rng:      random generator of this sensor
    view:     part of the true state that sensors may use
    rays:     ray caster for distances to the surroundings
    drive:    specification of the robot's drive
    """

    name: str
    period: int
    seconds: float
    rng: np.random.Generator
    view: SensorView
    rays: RayCaster
    drive: Drive


class Sensor(Protocol):
    """Takes readings of one type at a fixed rate.

    *Given* the same world and generator *then* the sensor returns the same readings, bit for bit.
    *Given* noise *then* no two scans or IMU readings of a robot at rest are equal; without noise, all are equal.
    *Given* a returned reading *then* the sensor does not change it later.
    """

    @property
    def name(self) -> str:
        """Name of the sensor. The faults of a scenario refer to a sensor by this name."""
        ...

    @property
    def period(self) -> int:
        """Number of ticks between two readings."""
        ...

    def read(self, tick: int) -> Reading:
        """Return the reading at the current `tick`. Called every `period` ticks, in order of time."""
        ...


class NormalStream:
    """Standard normal random numbers, drawn from a generator in batches to save time.

    The numbers are the same as without batches. Nothing else may use the generator.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._buffer: list[float] = []
        self._next = 0

    def take(self, count: int) -> list[float]:
        """Return the next `count` numbers."""
        begin, end = self._next, self._next + count
        if end > len(self._buffer):
            self._buffer = self._buffer[begin:] + self._rng.standard_normal(max(count, BUFFER_SIZE)).tolist()
            begin, end = 0, count
        self._next = end
        return self._buffer[begin:end]
