"""Comparison of the results of several stacks, or of several sessions (calls of `simscen run`), with a baseline."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OutcomeCounts:
    """Number of runs by outcome. A run that failed as expected counts as failed."""

    passed: int = 0
    failed: int = 0
    errors: int = 0

    @property
    def decided(self) -> int:
        """Number of runs that were completed."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Flip:
    """Scenario and seed for which only one of two stacks or sessions passed.

    `passed` and `failed` are the names of the stack or session that passed and that failed. `why` describes the first
    violation of the run that failed.
    """

    scenario: str
    seed: int
    passed: str
    failed: str
    why: str


@dataclass(frozen=True)
class MetricDifference:
    """Difference of a metric between a stack or session and the baseline.

    Attributes:
        pairs: Number of pairs of runs. Both runs of a pair have the same scenario, variation, and seed.
        baseline: Mean of the metric for the baseline.
        value: Mean of the metric for the stack or session.
        difference: `value` minus `baseline`.
        interval: 95 % confidence interval of the difference; None for too few pairs.
        lower: Number of pairs with a lower value than the baseline. `equal` and `higher` are analogous.
        p: P-value of Wilcoxon's signed-rank test.
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
class ScenarioChange:
    """Significant change of the pass rate or of the mean of a metric, relative to the baseline.

    `scenario` is the id of a scenario or "all scenarios". `what` is "pass rate" or the name of a metric. `baseline` and
    `value` are the means for the baseline and for the other stack or session. `p` is the p-value with Holm's adjustment
    for multiple tests. `is_worse` is None for a metric of which neither higher nor lower values are better.
    """

    scenario: str
    what: str
    unit: str
    pairs: int
    baseline: float
    value: float
    p: float
    is_worse: bool | None


@dataclass(frozen=True)
class BaselineComparison:
    """Comparison of one stack or session with the baseline, over pairs of runs.

    Attributes:
        stack: Name of the stack or session.
        pairs: Number of pairs in which both runs were completed.
        error_pairs: Number of pairs in which a run could not be completed.
        unpaired_runs: Number of runs whose counterpart of the other stack or session is missing.
        pairs_with_different_arrivals: Number of completed pairs in which a robot reached its last goal in only one of
            the two runs. Only `collisions` is compared for these pairs.
        flips: Pairs in which only one run passed.
        p: P-value of the sign test of the flips.
        differences: Difference of each metric.
        changes: Significant changes.
    """

    stack: str
    pairs: int
    error_pairs: int
    unpaired_runs: int
    pairs_with_different_arrivals: int
    flips: tuple[Flip, ...]
    p: float
    differences: tuple[MetricDifference, ...]
    changes: tuple[ScenarioChange, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """Comparison of stacks or sessions. The first one is the baseline.

    `stacks` contains the value of --stack for each stack by name, or the output folder of each session by name.
    `outcomes` contains the outcomes by scenario, and then by stack or session. `baseline_comparisons` contains one
    comparison with the baseline for each further stack or session.
    """

    stacks: Mapping[str, str]
    outcomes: Mapping[str, Mapping[str, OutcomeCounts]]
    baseline_comparisons: tuple[BaselineComparison, ...]

    @property
    def baseline(self) -> str:
        """Name of the baseline stack or session."""
        return next(iter(self.stacks))

    def total(self, stack: str) -> OutcomeCounts:
        """Return the outcomes of a stack or session over all scenarios."""
        counts = [row[stack] for row in self.outcomes.values()]
        return OutcomeCounts(
            *(sum(getattr(count, name) for count in counts) for name in ("passed", "failed", "errors"))
        )
