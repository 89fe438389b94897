"""Track of a moving obstacle: a Kalman filter with a constant-velocity model.

The acceleration is white and constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). The results are
those of filterpy's KalmanFilter with Q_discrete_white_noise. Because noise and measurements are isotropic, position and
velocity are complex numbers, and three values replace the covariance (4, 4).
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple


@dataclass(slots=True)
class ConstantVelocityFilter:
    """Position (m) and velocity (m/s) of a point as x + iy, with variances and covariance along any axis."""

    place: complex
    velocity: complex
    variance: float
    covariance: float
    velocity_variance: float

    def predict(self, seconds: float, acceleration: float) -> None:
        """Predict the state after `seconds`; `acceleration` is the standard deviation in m/s² along each axis."""
        noise, drift = (acceleration * seconds) ** 2, self.velocity_variance * seconds
        self.place += self.velocity * seconds
        self.variance += seconds * (2.0 * self.covariance + drift) + 0.25 * seconds * seconds * noise
        self.covariance += drift + 0.5 * seconds * noise
        self.velocity_variance += noise

    def correct(self, measured: complex, deviation: float) -> None:
        """Correct the state with a measured position, with its standard deviation in m along each axis."""
        off, noise = measured - self.place, deviation * deviation
        kept, gain = noise / (self.variance + noise), self.covariance / (self.variance + noise)
        self.place, self.velocity = measured - kept * off, self.velocity + gain * off
        self.velocity_variance -= gain * self.covariance
        self.variance *= kept
        self.covariance *= kept


LATELY = 10
"""Number of recent updates that are kept."""
FIRST_SPEED = 1.5
"""Standard deviation in m/s of the initial velocity."""


class Update(NamedTuple):
    """Update of a track: whether it `came` to formerly free space, or `stood` where something was hit before.

    `deviation` is the standard deviation in m of the position along any axis; `edges` is the number of visible edges.
    """

    tick: int
    place: complex
    deviation: float
    came: bool
    stood: bool
    edges: int


@dataclass(slots=True)
class Track(ConstantVelocityFilter):
    """State of a track with its `radius` in m, the position where it was `born`, and its last updates."""

    radius: float
    born: complex
    fast_at: int
    lately: deque[Update] = field(default_factory=lambda: deque(maxlen=LATELY))
    moving: bool = False
    moved: bool = False
    uncome: int = 0
    """Number of last updates that were not in formerly free space."""
    stands: int = 0
    """Number of last updates where something had been hit before."""

    @classmethod
    def begun(cls, tick: int, place: complex, deviation: float, radius: float) -> "Track":
        """Start a track at a position with a standard deviation in m, and with unknown velocity."""
        return cls(place, 0j, deviation * deviation, 0.0, FIRST_SPEED**2, radius, place, tick)

    @property
    def hit_at(self) -> int:
        """Tick of the last update."""
        return self.lately[-1].tick

    def note(self, tick: int, came: bool, stood: bool, edges: int, deviation: float) -> None:
        """Record an update with the standard deviation in m of the position."""
        self.lately.append(Update(tick, self.place, deviation, came, stood, edges))
        self.uncome = 0 if came else self.uncome + 1
        self.stands = self.stands + 1 if stood and not came else 0

    @property
    def place_deviation(self) -> float:
        """Standard deviation in m of the position along any axis."""
        return math.sqrt(self.variance)

    @property
    def speed_deviation(self) -> float:
        """Standard deviation in m/s of the velocity along any axis."""
        return math.sqrt(self.velocity_variance)
