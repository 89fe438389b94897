"""Paired comparison of stacks or sessions: outcomes and metrics of runs with the same scenario and seed."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from simscen.core.random_streams import Streams
from simscen.core.records.comparison import BaselineComparison, Comparison, Flip, MetricDifference, OutcomeCounts
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.verdict import Status
from simscen.core.statistics import bootstrap_mean_interval, sign_test
from simscen.judge.finding_text import sentence, violations
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.outcome import EXPECTED
from simscen.judge.significance import PASS_RATE, PairedSample, Significance, signed_rank_test, significant_changes

COMPARED_METRICS = (
    *("time_to_goal", "path_length", "min_clearance", "mean_jerk", "time_not_moving", "replans", "recoveries"),
    "collisions",
)
"""Metrics that are compared, in the order of the table. Metrics of plug-ins follow."""
HIGHER_IS_BETTER = frozenset({"min_clearance"})
"""Metrics for which a higher value is better. For all other COMPARED_METRICS, a lower value is better."""
METRICS_OF_ALL_PAIRS = frozenset({"collisions"})
"""Metrics that are compared in all pairs without errors, even if a robot reaches its last goal in only one run."""
ALL_SCENARIOS = "all scenarios"
"""Name that stands for all scenarios together."""
_BOOTSTRAP_SEED = 1
"""Seed of the bootstrap confidence intervals."""

Pair = tuple[RunResult, RunResult]
"""Results of the baseline and of the other stack or session for the same scenario and seed."""


def compare_stacks(results: Iterable[RunResult], stacks: Sequence[str]) -> Comparison | None:
    """Compare each of the `stacks` (NAME=VALUE) with the first one. Returns None for fewer than two stacks.

    Repetitions of a run are left out.
    """
    if len(stacks) < 2:
        return None
    values = {name: value for name, _, value in (text.partition("=") for text in stacks)}
    return _compare(results, values, Significance())


def compare_sessions(
    sessions: Mapping[str, Sequence[RunResult]], folders: Mapping[str, str], significance: Significance
) -> Comparison:
    """Compare runs of two sessions that have the same scenario, seed, and stack. The first session is the baseline.

    `sessions` are the results and `folders` the output folders, by name of the session.
    """
    runs = [
        replace(run, key=comparison_key(run.key, name))
        for name, session_runs in sessions.items()
        for run in session_runs
    ]
    return _compare(runs, folders, significance)


def comparison_key(key: RunKey, session: str) -> RunKey:
    """Return the key by which a run of a session is compared with runs of another session.

    In this key, the name of the session replaces the name of the stack, which becomes part of the name of the scenario.
    The keys of repetitions are returned unchanged.
    """
    if key.is_repetition:
        return key
    scenario = f"{key.scenario} ({key.stack_name})" if key.stack_name else key.scenario
    return replace(key, scenario=scenario, stack_name=session)


def _compare(results: Iterable[RunResult], stacks: Mapping[str, str], significance: Significance) -> Comparison:
    """Compare the first stack or session with each of the others.

    `stacks` are the values of stacks or the output folders of sessions, by name of the stack or session.
    """
    runs = {one.key: one for one in results if not one.key.is_repetition and one.outcome is not Outcome.SKIPPED}
    baseline, *others = stacks
    counts: dict[str, dict[str, Counter[Outcome]]] = {}
    for key, run in runs.items():
        test_counts = counts.setdefault(key.test, {name: Counter() for name in stacks})
        if key.stack_name in test_counts:
            test_counts[key.stack_name][_outcome_without_expectation(run)] += 1
    return Comparison(
        stacks,
        {
            scenario: {
                name: OutcomeCounts(count[Outcome.PASSED], count[Outcome.FAILED], count[Outcome.ERROR])
                for name, count in test_counts.items()
            }
            for scenario, test_counts in sorted(counts.items())
        },
        tuple(_compare_with_baseline(runs, baseline, other, significance) for other in others),
    )


def _outcome_without_expectation(run: RunResult) -> Outcome:
    """Return the outcome that the run would have if no failure were expected."""
    if run.outcome is Outcome.ERROR:
        return Outcome.ERROR
    decisive = [verdict for verdict in run.verdicts if verdict.severity == "fail" and verdict.criterion != EXPECTED]
    is_expected_to_fail = bool(run.reason)
    has_passed = is_expected_to_fail and all(verdict.status is Status.PASS for verdict in decisive)
    return Outcome.PASSED if has_passed or run.outcome is Outcome.PASSED else Outcome.FAILED


def _compare_with_baseline(
    runs: Mapping[RunKey, RunResult], baseline: str, other: str, significance: Significance
) -> BaselineComparison:
    baseline_runs, other_runs = (
        {(key.test, key.seed): run for key, run in sorted(runs.items()) if key.stack_name == name}
        for name in (baseline, other)
    )
    pairs = [
        (run, other_runs[test_and_seed]) for test_and_seed, run in baseline_runs.items() if test_and_seed in other_runs
    ]
    completed = [pair for pair in pairs if all(run.outcome is not Outcome.ERROR for run in pair)]
    same_arrival = [(one, two) for one, two in completed if _arrived_robots(one) == _arrived_robots(two)]
    flips = tuple(flip for pair in completed if (flip := _flip(pair)))
    improvements = sum(flip.passed == other for flip in flips)
    names = _compared_names(completed)
    return BaselineComparison(
        stack=other,
        pairs=len(completed),
        error_pairs=len(pairs) - len(completed),
        unpaired_runs=len(baseline_runs.keys() ^ other_runs.keys()),
        pairs_with_different_arrivals=len(completed) - len(same_arrival),
        flips=flips,
        p=sign_test(improvements, len(flips) - improvements),
        differences=tuple(
            difference
            for name in names
            if (difference := _difference(name, _comparable_pairs(name, completed, same_arrival))) is not None
        ),
        changes=significant_changes(_samples(completed, same_arrival, names), significance),
    )


def _by_scenario(pairs: Iterable[Pair]) -> dict[str, list[Pair]]:
    """Return the pairs by scenario and variation."""
    groups: dict[str, list[Pair]] = {}
    for pair in pairs:
        groups.setdefault(pair[0].key.test, []).append(pair)
    return groups


def _samples(completed: Sequence[Pair], same_arrival: Sequence[Pair], names: Iterable[str]) -> Iterator[PairedSample]:
    """Yield the samples to test: the pass rate of all runs, and the pass rate and each metric by scenario.

    `completed` are the pairs without errors. `same_arrival` are the completed pairs in which the same robots reach
    their last goals in both runs.
    """
    scenarios = _by_scenario(completed)
    if len(scenarios) > 1:
        scenarios = {ALL_SCENARIOS: list(completed), **scenarios}
    for scenario, pairs in scenarios.items():
        passed = [(_passed_as_number(baseline), _passed_as_number(other)) for baseline, other in pairs]
        yield PairedSample(scenario, PASS_RATE, "", passed, higher_is_better=True)
    for name in names:
        higher_is_better = _base_name(name) in HIGHER_IS_BETTER if _base_name(name) in COMPARED_METRICS else None
        for scenario, pairs in _by_scenario(_comparable_pairs(name, completed, same_arrival)).items():
            yield PairedSample(scenario, name, _metric_unit(name), _paired_values(name, pairs), higher_is_better)


def _passed_as_number(run: RunResult) -> float:
    return float(_outcome_without_expectation(run) is Outcome.PASSED)


def _comparable_pairs(name: str, completed: Sequence[Pair], same_arrival: Sequence[Pair]) -> Sequence[Pair]:
    """Return the pairs in which a metric can be compared: `completed` or `same_arrival`, see METRICS_OF_ALL_PAIRS."""
    return completed if _base_name(name) in METRICS_OF_ALL_PAIRS else same_arrival


def _paired_values(name: str, pairs: Sequence[Pair]) -> list[tuple[float, float]]:
    """Return the values of a metric in the pairs in which both runs have the metric."""
    both = [(one.metrics.get(name), two.metrics.get(name)) for one, two in pairs]
    return [(one, two) for one, two in both if one is not None and two is not None]


def _base_name(name: str) -> str:
    """Return the name of a metric without the robot: `a/collisions` becomes `collisions`."""
    return name.rpartition("/")[2]


def _metric_unit(name: str) -> str:
    return METRICS[_base_name(name)].unit if _base_name(name) in METRICS else ""


def _compared_names(pairs: Sequence[Pair]) -> list[str]:
    """Return the names of the metrics to compare: COMPARED_METRICS by robot, and then the metrics of plug-ins."""
    names = {name for pair in pairs for run in pair for name in run.metrics}
    compared = [name for name in names if _base_name(name) in COMPARED_METRICS]
    compared.sort(key=lambda name: (name.rpartition("/")[0], COMPARED_METRICS.index(_base_name(name))))
    return [*compared, *sorted(name for name in names if _base_name(name) not in METRICS)]


def _arrived_robots(run: RunResult) -> set[str]:
    """Return the names of the robots that reached their last goals. A single robot has the name ""."""
    times = {name: value for name, value in run.metrics.items() if _base_name(name) == "time_to_goal"}
    return {name.rpartition("/")[0] for name, value in times.items() if value is not None}


def _flip(pair: Pair) -> Flip | None:
    """Return the flip if only one run of the pair passed; otherwise None."""
    one, two = pair
    if _outcome_without_expectation(one) is _outcome_without_expectation(two):
        return None
    passed, failed = (one, two) if _outcome_without_expectation(one) is Outcome.PASSED else (two, one)
    return Flip(one.key.test, one.key.seed, passed.key.stack_name, failed.key.stack_name, _first_violation(failed))


def _first_violation(run: RunResult) -> str:
    """Return the first violation of a run as text; if there is no violation, the reason why the run ended."""
    sentences = [
        sentence(verdict, finding, run.tick_rate)
        for verdict in run.verdicts
        if verdict.severity != "warn"
        for finding in violations(verdict)
    ]
    more = f" (and {len(sentences) - 1} more)" if len(sentences) > 1 else ""
    return f"{sentences[0]}{more}" if sentences else run.ended


def _difference(name: str, pairs: Sequence[Pair]) -> MetricDifference | None:
    """Return the difference of a metric between the runs of the pairs; None if no pair has the metric in both runs."""
    known = _paired_values(name, pairs)
    if not known:
        return None
    differences = [two - one for one, two in known]
    lower, higher = sum(value < 0 for value in differences), sum(value > 0 for value in differences)
    return MetricDifference(
        metric=name,
        unit=_metric_unit(name),
        pairs=len(known),
        baseline=sum(one for one, _ in known) / len(known),
        value=sum(two for _, two in known) / len(known),
        difference=sum(differences) / len(known),
        interval=bootstrap_mean_interval(differences, Streams(_BOOTSTRAP_SEED).generator(f"comparison.{name}")),
        lower=lower,
        equal=len(known) - lower - higher,
        higher=higher,
        p=signed_rank_test(differences),
    )


def comparison_data(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison as JSON data."""
    return {
        "baseline": comparison.baseline,
        "stacks": [
            {"name": name, "given": value, **asdict(comparison.total(name))}
            for name, value in comparison.stacks.items()
        ],
        "scenarios": [
            {"scenario": scenario, "stacks": {name: asdict(one) for name, one in row.items()}}
            for scenario, row in comparison.outcomes.items()
        ],
        "against": [_baseline_data(one) for one in comparison.baseline_comparisons],
    }


def _baseline_data(comparison: BaselineComparison) -> dict[str, Any]:
    return {
        "stack": comparison.stack,
        "pairs": comparison.pairs,
        "left_out": {"broken_pairs": comparison.error_pairs, "runs_without_partner": comparison.unpaired_runs},
        "pairs_of_which_one_arrived": comparison.pairs_with_different_arrivals,
        "flips": [asdict(flip) for flip in comparison.flips],
        "flips_p": comparison.p,
        "differences": [
            {**asdict(one), "interval": None if one.interval is None else list(one.interval)}
            for one in comparison.differences
        ],
        "changes": [asdict(one) for one in comparison.changes],
    }
