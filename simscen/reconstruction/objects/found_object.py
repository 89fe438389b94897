"""Data of an object that the scans show but the map does not contain: shape, keyframes, and fitted pedestrian."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.core.geometry import Array
from simscen.reconstruction.reasons import Reason

Keyframe = tuple[float, float, float, float]
"""Time in s since the start of the drive, and pose x, y, yaw in the map frame."""


@dataclass(frozen=True, eq=False)
class FittedPedestrian:
    """Pedestrian whose simulated motion next to the recorded robot approximates the track of a person.

    Attributes:
        appear_time: Time in s at which the pedestrian appears.
        walker: Start, goals, speed, and behavior of the pedestrian.
        times: Times (n,) in s of the simulation.
        positions: Positions (n, 2) in the map frame of the pedestrian in the simulation.
        rmse: RMSE in m between the simulated positions and the track.
        time_shift: Absolute value in s of the time shift with which the positions fit the track best.
        meets_robot: Whether the robot came so near that the track shows how the person reacts to the robot.
    """

    appear_time: float
    walker: WalkingPedestrian
    times: Array
    positions: Array
    rmse: float
    time_shift: float
    meets_robot: bool = False

    @property
    def summary(self) -> str:
        """Summary of the fit: the RMSE, and how the pedestrian reacts to the robot."""
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
        size: (length, width) of a box in m, or (radius,) of a cylinder.
        keyframes: Poses in order of time; one keyframe for a standing object.
        appear_time: Time in s at which the object appears; None for the start of the drive.
        disappear_time: Time in s at which the object disappears; None if it stays.
        reason: Observation of the object in the log.
        is_robot: Whether the object is another robot, whose poses are in the log.
        pedestrian: Fitted pedestrian; None if the object is no person or no pedestrian fits.
    """

    name: str
    size: tuple[float, ...]
    keyframes: tuple[Keyframe, ...]
    appear_time: float | None = None
    disappear_time: float | None = None
    reason: Reason = field(default_factory=lambda: Reason(""))
    is_robot: bool = False
    pedestrian: FittedPedestrian | None = None

    @property
    def is_moving(self) -> bool:
        """Whether the object moves."""
        return len(self.keyframes) > 1

    @property
    def is_cylinder(self) -> bool:
        """Whether the object is an upright cylinder instead of a box."""
        return len(self.size) == 1

    @property
    def radius(self) -> float:
        """Radius in m of the circle around the outline."""
        return self.size[0] if self.is_cylinder else math.hypot(*self.size) / 2

    def is_present(self, time: float) -> bool:
        """Return whether the object is present at a time in s."""
        return (self.appear_time or 0.0) <= time and (self.disappear_time is None or time < self.disappear_time)

    def poses_at(self, times: Array) -> Array:
        """Return the poses x, y, yaw (n, 3) at `times` (n,) by linear interpolation between the keyframes."""
        keyframes = np.array(self.keyframes)
        return np.column_stack([np.interp(times, keyframes[:, 0], keyframes[:, axis]) for axis in (1, 2, 3)])

    @property
    def comment(self) -> str:
        """The reason as one line, with the summary of the fitted pedestrian if there is one."""
        if self.pedestrian is None:
            return self.reason.comment
        return replace(self.reason, text=f"{self.reason.text}; {self.pedestrian.summary}").comment
