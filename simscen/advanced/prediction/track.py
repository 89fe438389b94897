"""Constant velocity: the Kalman filter of a point in the plane whose velocity wanders.

White acceleration, constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). The same as filterpy's
KalmanFilter with Q_discrete_white_noise. What is known is alike along all axes, as measurements and noise are: so place
and velocity are complex numbers, and of a covariance (4, 4) three are left. (Importing filterpy takes longer than half
a run.)
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple


@dataclass(slots=True)
class ConstantVelocityFilter:
    """A point's place (m) and velocity (m/s), x + iy; along any axis, the variances of both, and their covariance."""

    place: complex
    velocity: complex
    variance: float
    covariance: float
    velocity_variance: float

    def predict(self, seconds: float, acceleration: float) -> None:
        """It is so much later; `acceleration` is its standard deviation in m/s² along each axis."""
        noise, drift = (acceleration * seconds) ** 2, self.velocity_variance * seconds
        self.place += self.velocity * seconds
        self.variance += seconds * (2.0 * self.covariance + drift) + 0.25 * seconds * seconds * noise
        self.covariance += drift + 0.5 * seconds * noise
        self.velocity_variance += noise

    def correct(self, measured: complex, deviation: float) -> None:
        """Its place was measured, with this standard deviation in m along each axis."""
        off, noise = measured - self.place, deviation * deviation
        kept, gain = noise / (self.variance + noise), self.covariance / (self.variance + noise)
        self.place, self.velocity = measured - kept * off, self.velocity + gain * off
        self.velocity_variance -= gain * self.covariance
        self.variance *= kept
        self.covariance *= kept


LATELY = 10
"""Updates that are looked at: who turns round has not come far from where he was first seen."""
FIRST_SPEED = 1.5
"""m/s: standard deviation of the velocity of what has just been seen."""


class Update(NamedTuple):
    """When and where a track was hit; whether it stood where it had been free, or where something had been hit before.

    `deviation` is the standard deviation in m of the place, along any axis, `edges` how many of its two ends were seen.
    """

    tick: int
    place: complex
    deviation: float
    came: bool
    stood: bool
    edges: int


@dataclass(slots=True)
class Track(ConstantVelocityFilter):
    """What is known of a track: besides its state its `radius` in m, where it was `born`, and its last updates."""

    radius: float
    born: complex
    fast_at: int
    lately: deque[Update] = field(default_factory=lambda: deque(maxlen=LATELY))
    moving: bool = False
    moved: bool = False
    uncome: int = 0
    """Its last updates in which it has not stood where it had been free, …"""
    stands: int = 0
    """… and in which it stood where something had been hit before."""

    @classmethod
    def begun(cls, tick: int, place: complex, deviation: float, radius: float) -> "Track":
        """At a place that is known to so many meters, and of unknown speed."""
        return cls(place, 0j, deviation * deviation, 0.0, FIRST_SPEED**2, radius, place, tick)

    @property
    def hit_at(self) -> int:
        """When it was last hit."""
        return self.lately[-1].tick

    def note(self, tick: int, came: bool, stood: bool, edges: int, deviation: float) -> None:
        """Note that it was hit, and how well its place is known by that, in m."""
        self.lately.append(Update(tick, self.place, deviation, came, stood, edges))
        self.uncome = 0 if came else self.uncome + 1
        self.stands = self.stands + 1 if stood and not came else 0

    @property
    def place_deviation(self) -> float:
        """Standard deviation in m of its place, along any axis."""
        return math.sqrt(self.variance)

    @property
    def speed_deviation(self) -> float:
        """The same in m/s of its velocity."""
        return math.sqrt(self.velocity_variance)
