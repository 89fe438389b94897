"""The promises of a sensor."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from simscen.core.chance import Streams
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.sensing import Reading
from simscen.core.time import Clock
from simscen.model.robot import Differential
from simscen.sensors.installed import InstalledSensor
from simscen.sensors.sensor import SensorSetting, Vector
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, PromiseBroken, demand, promise

WHEELS = Differential(type="differential", wheel_radius=0.05, wheel_separation=0.3)
HALF = 3.0
"""Metres from the middle of the room to its walls."""
READINGS = 12


class TurningRobot:
    """A SensorView: a robot that turns on the spot, a tenth of a radian for each reading."""

    def __init__(self) -> None:
        self.turned = 0.0

    def base_pose(self) -> Pose3:
        """Beside the middle of the room."""
        return Pose3.planar(Pose2(0.5, -0.3, self.turned))

    def base_velocity(self) -> tuple[Vector, Vector]:
        """It turns only."""
        return (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)

    def encoders(self) -> tuple[float, ...]:
        """One wheel back, one ahead."""
        rolled = self.turned * WHEELS.wheel_separation / 2 / WHEELS.wheel_radius
        return -rolled, rolled

    def touching(self) -> bool:
        """Never."""
        return False

    def image(
        self, mount: Pose3, width: int, height: int, field_of_view: float, far: float
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
        """Nothing to see."""
        return np.zeros((height, width, 3), np.uint8), np.full((height, width), np.inf, np.float32)


class SquareRoom:
    """A RayCaster: four walls at x, y = ± HALF, endlessly high."""

    def cast(self, origins: Array, directions: Array, reach: float = math.inf) -> Array:
        """Distances in closed form; inf beyond `reach` and straight up."""
        with np.errstate(divide="ignore", invalid="ignore"):
            walls = (np.sign(directions[:, :2]) * HALF - origins[:, :2]) / directions[:, :2]
        found = np.where(walls > 0, walls, np.inf).min(axis=1)
        return np.where(found <= reach, found, np.inf)


@dataclass(frozen=True, eq=False)
class SensorContract(Contract):
    """Tried on a robot that turns in a square room."""

    role = "sensor"
    spec: Any
    subject: str = ""

    def readings(self, seed: int = 1) -> list[Reading]:
        """What it says of a turn, by the checks of every run."""
        robot = TurningRobot()
        clock = Clock(round(self.spec.rate) or 1)
        chance = Streams(seed).generator("sensor.tried")
        setting = SensorSetting("tried", 1, clock.seconds(1), chance, robot, SquareRoom(), WHEELS)
        sensor = heard("is built", lambda: InstalledSensor("tried", self.spec, setting))
        said = []
        for tick in range(READINGS):
            robot.turned = tick / 10
            said.append(heard("reads", sensor.read, tick))
        return said

    @promise
    def it_says_what_its_specification_says(self) -> None:
        """Given a turn in a room then each reading is of the promised kind, signed, and made of sound numbers."""
        demand(len(self.readings()) == READINGS, "says nothing")

    @promise
    def the_same_generator_gives_the_same_readings_bit_for_bit(self) -> None:
        """Given the same world and generator then the same readings: no clock, no chance but its own."""
        demand(all(map(_equal, self.readings(), self.readings())), "says something else of the same turn")

    @promise
    def nothing_changes_a_reading_later(self) -> None:
        """Given a reading then it stays as it is while the sensor goes on: the log and the stack keep it."""
        robot = TurningRobot()
        chance = Streams(1).generator("sensor.tried")
        setting = SensorSetting("tried", 1, 0.1, chance, robot, SquareRoom(), WHEELS)
        sensor = heard("is built", lambda: InstalledSensor("tried", self.spec, setting))
        first = heard("reads", sensor.read, 0)
        kept = copy.deepcopy(first)
        robot.turned = 0.7
        heard("reads", sensor.read, 1)
        demand(_equal(first, kept), "changes a reading that it has handed out")


def _equal(one: Reading, other: Reading) -> bool:
    if type(one) is not type(other):
        raise PromiseBroken(f"says {type(one).__name__} and {type(other).__name__}")
    pairs = [(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)]
    return all(np.array_equal(a, b, equal_nan=True) if isinstance(a, np.ndarray) else a == b for a, b in pairs)
