"""Many runs of one case, summed up in the columns in which navigation benchmarks are published."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from simscen.core.random_streams import Streams
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Status
from simscen.core.statistics import MIN_PAIRS, bootstrap_mean_interval, wilson_interval
from simscen.judge.metrics.compute import barn_score

TIME_IS_UP = "time limit"
"""What a run's `ended` says when nothing else ended it."""


class DriveOutcome(str, Enum):
    """How a run came out; exactly one of these."""

    SUCCESS = "success"
    COLLISION = "collision"
    TIMEOUT = "timeout"
    FAILED = "failed"
    ERROR = "error"


@dataclass(frozen=True)
class Trial:
    """A run, the reference length in meters that its score refers to (None = the case has no score), and its world.

    `top_speed` is the robot's, in m/s.
    """

    run: RunFinished
    reference_length: float | None = None
    world: str = ""
    top_speed: float | None = None

    @property
    def fate(self) -> DriveOutcome:
        """A collision outweighs all else that went wrong; whoever ran out of time did not merely fail."""
        if self.run.outcome is Outcome.ERROR:
            return DriveOutcome.ERROR
        if any(v.criterion == "collisions" and v.status is Status.FAIL for v in self.run.result.verdicts):
            return DriveOutcome.COLLISION
        if self.run.outcome is Outcome.PASSED:
            return DriveOutcome.SUCCESS
        return DriveOutcome.TIMEOUT if self.run.result.ended == TIME_IS_UP else DriveOutcome.FAILED

    @property
    def score(self) -> float | None:
        """BARN's; None where the case has none."""
        if self.reference_length is None:
            return None
        seconds = self.metric("time_to_goal")
        return barn_score(
            self.fate is DriveOutcome.SUCCESS and seconds is not None, seconds or 0.0, self.reference_length
        )

    @property
    def sct(self) -> float | None:
        """Success weighted by completion time, for which the shortest way at top speed is the least; None where nobody
        was to arrive. (Yokoyama et al. 2021.)
        """
        if self.fate is not DriveOutcome.SUCCESS:
            return 0.0
        seconds, way = self.metric("time_to_goal"), self.metric("shortest_length")
        if seconds is None or way is None or self.top_speed is None:
            return None
        least = way / self.top_speed
        return least / max(least, seconds)

    def metric(self, name: str) -> float | None:
        """A number that the judge measured; of several robots the mean."""
        return mean([value for key, value in self.run.result.metrics.items() if key.split("/")[-1] == name])


@dataclass(frozen=True)
class Row:
    """One line of the table. Rates are of all runs; seconds and path ratio are means over those that arrived.

    `path_ratio` is driven over shortest length; `sct` is None where nobody is to arrive. `success_interval` is the 95 %
    interval of the success rate in worlds like these, None where there are too few: seeds tell of the noise in a world,
    not of other worlds.
    """

    case: str
    runs: int
    success: float
    success_interval: tuple[float, float] | None
    collisions: float
    timeouts: float
    failed: float
    errors: float
    seconds: float | None
    score: float | None
    path_ratio: float | None
    sct: float | None


def summarize(case: str, trials: Sequence[Trial]) -> Row:
    """Sum up the runs of a case. Raises ValueError without any."""
    fates = [trial.fate for trial in trials]
    weighted = [trial.sct for trial in trials]
    good = [trial for trial in trials if trial.fate is DriveOutcome.SUCCESS]
    arrived = [trial for trial in good if trial.metric("time_to_goal") is not None]
    return Row(
        case=case,
        runs=len(trials),
        success=_rate(fates, DriveOutcome.SUCCESS),
        success_interval=over_worlds(trials),
        collisions=_rate(fates, DriveOutcome.COLLISION),
        timeouts=_rate(fates, DriveOutcome.TIMEOUT),
        failed=_rate(fates, DriveOutcome.FAILED),
        errors=_rate(fates, DriveOutcome.ERROR),
        seconds=mean([trial.metric("time_to_goal") for trial in arrived]),
        score=mean([trial.score for trial in trials]),
        path_ratio=mean([trial.metric("path_length_ratio") for trial in arrived]),
        sct=None if None in weighted else mean(weighted),
    )


def over_worlds(trials: Sequence[Trial]) -> tuple[float, float] | None:
    """Between what bounds the success rate lies with 95 % in worlds like these; None of fewer than five worlds."""
    return ClusteredMean.of(
        (trial.world, float(trial.fate is DriveOutcome.SUCCESS)) for trial in trials
    ).interval_of_rates()


def _rate(fates: Sequence[DriveOutcome], which: DriveOutcome) -> float:
    return fates.count(which) / len(fates) if fates else 0.0


def mean(values: Sequence[float | None]) -> float | None:
    """The mean of the values that are there; None when none is."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


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


Pair = tuple[Trial, Trial]


@dataclass(frozen=True)
class Difference:
    """The mean of `other` less `reference`; its 95 % interval by bootstrap over worlds, None of fewer than five."""

    mean: float
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class DriveComparison:
    """`other` less `reference`: success rate, seconds where both arrived, SCT, BARN's score where there is one.

    `better` and `worse` count the runs that only one of them succeeded in.
    """

    case: str
    pairs: int
    better: int
    worse: int
    success: Difference
    seconds: Difference | None
    sct: Difference | None
    score: Difference | None


def compare_drives(case: str, reference: Sequence[Trial], other: Sequence[Trial]) -> DriveComparison:
    """Compare trials of the same drives and seeds, in the same order. Raises ValueError where they are not."""
    pairs = list(zip(reference, other, strict=True))
    if any(one.world != two.world or one.run.key.seed != two.run.key.seed for one, two in pairs):
        raise ValueError(f"{case}: the runs are not of the same drives")
    decided = [pair for pair in pairs if DriveOutcome.ERROR not in (pair[0].fate, pair[1].fate)]
    success = _difference(decided, lambda trial: float(_won(trial)), rate=True)
    return DriveComparison(
        case=case,
        pairs=len(decided),
        better=sum(_won(two) > _won(one) for one, two in decided),
        worse=sum(_won(two) < _won(one) for one, two in decided),
        success=success or Difference(0.0, None),
        seconds=_difference([pair for pair in decided if all(map(_won, pair))], lambda t: t.metric("time_to_goal")),
        sct=_difference(decided, lambda trial: trial.sct),
        score=_difference(decided, lambda trial: trial.score),
    )


def _won(trial: Trial) -> bool:
    return trial.fate is DriveOutcome.SUCCESS


def _difference(
    pairs: Sequence[Pair], measure: Callable[[Trial], float | None], rate: bool = False
) -> Difference | None:
    """None where no pair has the measure."""
    both = ((one.world, measure(one), measure(two)) for one, two in pairs)
    differences = ClusteredMean.of((world, b - a) for world, a, b in both if a is not None and b is not None)
    if differences.mean is None:
        return None
    return Difference(differences.mean, differences.interval_of_changes() if rate else differences.interval())
