"""Evaluation of a study (many runs of one scenario): claim, pass rates by parameter, and effects of parameters."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.study import ParameterEffect, RateRow, Study
from simscen.core.statistics import CONFIDENCE, holm, wilson_interval
from simscen.judge.pass_rate_claims import anytime_limits, evaluate_claim, is_counted
from simscen.model.acceptance import PassRate
from simscen.spec.quantities import NUMBER_AND_UNIT_PATTERN, si_number

MIN_RUNS_FOR_EFFECTS = 8
"""Minimum number of runs from which effects of parameters are computed."""
RANGE_COUNT = 4
"""Number of ranges for a parameter with many different numbers. Ranges have about the same number of runs."""
MAX_LISTED_VALUES = 10
"""Maximum number of different values of a parameter that are listed one by one, not as ranges."""


@dataclass(frozen=True)
class StudyPlan:
    """Plan of a study.

    Attributes:
        scenario: ID of the scenario.
        is_random: True if each run has its own seed and random values.
        claim: Claim about the pass rate; None if the scenario has no `acceptance`.
        values: Values of the varied parameters, by run and by path of the parameter in the scenario.
        is_designed_in_pairs: True for pairwise testing: all pairs of values of two parameters occur.
        drawn: Number of random draws of values that were needed to meet the condition `require`; 0 without `require`.
        stops_early: True if the study ends when it has found enough failures.
    """

    scenario: str
    is_random: bool
    claim: PassRate | None = None
    values: Mapping[RunKey, Mapping[str, Any]] = field(default_factory=dict)
    is_designed_in_pairs: bool = False
    drawn: int = 0
    stops_early: bool = False

    @property
    def has_fixed_runs(self) -> bool:
        """True if the number of runs does not depend on the outcomes of the runs."""
        return not self.stops_early and (self.claim is None or self.claim.method == "fixed")


def evaluate_study(plan: StudyPlan, results: Iterable[RunResult]) -> Study:
    """Return the result of a study. The order of the results does not matter."""
    ordered = in_seed_order(results)
    counted = [result for result in ordered if is_counted(result)]
    passed = sum(result.outcome is Outcome.PASSED for result in counted)
    margins = {result.key: _margins(result) for result in counted}
    limits = None
    if counted and plan.is_random:  # if the study can stop after any run, its limits must be valid after each run
        limits = (
            wilson_interval(passed, len(counted))
            if plan.has_fixed_runs
            else anytime_limits(passed, len(counted), CONFIDENCE)
        )
    return Study(
        scenario=plan.scenario,
        is_random=plan.is_random,
        passed=passed,
        failed=len(counted) - passed,
        errors=len(ordered) - len(counted),
        claim=None if plan.claim is None else evaluate_claim(plan.claim, ordered),
        limits=limits,
        rates=tuple(_rates(plan, counted)),
        effects=_effects(plan, counted, margins),
        worst=_worst(margins),
        values={result.key: plan.values[result.key] for result in ordered if result.key in plan.values},
        coverage=_pair_coverage(plan, counted),
        accepted=len(ordered) / plan.drawn if plan.drawn else None,
    )


def in_seed_order(results: Iterable[RunResult]) -> list[RunResult]:
    """Return the results in the order of their seeds."""
    return sorted(results, key=lambda result: (result.key.seed, result.key))


def _margins(result: RunResult) -> dict[str, tuple[float, str]]:
    """Return the smallest margin of each criterion and its unit, by verdict ID."""
    smallest: dict[str, tuple[float, str]] = {}
    for verdict in result.verdicts:
        margins = [
            (finding.margin, finding.unit)
            for finding in verdict.findings
            if finding.margin is not None and math.isfinite(finding.margin)
        ]
        if margins:
            smallest[verdict.id] = min(margins)
    return smallest


def _worst(margins: Mapping[RunKey, Mapping[str, tuple[float, str]]]) -> dict[str, tuple[RunKey, float, str]]:
    """Return (run, margin, unit of the margin) of the run with the smallest margin, by verdict ID."""
    worst: dict[str, tuple[RunKey, float, str]] = {}
    for key, run_margins in margins.items():
        for verdict_id, (margin, unit) in run_margins.items():
            if verdict_id not in worst or margin < worst[verdict_id][1]:
                worst[verdict_id] = key, margin, unit
    return dict(sorted(worst.items()))


def _rates(plan: StudyPlan, results: Sequence[RunResult]) -> Iterable[RateRow]:
    """Yield the pass rate for each value or range of values of each parameter.

    The rates have no confidence limits if the runs are not random, or if the number of runs depends on the outcomes.
    """
    has_limits = plan.is_random and plan.has_fixed_runs
    for path in _parameter_paths(plan):
        values = [plan.values.get(result.key, {}).get(path) for result in results]
        groups: dict[str, list[bool]] = defaultdict(list)
        ranks: dict[str, tuple[int, float, str]] = {}  # sort key of a label: its smallest number; texts follow numbers
        for label, value, result in zip(_labels(values), values, results, strict=True):
            groups[label].append(result.outcome is Outcome.PASSED)
            number = si_number(value)
            rank = (0, float(number), "") if _is_number(number) else (1, 0.0, label)
            ranks[label] = min(ranks.get(label, rank), rank)
        for label in sorted(groups, key=ranks.__getitem__):
            outcomes = groups[label]
            limits = wilson_interval(sum(outcomes), len(outcomes)) if has_limits else None
            yield RateRow(path, label, sum(outcomes), len(outcomes), limits)


def _labels(values: Sequence[Any]) -> list[str]:
    """Return the label of each value: its text, or its range if there are many different numbers."""
    texts = [value_text(value) for value in values]
    numbers = [si_number(value) for value in values]
    if len(set(texts)) <= MAX_LISTED_VALUES or not all(map(_is_number, numbers)):
        return texts
    order = sorted(range(len(numbers)), key=numbers.__getitem__)
    labels = [""] * len(numbers)
    size = math.ceil(len(numbers) / RANGE_COUNT)
    for start in range(0, len(order), size):
        part = order[start : start + size]
        for index in part:
            labels[index] = f"{_rounded_text(values[part[0]])} … {_rounded_text(values[part[-1]])}"
    return labels


def _rounded_text(value: Any) -> str:
    """Return a number or quantity with three significant digits."""
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(value) if isinstance(value, str) else None
    return f"{value:.3g}" if match is None else f"{float(match[1]):.3g} {match[2]}"


def value_text(value: Any) -> str:
    """Return a value of a parameter as one line of text. None stands for the value in the scenario file."""
    match value:
        case None:
            return "unchanged"
        case bool():
            return "true" if value else "false"
        case float():
            return f"{value:.6g}"
        case dict():
            return ", ".join(f"{key}: {value_text(each)}" for key, each in value.items())
        case list():
            return ", ".join(map(value_text, value))
    return str(value)


def _effects(
    plan: StudyPlan, results: Sequence[RunResult], margins: Mapping[RunKey, Mapping[str, tuple[float, str]]]
) -> tuple[ParameterEffect, ...]:
    """Return the effects of all parameters on the margins of all criteria, most significant first.

    The p-values are adjusted by Holm's correction.
    """
    effects = []
    for path in _parameter_paths(plan):
        for criterion in sorted({criterion for run_margins in margins.values() for criterion in run_margins}):
            keys = [result.key for result in results if criterion in margins[result.key]]
            values = [plan.values.get(key, {}).get(path) for key in keys]
            effect = _effect(values, [margins[key][criterion][0] for key in keys])
            if effect is not None:
                effects.append(ParameterEffect(path, criterion, *effect[:2], len(keys), effect[2]))
    adjusted = holm([one.p for one in effects])
    effects = [replace(one, p=p) for one, p in zip(effects, adjusted, strict=True)]
    return tuple(sorted(effects, key=lambda one: (one.p, -abs(one.effect), one.path, one.criterion)))


def _effect(values: Sequence[Any], margins: Sequence[float]) -> tuple[float, float, bool] | None:
    """Return (effect of a parameter on a margin, p-value, True if the values are numbers).

    For numbers, the effect is Spearman's rank correlation. For other values, the effect is epsilon squared of the
    Kruskal-Wallis test. Returns None if there are fewer than MIN_RUNS_FOR_EFFECTS runs, if all values or all margins
    are equal, or if values that are not numbers have at most two runs each on average.
    """
    texts = [value_text(value) for value in values]
    if len(margins) < MIN_RUNS_FOR_EFFECTS or len(set(texts)) < 2 or len(set(margins)) < 2:
        return None
    from scipy import stats  # the import takes half a second

    numbers = [si_number(value) for value in values]
    if all(map(_is_number, numbers)):
        if len(set(numbers)) < 2:  # such as 1 m and 100 cm
            return None
        correlation = stats.spearmanr(numbers, margins)
        return float(correlation.statistic), float(correlation.pvalue), True
    groups: dict[str, list[float]] = defaultdict(list)
    for text, margin in zip(texts, margins, strict=True):
        groups[text].append(margin)
    if len(groups) >= len(margins) / 2:
        return None
    statistic, p_value = stats.kruskal(*groups.values())
    return float(statistic) / (len(margins) - 1), float(p_value), False


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _parameter_paths(plan: StudyPlan) -> list[str]:
    """Return the paths in the scenario of all varied parameters, sorted."""
    return sorted({path for values in plan.values.values() for path in values})


def _pair_coverage(plan: StudyPlan, results: Sequence[RunResult]) -> float | None:
    """Return the share of all pairs of values of two parameters that occurred; None without pairwise testing."""
    paths = _parameter_paths(plan)
    if not plan.is_designed_in_pairs or len(paths) < 2:
        return None
    rows = [[value_text(plan.values[result.key].get(path)) for path in paths] for result in results]
    all_rows = [[value_text(values.get(path)) for path in paths] for values in plan.values.values()]
    counts = [len({row[index] for row in all_rows}) for index in range(len(paths))]
    possible = sum(counts[a] * counts[b] for a, b in combinations(range(len(paths)), 2))
    covered = {(a, row[a], b, row[b]) for row in rows for a, b in combinations(range(len(paths)), 2)}
    return len(covered) / possible
