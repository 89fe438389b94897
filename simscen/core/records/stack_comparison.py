"""Stacks beside each other on the same scenarios and seeds."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OutcomeCounts:
    """How many runs came out how."""

    passed: int = 0
    failed: int = 0
    errors: int = 0

    @property
    def decided(self) -> int:
        """The runs that say something about the robot: an error says nothing."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Flip:
    """A seed of a scenario that passes with one of two stacks and fails with the other; `why` is what it failed of."""

    scenario: str
    seed: int
    passed: str
    failed: str
    why: str


@dataclass(frozen=True)
class MetricDifference:
    """A metric of a stack minus that of the baseline, over the `pairs` of runs that can be compared.

    `baseline` and `value` are the means of these runs, `interval` that of the mean difference with 95 %, None for too
    few pairs. `lower`, `equal` and `higher` count pairs; `p` is the sign test of lower and higher.
    """

    metric: str
    unit: str
    pairs: int
    baseline: float
    value: float
    difference: float
    interval: tuple[float, float] | None
    lower: int
    equal: int
    higher: int
    p: float


@dataclass(frozen=True)
class BaselineComparison:
    """One stack against the baseline: the `pairs` of runs that both came to an end, and what was left out.

    `broken` pairs have a run that could not be completed, `alone` runs have no partner at all. `parted` are the pairs
    of which only one reached the last goal: how they drove is compared in nothing but collisions. `p` is the sign test
    of the flips.
    """

    stack: str
    pairs: int
    broken: int
    alone: int
    parted: int
    flips: tuple[Flip, ...]
    p: float
    differences: tuple[MetricDifference, ...]


@dataclass(frozen=True)
class Comparison:
    """`stacks` maps names to what was given as --stack, in that order; the first is the baseline of the others.

    `outcomes` are for each scenario those of each stack, by name.
    """

    stacks: Mapping[str, str]
    outcomes: Mapping[str, Mapping[str, OutcomeCounts]]
    against: tuple[BaselineComparison, ...]

    @property
    def baseline(self) -> str:
        """What the others are compared with."""
        return next(iter(self.stacks))

    def total(self, stack: str) -> OutcomeCounts:
        """All scenarios together."""
        counts = [row[stack] for row in self.outcomes.values()]
        return OutcomeCounts(*(sum(getattr(one, name) for one in counts) for name in ("passed", "failed", "errors")))
