"""Paired comparison of stacks or sessions on the same scenarios and seeds."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from simscen.core.random_streams import Streams
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.session_events import (
    BaselineComparison,
    Comparison,
    Flip,
    MetricDifference,
    OutcomeCounts,
    ScenarioChange,
)
from simscen.core.records.verdict import Status
from simscen.core.statistics import bootstrap_mean_interval, holm, sign_test
from simscen.judge.evaluation import EXPECTED
from simscen.judge.finding_text import sentence, violations
from simscen.judge.metrics.catalog import METRICS

COMPARED_METRICS = (
    *("time_to_goal", "path_length", "min_clearance", "mean_jerk", "time_not_moving", "replans", "recoveries"),
    "collisions",
)
"""Compared metrics, in the order of the table."""
HIGHER_IS_BETTER = frozenset({"min_clearance"})
"""Compared metrics of which a lower value is worse; of the others, a higher one is."""
OUTCOME_INDEPENDENT = frozenset({"collisions"})
"""Metrics that are comparable if a run fails. The others favor stacks that give up early."""
_SEED = 1
"""Seed of the bootstrap: the same runs give the same intervals."""

Pair = tuple[RunResult, RunResult]


@dataclass(frozen=True)
class Significance:
    """When a change of one scenario is significant.

    alpha:       largest p-value, after Holm's correction for the number of scenarios
    min_effect:  smallest change of a mean, relative to that of the baseline; smaller ones do not matter
    """

    alpha: float = 0.05
    min_effect: float = 0.05


DEFAULT_SIGNIFICANCE = Significance()


def compare_stacks(results: Iterable[RunResult], stacks: Sequence[str]) -> Comparison | None:
    """Compare each of the `stacks` (NAME=VALUE) with the first. Returns None with fewer than two stacks.

    The order of the results does not matter. Repeated runs, which check determinism, do not count.
    """
    if len(stacks) < 2:
        return None
    given = {name: value for name, _, value in (text.partition("=") for text in stacks)}
    return _compare(results, given, DEFAULT_SIGNIFICANCE)


def compare_sessions(
    sessions: Mapping[str, Sequence[RunResult]], folders: Mapping[str, str], significance: Significance
) -> Comparison:
    """Compare the runs of two sessions, both by name, of which the first one is the baseline.

    Runs with several stacks are paired by stack as well. `folders` are the output folders by name.
    """
    runs = [replace(run, key=labeled_key(run.key, name)) for name, own in sessions.items() for run in own]
    return _compare(runs, folders, significance)


def labeled_key(key: RunKey, session: str) -> RunKey:
    """Return the key with the session in place of the stack, which becomes part of the name of the scenario."""
    if key.repeats:
        return key
    scenario = f"{key.scenario} ({key.stack_name})" if key.stack_name else key.scenario
    return replace(key, scenario=scenario, stack_name=session)


def _compare(results: Iterable[RunResult], given: Mapping[str, str], significance: Significance) -> Comparison:
    runs = {one.key: one for one in results if not one.key.repeats and one.outcome is not Outcome.SKIPPED}
    baseline, *others = given
    return Comparison(
        given,
        {test: _row(test, given, runs) for test in sorted({key.test for key in runs})},
        tuple(_against(runs, baseline, other, significance) for other in others),
    )


def _row(test: str, stacks: Iterable[str], runs: Mapping[RunKey, RunResult]) -> dict[str, OutcomeCounts]:
    own = [run for key, run in runs.items() if key.test == test]
    return {name: _outcomes(run for run in own if run.key.stack_name == name) for name in stacks}


def _came_out(run: RunResult) -> Outcome:
    """Return the outcome of the run without its expectation."""
    if run.outcome is Outcome.ERROR:
        return Outcome.ERROR
    decisive = [verdict for verdict in run.verdicts if verdict.severity == "fail" and verdict.criterion != EXPECTED]
    held = bool(run.reason) and all(verdict.status is Status.PASS for verdict in decisive)
    return Outcome.PASSED if held or run.outcome is Outcome.PASSED else Outcome.FAILED


def _outcomes(runs: Iterable[RunResult]) -> OutcomeCounts:
    count = Counter(_came_out(run) for run in runs)
    return OutcomeCounts(count[Outcome.PASSED], count[Outcome.FAILED], count[Outcome.ERROR])


def _against(
    runs: Mapping[RunKey, RunResult], baseline: str, other: str, significance: Significance
) -> BaselineComparison:
    first, second = (
        {(key.test, key.seed): run for key, run in sorted(runs.items()) if key.stack_name == name}
        for name in (baseline, other)
    )
    pairs = [(first[case], second[case]) for case in first if case in second]
    whole = [pair for pair in pairs if all(run.outcome is not Outcome.ERROR for run in pair)]
    alike = [(one, two) for one, two in whole if _arrived(one) == _arrived(two)]
    flips = tuple(flip for pair in whole if (flip := _flip(pair)))
    won = sum(flip.passed == other for flip in flips)
    names = (*_chosen(whole), *_added(whole))
    return BaselineComparison(
        stack=other,
        pairs=len(whole),
        broken=len(pairs) - len(whole),
        alone=len(first.keys() ^ second.keys()),
        parted=len(whole) - len(alike),
        flips=flips,
        p=sign_test(won, len(flips) - won),
        differences=tuple(
            found
            for name in names
            if (found := _difference(name, whole if _kind(name) in OUTCOME_INDEPENDENT else alike)) is not None
        ),
        changes=(
            *_pass_rate_changes(whole, significance),
            *(
                change
                for name in names
                for change in _metric_changes(
                    name, whole if _kind(name) in OUTCOME_INDEPENDENT else alike, significance
                )
            ),
        ),
    )


def _by_scenario(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    found: dict[str, list[Pair]] = {}
    for pair in pairs:
        found.setdefault(pair[0].key.test, []).append(pair)
    return found


def _pass_rate_changes(pairs: Sequence[Pair], significance: Significance) -> list[ScenarioChange]:
    """Return the scenarios whose pass rate changed, by McNemar's exact test."""
    found = []
    for scenario, own in _by_scenario(pairs).items():
        passed = [tuple(_came_out(run) is Outcome.PASSED for run in pair) for pair in own]
        lost, won = passed.count((True, False)), passed.count((False, True))
        before, after = (sum(pair[side] for pair in passed) / len(own) for side in (0, 1))
        p = sign_test(won, lost)
        found.append(ScenarioChange(scenario, "passed", "", len(own), before, after, p, lost > won))
    return _significant(found, significance)


