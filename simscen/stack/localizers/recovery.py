"""Noticing that the particles are all wrong.

Augmented MCL: Thrun, Burgard & Fox, Probabilistic Robotics, section 8.3.5 and table 8.3.
"""


class Recovery:
    """Compares a fast with a slow running average of the likelihood; when it has dropped, particles are put anywhere.

    Keeps to the book where nav2_amcl does not: the averages are not set to zero when particles were put anywhere
    (that ends the recovery after a few dozen of them, and 8 instead of 12 of 12 kidnapped robots were found), and the
    likelihood is not divided by the number of particles, which KLD-sampling changes. Where both begin at one extreme,
    the book at zero and nav2_amcl at the first scan's likelihood, which a fresh cloud around a good guess makes
    higher than any later one (70 % of the particles stayed random for good), the averages here are normalised.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float) -> None:
        self._slow, self._fast = RunningAverage(alpha_slow), RunningAverage(alpha_fast)

    def observe(self, likelihood: float) -> None:
        """Take in the average likelihood of a scan over the particles."""
        self._slow.add(likelihood)
        self._fast.add(likelihood)

    @property
    def share(self) -> float:
        """The share of new particles to put anywhere: 1 - w_fast / w_slow, or zero."""
        slow, fast = self._slow.value, self._fast.value
        return max(0.0, 1 - fast / slow) if slow > 0 else 0.0


class RunningAverage:
    """An exponentially weighted average of everything so far; of equal weights if `alpha` is zero.

    The weights are normalised from the first value on (Kingma & Ba, Adam, 2015, section 3).
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
