"""Objects that the scans show and the map does not: what they are like, and where they are over time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.core.geometry import Array
from simscen.reconstruction.reasons import Reason

Keyframe = tuple[float, float, float, float]
"""Time in s since the start of the drive, x, y, yaw."""


@dataclass(frozen=True, eq=False)
class FittedPedestrian:
    """Pedestrian of the scenario language that walks like a tracked person.

    Attributes:
        begin: Time in s at which it appears.
        walker: Its start, goals, speed, and behavior.
        times: Times (n,) in s of a simulation of the pedestrian in the recorded drive.
        positions: Its positions (n, 2) in the simulation.
        rmse: RMSE in m of these positions from the track.
        time_shift: Time in s by which the simulation is late or early.
        meets_robot: Whether the robot came so near that the track shows whether the person evades it.
    """

    begin: float
    walker: WalkingPedestrian
    times: Array
    positions: Array
    rmse: float
    time_shift: float
    meets_robot: bool = False

    @property
    def sentence(self) -> str:
        """How well the pedestrian reproduces the track."""
        reaction = ""
        if self.walker.blind_to:
            reaction = " if it does not evade the robot"
        elif self.walker.reacts_for:
            reaction = " if it stops to look at the robot"
        return f"a pedestrian walks within {self.rmse:.2f} m RMSE of the track{reaction}"


@dataclass(frozen=True)
class FoundObject:
    """An object that is not on the map.

    Attributes:
        name: Name in the scenario.
        size: Length and width in m of a box, or the radius of a cylinder alone.
        keyframes: Poses over time; a single one for an object that stands.
        appears: Time in s at which it appears; None if it is there from the start.
        disappears: Time in s at which it disappears; None if it stays.
        reason: Why it is there.
        is_robot: Whether it is another robot, whose poses are in the log.
        pedestrian: How a pedestrian walks that reproduces the keyframes; None if it is no person or none does.
    """

    name: str
    size: tuple[float, ...]
    keyframes: tuple[Keyframe, ...]
    appears: float | None = None
    disappears: float | None = None
    reason: Reason = field(default_factory=lambda: Reason(""))
    is_robot: bool = False
    pedestrian: FittedPedestrian | None = None

    @property
    def is_moving(self) -> bool:
        """Whether it moves."""
        return len(self.keyframes) > 1

    @property
    def is_cylinder(self) -> bool:
        """Whether it is an upright cylinder; otherwise it is a box."""
        return len(self.size) == 1

    @property
    def radius(self) -> float:
        """Radius in m of the circle around its outline."""
        return self.size[0] if self.is_cylinder else math.hypot(*self.size) / 2

    def is_there(self, time: float) -> bool:
        """Return whether it is there at a time in s."""
        return (self.appears or 0.0) <= time and (self.disappears is None or time < self.disappears)

    def poses_at(self, times: Array) -> Array:
        """Return its poses x, y, yaw (n, 3) at `times` (n,) by its keyframes."""
        frames = np.array(self.keyframes)
        return np.column_stack([np.interp(times, frames[:, 0], frames[:, axis]) for axis in (1, 2, 3)])

    @property
    def comment(self) -> str:
        """Why it is there, and as what, in one line."""
        if self.pedestrian is None:
            return self.reason.comment
        return replace(self.reason, text=f"{self.reason.text}; {self.pedestrian.sentence}").comment
