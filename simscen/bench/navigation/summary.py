"""Summary of the runs of `simscen bench nav` with the scores of published benchmarks, and comparison of two stacks.

An experiment has several drives (scenarios). Each drive is run with several seeds. A trial is one of these runs.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from simscen.core.random_streams import Streams
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Status
from simscen.core.statistics import MIN_PAIRS, bootstrap_mean_interval, wilson_interval
from simscen.judge.metrics.compute import barn_score
from simscen.run.lockstep import TIME_LIMIT

Interval = tuple[float, float]
"""Lower and upper limit of a 95 % confidence interval."""


class TrialOutcome(str, Enum):
    """Outcome of a trial. FAILED is any failure other than a collision or timeout. ERROR is an aborted run."""

    SUCCESS = "success"
    COLLISION = "collision"
    TIMEOUT = "timeout"
    FAILED = "failed"
    ERROR = "error"


@dataclass(frozen=True)
class Trial:
    """One run of a drive in the world named `world`.

    `reference_length` is the length in m of the reference path for the BARN score; None without a score. `top_speed` is
    the maximum speed of the robot in m/s; None if unknown.
    """

    run: RunFinished
    reference_length: float | None = None
    world: str = ""
    top_speed: float | None = None

    @property
    def outcome(self) -> TrialOutcome:
        """Outcome of the run. A run with a collision and a timeout counts as COLLISION."""
        if self.run.outcome is Outcome.ERROR:
            return TrialOutcome.ERROR
        if any(v.criterion == "collisions" and v.status is Status.FAIL for v in self.run.result.verdicts):
            return TrialOutcome.COLLISION
        if self.run.outcome is Outcome.PASSED:
            return TrialOutcome.SUCCESS
        return TrialOutcome.TIMEOUT if self.run.result.ended == TIME_LIMIT else TrialOutcome.FAILED

    @property
    def succeeded(self) -> bool:
        """Whether the outcome is SUCCESS."""
        return self.outcome is TrialOutcome.SUCCESS

    @property
    def score(self) -> float | None:
        """BARN score, or None without a reference length. A trial without success scores 0."""
        if self.reference_length is None:
            return None
        seconds = self.metric("time_to_goal")
        return barn_score(self.succeeded and seconds is not None, seconds or 0.0, self.reference_length)

    @property
    def sct(self) -> float | None:
        """Success weighted by completion time (SCT, Yokoyama et al. 2021); None if a required value is unknown.

        SCT is the time for the shortest path at top speed divided by the time to the goal; 0 without success.
        """
        if not self.succeeded:
            return 0.0
        seconds, length = self.metric("time_to_goal"), self.metric("shortest_length")
        if seconds is None or length is None or self.top_speed is None:
            return None
        min_seconds = length / self.top_speed
        return min_seconds / max(min_seconds, seconds)

    def metric(self, name: str) -> float | None:
        """Return a metric of the run, averaged over all robots; None if no robot has this metric."""
        return mean([value for key, value in self.run.result.metrics.items() if key.split("/")[-1] == name])


@dataclass(frozen=True)
class ExperimentSummary:
    """Summary of one experiment. The names of the fields are keys of the JSON output. Means are None without values.

    case:             name of the experiment
    runs:             number of runs
    success, collisions, timeouts, failed, errors: fraction of the runs with each TrialOutcome
    success_interval: interval of `success`; None with fewer than five worlds
    seconds:          mean time to the goal in s, over successful runs
    score:            mean BARN score
    path_ratio:       mean of driven length divided by shortest length, over successful runs
    sct:              mean SCT; None if a run has no SCT
    """

    case: str
    runs: int
    success: float
    success_interval: Interval | None
    collisions: float
    timeouts: float
    failed: float
    errors: float
    seconds: float | None
    score: float | None
    path_ratio: float | None
    sct: float | None


def summarize(experiment: str, trials: Sequence[Trial]) -> ExperimentSummary:
    """Return the summary of the trials of an experiment."""
    outcomes = [trial.outcome for trial in trials]
    rates = {outcome: outcomes.count(outcome) / len(trials) if trials else 0.0 for outcome in TrialOutcome}
    sct_values = [trial.sct for trial in trials]
    arrived = [trial for trial in trials if trial.succeeded and trial.metric("time_to_goal") is not None]
    return ExperimentSummary(
        case=experiment,
        runs=len(trials),
        success=rates[TrialOutcome.SUCCESS],
        success_interval=success_interval(trials),
        collisions=rates[TrialOutcome.COLLISION],
        timeouts=rates[TrialOutcome.TIMEOUT],
        failed=rates[TrialOutcome.FAILED],
        errors=rates[TrialOutcome.ERROR],
        seconds=mean([trial.metric("time_to_goal") for trial in arrived]),
        score=mean([trial.score for trial in trials]),
        path_ratio=mean([trial.metric("path_length_ratio") for trial in arrived]),
        sct=None if None in sct_values else mean(sct_values),
    )


def success_interval(trials: Sequence[Trial]) -> Interval | None:
    """Return the interval of the success rate; None with fewer than five worlds."""
    return ClusteredMean.from_pairs((trial.world, float(trial.succeeded)) for trial in trials).rate_interval()


def mean(values: Sequence[float | None]) -> float | None:
    """Return the mean of all values except None; None without such values."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


