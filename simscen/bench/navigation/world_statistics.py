"""What drives say of worlds like theirs: drives in one world are no independent evidence of others."""

from collections.abc import Iterable
from dataclasses import dataclass

from simscen.core.random_streams import Streams
from simscen.core.statistics import MIN_PAIRS, bootstrap_mean_interval, wilson_interval

Interval = tuple[float, float]


@dataclass(frozen=True)
class ClusteredMean:
    """A number of each drive, by its world. In means every drive counts the same, and worlds are drawn whole."""

    of_worlds: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, values: Iterable[tuple[str, float]]) -> "ClusteredMean":
        """Of pairs of a drive's world and number."""
        worlds: dict[str, list[float]] = {}
        for world, value in values:
            worlds.setdefault(world, []).append(value)
        return cls(tuple(map(tuple, worlds.values())))

    @property
    def mean(self) -> float | None:
        """Of all drives; None without any."""
        drives = sum(map(len, self.of_worlds))
        return sum(map(sum, self.of_worlds)) / drives if drives else None

    def interval(self) -> Interval | None:
        """Between what bounds the mean lies with 95 %, by bootstrap over worlds; None of fewer than five worlds."""
        means = [sum(values) / len(values) for values in self.of_worlds]
        return bootstrap_mean_interval(
            means, Streams(1).generator("worlds"), [len(values) for values in self.of_worlds]
        )

    def interval_of_rates(self) -> Interval | None:
        """The same of rates: where all worlds say the same, a bootstrap has no width, and it is Wilson's, each world a
        trial.
        """
        rate = self._common()
        return self.interval() if rate is None else wilson_interval(rate * len(self.of_worlds), len(self.of_worlds))

    def interval_of_changes(self) -> Interval | None:
        """The same of differences of rates; that no world has changed does not say that none would."""
        change = self._common()
        if change is None:
            return self.interval()
        low, high = wilson_interval(abs(change) * len(self.of_worlds), len(self.of_worlds))
        if change == 0.0:
            return -high, high
        return (low, high) if change > 0.0 else (-high, -low)

    def _common(self) -> float | None:
        """What all worlds say, where they are enough and all say the same."""
        means = {sum(values) / len(values) for values in self.of_worlds}
        return means.pop() if len(self.of_worlds) >= MIN_PAIRS and len(means) == 1 else None
