"""A stack against another in the same drives: nothing but their differences counts, world by world."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from simscen.bench.navigation.summary import DriveOutcome, Trial
from simscen.bench.navigation.world_statistics import ClusteredMean

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
