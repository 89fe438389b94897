"""Significance tests of changes between a baseline and another stack or session, from paired runs."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from simscen.core.records.comparison import ScenarioChange
from simscen.core.statistics import holm, sign_test

PASS_RATE = "pass rate"
"""`PairedSample.quantity` for the outcome of runs: the values are 1 for a passed and 0 for a failed run."""


@dataclass(frozen=True)
class Significance:
    """Conditions under which a change counts as significant.

    alpha:       largest p-value, after Holm's correction for the number of tests
    min_effect:  smallest change of the mean, relative to the mean of the baseline
    """

    alpha: float = 0.05
    min_effect: float = 0.05


@dataclass(frozen=True)
class PairedSample:
    """Values of one quantity in pairs of runs (baseline, other).

    scenario:          name of a scenario, or text for all scenarios
    quantity:          PASS_RATE or the name of a metric
    unit:              SI unit of the metric; "" for none
    pairs:             (value in the baseline run, value in the other run) for each pair of runs
    higher_is_better:  None if neither direction is better
    """

    scenario: str
    quantity: str
    unit: str
    pairs: Sequence[tuple[float, float]]
    higher_is_better: bool | None

    def p_value(self) -> float:
        """Return the p-value: of McNemar's exact test for the pass rate, of the signed-rank test for a metric."""
        if self.quantity == PASS_RATE:
            return sign_test(self.pairs.count((0.0, 1.0)), self.pairs.count((1.0, 0.0)))
        return signed_rank_test([other - baseline for baseline, other in self.pairs])


def significant_changes(samples: Iterable[PairedSample], significance: Significance) -> tuple[ScenarioChange, ...]:
    """Return the changes that are significant and large enough, with p-values adjusted by Holm's correction.

    Samples without any difference between the runs of a pair do not count in the correction.
    """
    tested = [sample for sample in samples if any(baseline != other for baseline, other in sample.pairs)]
    changes = []
    for sample, p in zip(tested, holm([sample.p_value() for sample in tested]), strict=True):
        baseline, value = (sum(side) / len(sample.pairs) for side in zip(*sample.pairs, strict=True))
        if p <= significance.alpha and abs(value - baseline) >= significance.min_effect * abs(baseline):
            is_worse = None if sample.higher_is_better is None else (value < baseline) == sample.higher_is_better
            changes.append(
                ScenarioChange(
                    sample.scenario, sample.quantity, sample.unit, len(sample.pairs), baseline, value, p, is_worse
                )
            )
    return tuple(changes)


def signed_rank_test(differences: Sequence[float]) -> float:
    """Return the p-value of Wilcoxon's two-sided signed-rank test of paired differences.

    Differences of 0 do not count. The p-value is 1 if all differences are 0.
    (Wilcoxon: Individual Comparisons by Ranking Methods, 1945.)
    """
    if not any(differences):
        return 1.0
    from scipy.stats import wilcoxon  # the import takes half a second

    return float(wilcoxon(differences).pvalue)