def _metric_changes(name: str, pairs: Sequence[Pair], significance: Significance) -> list[ScenarioChange]:
    """Return the scenarios in which a metric changed, by Wilcoxon's signed-rank test."""
    found = []
    for scenario, own in _by_scenario(pairs).items():
        known = _values(name, own)
        if not known:
            continue
        baseline, value = (sum(side) / len(known) for side in zip(*known, strict=True))
        p = signed_rank_test([two - one for one, two in known])
        is_worse = (value > baseline) != (_kind(name) in HIGHER_IS_BETTER) if _kind(name) in COMPARED_METRICS else None
        unit = METRICS[_kind(name)].unit if _kind(name) in METRICS else ""
        found.append(ScenarioChange(scenario, name, unit, len(known), baseline, value, p, is_worse))
    return _significant(found, significance)


def _significant(changes: Sequence[ScenarioChange], significance: Significance) -> list[ScenarioChange]:
    """Return the changes that are significant and large enough, with adjusted p-values."""
    adjusted = [replace(change, p=p) for change, p in zip(changes, holm([each.p for each in changes]), strict=True)]
    return [
        change
        for change in adjusted
        if change.p <= significance.alpha
        and abs(change.value - change.baseline) >= significance.min_effect * abs(change.baseline)
    ]


def _values(name: str, pairs: Sequence[Pair]) -> list[tuple[float, float]]:
    """Return the values of a metric in the pairs in which both runs have it."""
    both = [(one.metrics.get(name), two.metrics.get(name)) for one, two in pairs]
    return [(one, two) for one, two in both if one is not None and two is not None]


