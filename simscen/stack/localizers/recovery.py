"""Recovery of a lost filter by random particles.

Augmented MCL: Thrun, Burgard & Fox, Probabilistic Robotics, section 8.3.5 and table 8.3.
"""

import math

import numpy as np

from simscen.core.geometry import Array

PROBES = 200
"""Poses from anywhere that each scan is compared with."""
KNOWS_NOTHING = 0.1
"""The share of places that explain the scans as well as the particles do, from which on they may be lost."""
SCANS = 4.0
_MOST = 50.0
"""No logarithm of how much likelier counts for more, so that its exponential is a number."""


class Recovery:
    """Compares a fast with a slow running average of how much better the particles explain a scan than anywhere does.

    The book and nav2_amcl average the likelihood itself. It varies with the scene as much as with the pose: people,
    glass and a map that is out of date lower it, although the robot is where it thinks it is, and then good particles
    are thrown away. Here each scan is its own yardstick: it is weighed at PROBES random poses, too, and what is
    averaged is how many times likelier it is at the particles than there. Particles are put anywhere while the fast
    average is below the slow one *and* at least KNOWS_NOTHING of the places of the map explained the recent scans
    better than the particles; and never more than the share `most` with one scan: where weights are flat, scans weed
    them out slowly, and the third of the particles that averages soon ask for would take a good cloud apart. So would
    a few with each of many scans: all that stray, descendants included, are at most what SCANS scans put anywhere, and
    make room for new ones. When they are right the averages soon say that nobody is lost, and then nothing bounds them.

    nav2_amcl sets both averages to zero when it put particles anywhere ("to avoid spiraling off into complete
    randomness"), which ends a recovery after a few dozen of them. Nothing spirals here: particles that were put
    anywhere by the last scan are not asked how well the filter knows its place. The averages are normalized from the
    first scan on; the book begins at zero, nav2_amcl at the first scan's.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float, most: float = 1.0) -> None:
        self.wanted, self._most = alpha_fast > 0, most
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)
        self._better = RunningAverage(alpha_fast)

    def observe(self, tracked: float, anywhere: Array) -> None:
        """Take in the logarithms of how likely a scan is: of the average over the particles, and at random poses (n,).

        They are of one scale from scan to scan: see SensorModel.tempering.
        """
        best = float(anywhere.max())
        average = best + math.log(float(np.mean(np.exp(anywhere - best)))) if best > -np.inf else -np.inf
        likelier = math.exp(min(tracked - average, _MOST)) if tracked > -np.inf else 0.0
        self._slow.add(likelier)
        self._fast.add(likelier)
        self._better.add(float(np.mean(anywhere > tracked)))

    @property
    def share(self) -> float:
        """The share of new particles to put anywhere: 1 - fast / slow, but at most what the model bears; or zero."""
        slow, fast = self._slow.value, self._fast.value
        if slow <= 0 or self._better.value < KNOWS_NOTHING:
            return 0.0
        return min(self._most, max(0.0, 1 - fast / slow))

    def kept(self, straying: float) -> float:
        """What share of the particles that stray is kept beside new ones, if these weigh `straying` (0 … 1)."""
        room = min(1.0, SCANS * self._most) - self.share
        return 1.0 if straying <= room else max(0.0, room / straying)


class RunningAverage:
    """An exponentially weighted average of everything so far; of equal weights if `alpha` is zero.

    The weights are normalized from the first value on (Kingma & Ba, Adam, 2015, section 3).
    """

    def __init__(self, alpha: float) -> None:
        self._alpha, self._sum, self._weight = alpha, 0.0, 0.0

    def add(self, value: float) -> None:
        """Take in the next value."""
        kept = 1 - self._alpha
        self._sum, self._weight = kept * self._sum + value, kept * self._weight + 1

    @property
    def value(self) -> float:
        """The average; zero before the first value."""
        return self._sum / self._weight if self._weight else 0.0
