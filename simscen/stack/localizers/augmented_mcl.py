"""Augmented MCL: adds random particles to find a lost robot.

Source: Thrun, Burgard & Fox, Probabilistic Robotics, section 8.3.5 and table 8.3.
"""

import math

import numpy as np

from simscen.core.geometry import Array

PROBE_COUNT = 200
"""Number of random poses at which each scan is evaluated."""
MIN_BETTER_FRACTION = 0.1
"""The robot is lost only if at least this fraction of random poses fits recent scans better than the particles."""
MAX_STRAY_SCANS = 4.0
"""Limit of the weight of random particles and their descendants ("strays"), in units of the weight that can be added at
one scan."""
_MAX_LOG_RATIO = 50.0
"""Maximum logarithm of a likelihood ratio, so that its exponential stays finite."""


class AugmentedMcl:
    """Decides how many random particles to add, from a fast and a slow running average of a likelihood ratio.

    The ratio is the likelihood of a scan at the particles, divided by its likelihood at PROBE_COUNT random poses. In
    contrast, nav2_amcl averages the likelihood itself, which also decreases if obstacles are not on the map.

    Random particles are added while two conditions hold: the fast average is below the slow average, and at least
    MIN_BETTER_FRACTION of the random poses fit recent scans better than the particles.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, max_fraction: float = 1.0) -> None:
        """Take Nav2's recovery_alpha_slow and recovery_alpha_fast, and the maximum fraction to add at one scan."""
        self.is_enabled, self._max_fraction = alpha_fast > 0, max_fraction
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better_fraction = RunningAverage(alpha_fast)

    def observe(self, at_particles: float, at_random_poses: Array) -> None:
        """Add the log likelihoods of a scan: the mean over the particles, and the values (n,) at random poses.

        Likelihoods of different scans must be comparable (see SensorModel.tempering_exponent).
        """
        best = float(at_random_poses.max())
        average = best + math.log(float(np.mean(np.exp(at_random_poses - best)))) if best > -np.inf else -np.inf
        ratio = math.exp(min(at_particles - average, _MAX_LOG_RATIO)) if at_particles > -np.inf else 0.0
        self._slow.add(ratio)
        self._fast.add(ratio)
        self._better_fraction.add(float(np.mean(at_random_poses > at_particles)))

    @property
    def random_fraction(self) -> float:
        """Fraction of new particles to draw at random: 1 - fast / slow, at most `max_fraction`. 0 if not lost."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better_fraction.value < MIN_BETTER_FRACTION:
            return 0.0
        return min(self._max_fraction, max(0.0, 1 - fast / slow))

    def kept_fraction(self, stray_weight: float) -> float:
        """Return the fraction of the weight of strays to keep, given their present weight (0 … 1)."""
        max_weight = min(1.0, MAX_STRAY_SCANS * self._max_fraction) - self.random_fraction
        return 1.0 if stray_weight <= max_weight else max(0.0, max_weight / stray_weight)


class RunningAverage:
    """Average of all values with exponentially decaying weights; with equal weights if `alpha` is 0."""

    def __init__(self, alpha: float) -> None:
        self._alpha, self._sum, self._weight = alpha, 0.0, 0.0

    def add(self, value: float) -> None:
        """Add a value, after multiplying earlier weights by 1 - `alpha`."""
        decay = 1 - self._alpha
        self._sum, self._weight = decay * self._sum + value, decay * self._weight + 1

    @property
    def value(self) -> float:
        """The average; 0 before the first value."""
        return self._sum / self._weight if self._weight else 0.0