def _kind(name: str) -> str:
    """Return the name of a metric without the robot: `a/collisions` becomes `collisions`."""
    return name.rpartition("/")[2]


def _chosen(pairs: Sequence[Pair]) -> list[str]:
    """Return the names of the COMPARED metrics, grouped over robots."""
    names = {name for pair in pairs for run in pair for name in run.metrics if _kind(name) in COMPARED_METRICS}
    return sorted(names, key=lambda name: (name.rpartition("/")[0], COMPARED_METRICS.index(_kind(name))))


def _added(pairs: Sequence[Pair]) -> list[str]:
    """Return the names of metrics from installed packages."""
    return sorted({name for pair in pairs for run in pair for name in run.metrics if _kind(name) not in METRICS})


def _arrived(run: RunResult) -> set[str]:
    """Return the robots that reached their last goals; a single robot has the name ""."""
    times = {name: value for name, value in run.metrics.items() if _kind(name) == "time_to_goal"}
    return {name.rpartition("/")[0] for name, value in times.items() if value is not None}


def _flip(pair: Pair) -> Flip | None:
    one, two = pair
    if _came_out(one) is _came_out(two):
        return None
    good, bad = (one, two) if _came_out(one) is Outcome.PASSED else (two, one)
    return Flip(one.key.test, one.key.seed, good.key.stack_name, bad.key.stack_name, _why(bad))


def _why(run: RunResult) -> str:
    """Return the first violation."""
    told = [
        sentence(verdict, finding, run.tick_rate)
        for verdict in run.verdicts
        if verdict.severity != "warn"
        for finding in violations(verdict)
    ]
    more = f" (and {len(told) - 1} more)" if len(told) > 1 else ""
    return f"{told[0]}{more}" if told else run.ended


def _difference(name: str, pairs: Sequence[Pair]) -> MetricDifference | None:
    """Return the difference of a metric, or None if no pair has it."""
    known = _values(name, pairs)
    if not known:
        return None
    differences = [two - one for one, two in known]
    lower, higher = sum(value < 0 for value in differences), sum(value > 0 for value in differences)
    return MetricDifference(
        metric=name,
        unit=METRICS[_kind(name)].unit if _kind(name) in METRICS else "",
        pairs=len(known),
        baseline=sum(one for one, _ in known) / len(known),
        value=sum(two for _, two in known) / len(known),
        difference=sum(differences) / len(known),
        interval=bootstrap_mean_interval(differences, Streams(_SEED).generator(f"comparison.{name}")),
        lower=lower,
        equal=len(known) - lower - higher,
        higher=higher,
        p=signed_rank_test(differences),
    )


def signed_rank_test(differences: Sequence[float]) -> float:
    """Return the p-value of Wilcoxon's two-sided signed-rank test of paired differences, by scipy.

    Pairs without a difference do not count; 1 if there is no difference at all. (Wilcoxon: Individual Comparisons by
    Ranking Methods, 1945.)
    """
    if not any(differences):
        return 1.0
    from scipy.stats import wilcoxon

    return float(wilcoxon(differences).pvalue)


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """Return plain data with stacks and scenarios as ordered lists."""
    return {
        "baseline": comparison.baseline,
        "stacks": [
            {"name": name, "given": given, **asdict(comparison.total(name))}
            for name, given in comparison.stacks.items()
        ],
        "scenarios": [
            {"scenario": scenario, "stacks": {name: asdict(one) for name, one in row.items()}}
            for scenario, row in comparison.outcomes.items()
        ],
        "against": [_against_data(one) for one in comparison.against],
    }


def _against_data(against: BaselineComparison) -> dict[str, Any]:
    return {
        "stack": against.stack,
        "pairs": against.pairs,
        "left_out": {"broken_pairs": against.broken, "runs_without_partner": against.alone},
        "pairs_of_which_one_arrived": against.parted,
        "flips": [asdict(flip) for flip in against.flips],
        "flips_p": against.p,
        "differences": [_difference_data(one) for one in against.differences],
        "changes": [asdict(one) for one in against.changes],
    }


def _difference_data(one: MetricDifference) -> dict[str, Any]:
    return {**asdict(one), "interval": None if one.interval is None else list(one.interval)}
