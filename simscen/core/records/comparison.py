"""Result of a comparison of several stacks or sessions with a baseline."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OutcomeCounts:
    """Number of runs by outcome."""

    passed: int = 0
    failed: int = 0
    errors: int = 0

    @property
    def decided(self) -> int:
        """Number of completed runs."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Flip:
    """Scenario and seed that passed with only one of two stacks or sessions.

    `passed` and `failed` are the names of the stacks or sessions; `why` is the criterion that failed.
    """

    scenario: str
    seed: int
    passed: str
    failed: str
    why: str


@dataclass(frozen=True)
class MetricDifference:
    """Difference of a metric between a stack or session and the baseline, over `pairs` of runs.

    The runs of a pair have the same scenario, variation, and seed. `baseline` and `value` are the means of both, and
    `difference` is `value` minus `baseline`. `interval` is the 95 % confidence interval of the difference; None for too
    few pairs. `lower`, `equal`, and `higher` are the numbers of pairs in which the value is lower than, equal to, or
    higher than that of the baseline. `p` is the p-value of Wilcoxon's signed-rank test.
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
    """Significant change of the pass rate or of the mean of a metric.

    `scenario` is "all scenarios" for the pass rate over all. `what` is "pass rate" or the name of a metric, and
    `baseline` and `value` are its means. `p` is the p-value, adjusted for the number of tests (Holm). `is_worse` is
    None for a metric of which neither direction is better.
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
        unpaired_runs: Number of runs without a partner.
        pairs_with_one_arrival: Number of completed pairs in which only one run reached its goals. The only
            metric that is compared in these pairs is `collisions`.
        flips: Pairs in which only one run passed.
        p: P-value of the sign test of the flips.
        differences: Difference of each metric.
        changes: Significant changes.
    """

    stack: str
    pairs: int
    error_pairs: int
    unpaired_runs: int
    pairs_with_one_arrival: int
    flips: tuple[Flip, ...]
    p: float
    differences: tuple[MetricDifference, ...]
    changes: tuple[ScenarioChange, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """Comparison of stacks or sessions, of which the first one is the baseline.

    `stacks` maps the name of each stack to its value of --stack, or the name of each session to its output folder.
    `outcomes` contains the outcomes by scenario and by name of the stack or session. `against` contains the comparison
    of each of the others with the baseline.
    """

    stacks: Mapping[str, str]
    outcomes: Mapping[str, Mapping[str, OutcomeCounts]]
    against: tuple[BaselineComparison, ...]

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
