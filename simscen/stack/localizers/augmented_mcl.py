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
"""Limit of random particles and their descendants ("strays"): the number that can be added at this many scans."""
_MAX_LOG_RATIO = 50.0
"""Maximum logarithm of a likelihood ratio, so that its exponential stays finite."""


class AugmentedMcl:
    """Decides how many random particles to add, from a fast and a slow running average of a likelihood ratio.

    The ratio is the likelihood of a scan at the particles, divided by its likelihood at PROBE_COUNT random poses.
    (nav2_amcl averages the likelihood itself, which also decreases if obstacles are not on the map.)

    Random particles are added while two conditions hold: the fast average is below the slow one, and at least
    MIN_BETTER_FRACTION of the random poses fit recent scans better than the particles.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, max_fraction: float = 1.0) -> None:
        """Take Nav2's recovery_alpha_slow and recovery_alpha_fast, and the largest fraction to add at one scan."""
        self.is_enabled, self._max_fraction = alpha_fast > 0, max_fraction
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better_fraction = RunningAverage(alpha_fast)

    def observe(self, tracked: float, anywhere: Array) -> None:
        """Add log likelihoods of a scan: `tracked`, the mean over the particles, and `anywhere` (n,), at random poses.

        Likelihoods of different scans must be comparable (see SensorModel.tempering_exponent).
        """
        best = float(anywhere.max())
        average = best + math.log(float(np.mean(np.exp(anywhere - best)))) if best > -np.inf else -np.inf
        ratio = math.exp(min(tracked - average, _MAX_LOG_RATIO)) if tracked > -np.inf else 0.0
        self._slow.add(ratio)
        self._fast.add(ratio)
        self._better_fraction.add(float(np.mean(anywhere > tracked)))

    @property
    def random_fraction(self) -> float:
        """Fraction of new particles to draw at random: 1 - fast / slow, at most `max_fraction`; 0 if not lost."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better_fraction.value < MIN_BETTER_FRACTION:
            return 0.0
        return min(self._max_fraction, max(0.0, 1 - fast / slow))

    def kept_fraction(self, stray_weight: float) -> float:
        """Return the fraction of earlier random particles and their descendants to keep, given their weight (0 … 1)."""
        allowed = min(1.0, MAX_STRAY_SCANS * self._max_fraction) - self.random_fraction
        return 1.0 if stray_weight <= allowed else max(0.0, allowed / stray_weight)


class RunningAverage:
    """Average with exponentially decaying weights, or with equal weights if `alpha` is zero. Without initial bias."""

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
