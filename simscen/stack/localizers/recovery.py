"""Recovery of a lost filter by random particles.

Augmented MCL: Thrun, Burgard & Fox, Probabilistic Robotics, section 8.3.5 and table 8.3.
"""

import math

import numpy as np

from simscen.core.geometry import Array

PROBE_COUNT = 200
"""Number of random poses at which each scan is evaluated."""
MIN_BETTER_SHARE = 0.1
"""Minimum share of random poses that explain recent scans better than the particles if the filter is lost."""
MAX_STRAY_SCANS = 4.0
"""Limit of random particles and their descendants: as many as this number of scans may add."""
_MAX_LOG_RATIO = 50.0
"""Maximum logarithm of a likelihood ratio, so that its exponential stays finite."""


class Recovery:
    """Decides how many random particles to add, from a fast and a slow running average of how well scans fit.

    The book and nav2_amcl average the likelihood of the scans. It depends on the scene as much as on the pose: people,
    glass, and an outdated map lower it although the pose is right, and then good particles are replaced. Here, each
    scan is also evaluated at PROBE_COUNT random poses, and the average is that of the ratio of its likelihood at the
    particles to that at the random poses.

    Random particles are added while the fast average is below the slow one and at least MIN_BETTER_SHARE of the random
    poses explain the recent scans better than the particles. One scan adds at most the share `max_share`, because with
    flat weights it takes many scans to remove wrong particles. For the same reason, random particles and their
    descendants are limited as a whole; older ones make room for new ones.

    nav2_amcl resets both averages after it has added random particles, which ends a recovery after a few dozen
    particles. This is not necessary here, because particles that the last scan added at random are not part of the
    ratio. The averages are normalized from the first scan on.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, max_share: float = 1.0) -> None:
        self.is_enabled, self._max_share = alpha_fast > 0, max_share
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better_share = RunningAverage(alpha_fast)

    def observe(self, tracked: float, anywhere: Array) -> None:
        """Add a scan, by the log likelihoods of the mean over the particles (`tracked`) and at random poses (n,).

        The scale must be the same for all scans, see SensorModel.tempering.
        """
        best = float(anywhere.max())
        average = best + math.log(float(np.mean(np.exp(anywhere - best)))) if best > -np.inf else -np.inf
        ratio = math.exp(min(tracked - average, _MAX_LOG_RATIO)) if tracked > -np.inf else 0.0
        self._slow.add(ratio)
        self._fast.add(ratio)
        self._better_share.add(float(np.mean(anywhere > tracked)))

    @property
    def share(self) -> float:
        """Share of new particles to draw at random: 1 - fast / slow, limited to the maximum; 0 if not lost."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better_share.value < MIN_BETTER_SHARE:
            return 0.0
        return min(self._max_share, max(0.0, 1 - fast / slow))

    def kept_share(self, stray_weight: float) -> float:
        """Return the share of earlier random particles and descendants to keep, given their weight (0 … 1)."""
        allowed = min(1.0, MAX_STRAY_SCANS * self._max_share) - self.share
        return 1.0 if stray_weight <= allowed else max(0.0, allowed / stray_weight)


class RunningAverage:
    """Exponentially weighted average; with equal weights if `alpha` is zero.

    The weights are normalized from the first value on (Kingma & Ba, Adam, 2015, section 3).
    """

    def __init__(self, alpha: float) -> None:
        self._alpha, self._sum, self._weight = alpha, 0.0, 0.0

    def add(self, value: float) -> None:
        """Add a value."""
        decay = 1 - self._alpha
        self._sum, self._weight = decay * self._sum + value, decay * self._weight + 1

    @property
    def value(self) -> float:
        """The average, 0 before the first value."""
        return self._sum / self._weight if self._weight else 0.0