@dataclass(frozen=True)
class ClusteredMean:
    """Mean of the values of trials with a confidence interval from a cluster bootstrap over worlds.

    Each trial has the same weight. `values_by_world` has one tuple for each world, with the values of its trials.
    """

    values_by_world: tuple[tuple[float, ...], ...]

    @classmethod
    def from_pairs(cls, pairs: Iterable[tuple[str, float]]) -> "ClusteredMean":
        """Group values by world. A pair is the name of the world and the value of one trial."""
        worlds: dict[str, list[float]] = {}
        for world, value in pairs:
            worlds.setdefault(world, []).append(value)
        return cls(tuple(map(tuple, worlds.values())))

    @property
    def mean(self) -> float | None:
        """Mean over all trials; None without trials."""
        trials = sum(map(len, self.values_by_world))
        return sum(map(sum, self.values_by_world)) / trials if trials else None

    def interval(self) -> Interval | None:
        """Return the bootstrap interval of the mean; None with fewer than five worlds."""
        means = [sum(values) / len(values) for values in self.values_by_world]
        return bootstrap_mean_interval(
            means, Streams(1).generator("worlds"), [len(values) for values in self.values_by_world]
        )

    def rate_interval(self) -> Interval | None:
        """Return the interval of a rate; None with fewer than five worlds.

        If all worlds have the same rate, return the Wilson interval with one trial per world. The bootstrap interval
        would have zero width.
        """
        interval = self.rate_difference_interval()
        return None if interval is None else (max(0.0, interval[0]), interval[1])

    def rate_difference_interval(self) -> Interval | None:
        """Return the interval of a difference of rates; None with fewer than five worlds.

        If all worlds have the same difference, return a Wilson interval, as `rate_interval` does.
        """
        means = {sum(values) / len(values) for values in self.values_by_world}
        count = len(self.values_by_world)
        if count < MIN_PAIRS or len(means) > 1:
            return self.interval()
        change = means.pop()
        low, high = wilson_interval(abs(change) * count, count)
        if change == 0.0:
            return -high, high
        return (low, high) if change > 0.0 else (-high, -low)


TrialPair = tuple[Trial, Trial]
"""Trials of the baseline stack and of the compared stack, in the same drive and with the same seed."""


@dataclass(frozen=True)
class Difference:
    """Mean over trial pairs of the compared stack's value minus the baseline stack's value.

    `interval` is the confidence interval of this mean; None with fewer than five worlds.
    """

    mean: float
    interval: Interval | None


@dataclass(frozen=True)
class ExperimentComparison:
    """Comparison of two stacks in one experiment. The names of the fields are keys of the JSON output.

    case:    name of the experiment
    pairs:   number of trial pairs without an aborted run
    better:  number of pairs in which only the compared stack succeeded
    worse:   number of pairs in which only the baseline stack succeeded
    success: difference of the success rates
    seconds: difference of the times to the goal, over pairs in which both succeeded; None without such pairs
    sct:     difference of the SCT; None if no pair has two values
    score:   difference of the BARN scores; None if no pair has two values
    """

    case: str
    pairs: int
    better: int
    worse: int
    success: Difference
    seconds: Difference | None
    sct: Difference | None
    score: Difference | None


def compare_experiment(experiment: str, baseline: Sequence[Trial], other: Sequence[Trial]) -> ExperimentComparison:
    """Compare the trials of two stacks, which must have the same worlds and seeds in the same order.

    Raises ValueError otherwise.
    """
    pairs = list(zip(baseline, other, strict=True))
    if any(first.world != second.world or first.run.key.seed != second.run.key.seed for first, second in pairs):
        raise ValueError(f"{experiment}: the runs are not of the same drives")
    completed = [pair for pair in pairs if TrialOutcome.ERROR not in (pair[0].outcome, pair[1].outcome)]
    both_succeeded = [pair for pair in completed if pair[0].succeeded and pair[1].succeeded]
    success = _difference(completed, lambda trial: float(trial.succeeded), is_rate=True)
    return ExperimentComparison(
        case=experiment,
        pairs=len(completed),
        better=sum(second.succeeded and not first.succeeded for first, second in completed),
        worse=sum(first.succeeded and not second.succeeded for first, second in completed),
        success=success or Difference(0.0, None),
        seconds=_difference(both_succeeded, lambda trial: trial.metric("time_to_goal")),
        sct=_difference(completed, lambda trial: trial.sct),
        score=_difference(completed, lambda trial: trial.score),
    )


def _difference(
    pairs: Sequence[TrialPair], measure: Callable[[Trial], float | None], is_rate: bool = False
) -> Difference | None:
    """Return the difference of a measure; None if no pair has two values.

    If `is_rate` is true, the interval is a `rate_difference_interval`.
    """
    measured = ((first.world, measure(first), measure(second)) for first, second in pairs)
    differences = ClusteredMean.from_pairs(
        (world, b - a) for world, a, b in measured if a is not None and b is not None
    )
    if differences.mean is None:
        return None
    return Difference(differences.mean, differences.rate_difference_interval() if is_rate else differences.interval())
