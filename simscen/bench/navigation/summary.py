"""Many runs of one case, summed up in the columns in which navigation benchmarks are published."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from simscen.bench.navigation.world_statistics import ClusteredMean
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Status
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
