"""Constant velocity: the Kalman filter of a point in the plane whose velocity wanders.

White acceleration, constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). The same as filterpy's
KalmanFilter with Q_discrete_white_noise. What is known is alike along all axes, as measurements and noise are: so place
and velocity are complex numbers, and of a covariance (4, 4) three are left. (Importing filterpy takes longer than half
a run.)
"""

from dataclasses import dataclass


@dataclass(slots=True)
class Point:
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
