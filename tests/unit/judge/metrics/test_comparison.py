"""Tests of the comparison of stacks: pairs, exclusions, and statistics."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from simscen.core.records.comparison import OutcomeCounts
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.comparison import (
    ALL_SCENARIOS,
    COMPARED_METRICS,
    compare_sessions,
    compare_stacks,
    comparison_data,
    comparison_key,
)
from simscen.judge.significance import PASS_RATE, Significance, signed_rank_test

STACKS = ("ref=reference", "mine=./nav --fast")
GOOD = {"time_to_goal": 10.0, "path_length": 5.0, "min_clearance": 0.5, "collisions": 0.0}


def run(stack: str, seed: int = 1, scenario: str = "a", outcome: Outcome = Outcome.PASSED, **metrics: float | None):
    found = Finding(Status.FAIL, "clearance", "0.03 m", "≥ 0.05 m", -0.02, "m", tick=240, place=(1.0, 2.0))
    verdicts = (Verdict("clearance", "clearance", "fail", (found,)),) if outcome is Outcome.FAILED else ()
    error = RunFailure("stack-crashed", "it is gone") if outcome is Outcome.ERROR else None
    return RunResult(
        RunKey(scenario, seed, stack_name=stack),
        f"{scenario}.scenario.yaml",
        outcome,
        verdicts,
        metrics={} if error else {**GOOD, **metrics},
        error=error,
    )


def stack_comparison(*runs: RunResult):
    comparison = compare_stacks(runs, STACKS)
    assert comparison is not None
    (baseline_comparison,) = comparison.baseline_comparisons
    return baseline_comparison


def difference_of(baseline_comparison, metric: str):
    return next(difference for difference in baseline_comparison.differences if difference.metric == metric)


def test_single_stack_has_no_comparison() -> None:
    assert compare_stacks([run("")], ()) is None
    assert compare_stacks([run("")], STACKS[:1]) is None


def test_outcomes_are_counted_by_scenario_and_stack_with_separate_errors() -> None:
    runs = [run("ref", seed) for seed in (1, 2, 3)]
    runs += [run("mine", 1), run("mine", 2, outcome=Outcome.FAILED), run("mine", 3, outcome=Outcome.ERROR)]
    comparison = compare_stacks([*runs, run("ref", scenario="b")], STACKS)
    assert comparison is not None
    assert comparison.outcomes["a"] == {"ref": OutcomeCounts(3, 0, 0), "mine": OutcomeCounts(1, 1, 1)}
    assert comparison.outcomes["b"]["mine"] == OutcomeCounts()
    assert comparison.total("ref") == OutcomeCounts(4, 0, 0)
    assert comparison.outcomes["a"]["mine"].decided == 2
    assert dict(comparison.stacks) == {"ref": "reference", "mine": "./nav --fast"}


def test_differences_are_between_runs_with_the_same_scenario_and_seed() -> None:
    """Only seed 1 was run with both stacks; the means of all runs differ by 100 s."""
    baseline_comparison = stack_comparison(
        run("ref", 1, time_to_goal=10.0), run("mine", 1, time_to_goal=12.0), run("mine", 2, time_to_goal=210)
    )
    found = difference_of(baseline_comparison, "time_to_goal")
    assert (found.pairs, found.baseline, found.value, found.difference) == (1, 10.0, 12.0, 2.0)
    assert (found.lower, found.equal, found.higher, found.p) == (0, 0, 1, 1.0)
    assert found.interval is None
    assert baseline_comparison.unpaired_runs == 1


def test_runs_with_errors_are_counted_and_not_compared() -> None:
    baseline_comparison = stack_comparison(
        run("ref", 1), run("mine", 1, outcome=Outcome.ERROR), run("ref", 2), run("mine", 2)
    )
    assert (
        baseline_comparison.pairs,
        baseline_comparison.error_pairs,
        baseline_comparison.unpaired_runs,
        baseline_comparison.flips,
    ) == (1, 1, 0, ())
    assert difference_of(baseline_comparison, "path_length").pairs == 1


def test_flip_states_the_failing_stack_and_the_reason() -> None:
    baseline_comparison = stack_comparison(
        *(run("ref", 1), run("mine", 1, outcome=Outcome.FAILED)),
        *(run("ref", 2, outcome=Outcome.FAILED), run("mine", 2)),
        *(run("ref", 3, outcome=Outcome.FAILED), run("mine", 3, outcome=Outcome.FAILED)),
    )
    assert [(flip.seed, flip.passed, flip.failed) for flip in baseline_comparison.flips] == [
        (1, "ref", "mine"),
        (2, "mine", "ref"),
    ]
    assert baseline_comparison.flips[0].why == "clearance: 0.03 m < 0.05 m, at t = 1.00 s, (1.00, 2.00)"
    assert baseline_comparison.p == 1.0


def test_aborted_run_is_not_compared_by_path_length() -> None:
    gave_up = run("mine", 1, outcome=Outcome.FAILED, time_to_goal=None, path_length=1.0, collisions=2.0)
    baseline_comparison = stack_comparison(run("ref", 1), gave_up, run("ref", 2), run("mine", 2, path_length=5.5))
    assert baseline_comparison.pairs_with_different_arrivals == 1
    assert (
        difference_of(baseline_comparison, "path_length").pairs,
        difference_of(baseline_comparison, "path_length").difference,
    ) == (1, 0.5)
    assert (
        difference_of(baseline_comparison, "collisions").pairs,
        difference_of(baseline_comparison, "collisions").difference,
    ) == (2, 1.0)


def test_determinism_runs_are_not_compared() -> None:
    baseline_comparison = stack_comparison(run("ref"), run("ref.again"), run("mine"), run("mine.again"))
    assert baseline_comparison.pairs == 1


def test_comparison_is_with_the_first_stack_in_any_order_of_runs() -> None:
    names = ("ref", "mine", "other")
    runs = [run(name, seed, time_to_goal=seed * (1.0 + len(name) / 10)) for name in names for seed in range(1, 9)]
    stacks = [f"{name}=x" for name in names]
    assert compare_stacks(runs, stacks) == compare_stacks(runs[::-1], stacks)
    comparison = compare_stacks(runs, stacks)
    assert comparison is not None
    assert [baseline.stack for baseline in comparison.baseline_comparisons] == ["mine", "other"]
    found = difference_of(comparison.baseline_comparisons[1], "time_to_goal")
    assert found.interval is not None
    assert found.interval[0] < found.difference < found.interval[1]
    assert found.difference == pytest.approx(0.2 * 4.5)


def test_comparison_as_data_is_strict_json_with_excluded_runs() -> None:
    runs = [run("ref", 1), run("mine", 1, outcome=Outcome.ERROR), run("mine", 2)]
    comparison = compare_stacks(runs, STACKS)
    assert comparison is not None
    data = json.loads(json.dumps(comparison_data(comparison), allow_nan=False))
    assert data["baseline"] == "ref"
    assert data["stacks"][1] == {"name": "mine", "given": "./nav --fast", "passed": 1, "failed": 0, "errors": 1}
    assert data["against"][0]["left_out"] == {"broken_pairs": 1, "runs_without_partner": 1}
    assert data["against"][0]["differences"] == []


def test_metrics_of_packages_are_compared() -> None:
    found = difference_of(stack_comparison(run("ref", headway=2.0), run("mine", headway=2.5)), "headway")
    assert (found.difference, found.unit, found.pairs) == (0.5, "", 1)


def test_every_compared_metric_exists() -> None:
    assert set(COMPARED_METRICS) <= set(METRICS)


def test_expected_failures_are_compared_as_failures() -> None:
    """A stack that fails as expected is not better than one that passes unexpectedly."""
    known = replace(run("ref", outcome=Outcome.FAILED), outcome=Outcome.FAILED_AS_EXPECTED, reason="NAV-1")
    broken = Finding(Status.FAIL, "expected", "everything passed", "a failure: NAV-1")
    mended = replace(
        run("mine", outcome=Outcome.FAILED),
        reason="NAV-1",
        verdicts=(Verdict("expected", "expected", "fail", (broken,)),),
    )
    (flip,) = stack_comparison(known, mended).flips
    assert (flip.passed, flip.failed) == ("mine", "ref")


def test_skipped_run_is_not_compared() -> None:
    skipped = [replace(run(name), outcome=Outcome.SKIPPED, verdicts=(), reason="NAV-1") for name in ("ref", "mine")]
    assert stack_comparison(*skipped, run("ref", 2), run("mine", 2)).pairs == 1


def fleet(stack: str, seed: int = 1, **metrics: float | None) -> RunResult:
    """Return a run of the robots a and b; `b_time_to_goal` is for robot b."""
    own = {f"{robot}/{name}": value for robot in "ba" for name, value in {**GOOD, "ape_trans_max": 0.1}.items()}
    own |= {name.replace("_", "/", 1): value for name, value in metrics.items()}
    return replace(run(stack, seed), metrics={"success": 1.0, **own})


def test_metrics_of_each_robot_are_compared() -> None:
    baseline_comparison = stack_comparison(fleet("ref"), fleet("mine", b_path_length=7.0))
    names = [name for name in COMPARED_METRICS if name in GOOD]
    assert [found.metric for found in baseline_comparison.differences] == [
        f"{robot}/{name}" for robot in "ab" for name in names
    ]
    assert [difference_of(baseline_comparison, f"{robot}/path_length").difference for robot in "ab"] == [0.0, 2.0]
    assert difference_of(baseline_comparison, "b/path_length").unit == METRICS["path_length"].unit


def test_pair_in_which_different_robots_arrived_is_compared_only_by_collisions() -> None:
    baseline_comparison = stack_comparison(
        fleet("ref", a_time_to_goal=None), fleet("mine", b_time_to_goal=None, a_collisions=1.0)
    )
    assert baseline_comparison.pairs_with_different_arrivals == 1
    assert {found.metric: found.difference for found in baseline_comparison.differences} == {
        "a/collisions": 1.0,
        "b/collisions": 0.0,
    }


@given(st.lists(st.integers(-30, 30), min_size=1, max_size=9, unique_by=abs).filter(lambda values: 0 not in values))
def test_signed_rank_test_equals_enumeration_of_all_signs(differences: list[int]) -> None:
    """By enumeration of all signs, without ties."""
    ranks = stats.rankdata(np.abs(differences))
    mean = ranks.sum() / 2
    observed = abs(ranks[np.array(differences) > 0].sum() - mean)
    signs = itertools.product((0, 1), repeat=len(ranks))
    extreme = sum(abs(np.dot(sign, ranks) - mean) >= observed - 1e-9 for sign in signs)
    assert signed_rank_test(differences) == pytest.approx(extreme / 2 ** len(ranks))


def test_pairs_without_any_difference_have_p_1() -> None:
    assert signed_rank_test([0.0, 0.0, 0.0]) == 1.0


def test_session_keys_contain_the_stack_in_the_scenario_name() -> None:
    assert comparison_key(RunKey("a", 1, "slow"), "now") == RunKey("a", 1, "slow", "now")
    assert comparison_key(RunKey("a", 1, "slow", "dwb"), "now") == RunKey("a (dwb)", 1, "slow", "now")
    second = RunKey("a", 1).repetition
    assert comparison_key(second, "now") == second


def test_scenarios_are_sorted_in_any_order_of_runs() -> None:
    runs = [run(stack, scenario=name) for name in "ecadbf" for stack in ("mine", "ref")]
    comparison = compare_stacks(runs, STACKS)
    assert comparison is not None
    assert list(comparison.outcomes) == list("abcdef")


def sessions(worse: dict[str, float], seeds: int = 12, failing: int = 0, scenarios: str = "ab"):
    before = [run("", seed, name) for name in scenarios for seed in range(seeds)]
    now = [
        run("", seed, name, Outcome.FAILED if seed < failing else Outcome.PASSED, **worse)
        for name in scenarios
        for seed in range(seeds)
    ]
    comparison = compare_sessions({"before": before, "now": now}, {"before": "b", "now": "n"}, Significance())
    (baseline_comparison,) = comparison.baseline_comparisons
    return baseline_comparison


def test_changes_state_which_direction_is_worse() -> None:
    found = {(change.scenario, change.what): change for change in sessions({"min_clearance": 0.3}, seeds=8).changes}
    assert found.keys() == {("a", "min_clearance"), ("b", "min_clearance")}
    assert all(change.is_worse for change in found.values())
    better = sessions({"time_to_goal": 8.0, "added": 3.0}, seeds=8).changes
    assert {(change.what, change.is_worse) for change in better} == {("time_to_goal", False)}


def test_metric_of_a_package_has_no_worse_direction() -> None:
    before = [run("", seed, added=1.0, another=1.0) for seed in range(8)]
    now = [run("", seed, added=2.0, another=2.0) for seed in range(8)]
    comparison = compare_sessions({"before": before, "now": now}, {"before": "b", "now": "n"}, Significance())
    (baseline_comparison,) = comparison.baseline_comparisons
    assert [(change.what, change.is_worse) for change in baseline_comparison.changes] == [
        ("added", None),
        ("another", None),
    ]
    assert [found.metric for found in baseline_comparison.differences][-2:] == ["added", "another"]


def test_the_pass_rate_over_all_scenarios_is_tested_if_there_are_several() -> None:
    changes = {change.scenario: change for change in sessions({}, failing=9).changes if change.what == PASS_RATE}
    assert changes.keys() == {ALL_SCENARIOS, "a", "b"}
    assert (changes[ALL_SCENARIOS].baseline, changes[ALL_SCENARIOS].value) == (1.0, 0.25)
    assert changes[ALL_SCENARIOS].is_worse
    assert changes[ALL_SCENARIOS].pairs == 24
    single = sessions({}, failing=9, scenarios="a")
    assert {change.scenario for change in single.changes if change.what == PASS_RATE} == {"a"}


def test_metric_is_compared_if_both_runs_have_it() -> None:
    runs = [run("ref", 1, recoveries=1.0), run("mine", 1, recoveries=None), run("ref", 2, recoveries=2.0)]
    baseline_comparison = stack_comparison(
        *runs, run("mine", 2, recoveries=2.0), run("ref", 3, recoveries=5.0), run("mine", 3, recoveries=4.5)
    )
    found = difference_of(baseline_comparison, "recoveries")
    assert (found.pairs, found.lower, found.equal, found.higher) == (2, 1, 1, 0)
    assert (found.baseline, found.value, found.difference) == (3.5, 3.25, -0.25)


def test_pairs_with_a_robot_that_arrived_in_one_run_only_are_excluded() -> None:
    both = {"a/time_to_goal": 5.0, "b/time_to_goal": 6.0}
    baseline_comparison = stack_comparison(
        run("ref", 1, **both), run("mine", 1, **{**both, "b/time_to_goal": None}), run("ref", 2), run("mine", 2)
    )
    assert (baseline_comparison.pairs, baseline_comparison.pairs_with_different_arrivals) == (2, 1)


@pytest.mark.parametrize(("count", "more"), [(1, ""), (2, " (and 1 more)"), (3, " (and 2 more)")])
def test_flip_states_the_first_reason_and_the_number_of_others(count: int, more: str) -> None:
    bad = run("mine", outcome=Outcome.FAILED)
    warning = replace(bad.verdicts[0], severity="warn")
    (flip,) = stack_comparison(run("ref"), replace(bad, verdicts=(warning, *bad.verdicts * count))).flips
    assert flip.why == f"clearance: 0.03 m < 0.05 m, at t = 1.00 s, (1.00, 2.00){more}"


@pytest.mark.parametrize(("pairs", "has_interval"), [(4, False), (6, True)])
def test_differences_are_counted_by_direction_and_written_with_their_interval(pairs: int, has_interval: bool) -> None:
    runs = [run(name, seed, headway=2.0 + 0.5 * k) for seed in range(pairs) for k, name in enumerate(("ref", "mine"))]
    comparison = compare_stacks(runs, STACKS)
    assert comparison is not None
    found = difference_of(comparison.baseline_comparisons[0], "headway")
    assert (found.lower, found.equal, found.higher) == (0, 0, pairs)
    data = next(row for row in comparison_data(comparison)["against"][0]["differences"] if row["metric"] == "headway")
    assert data["interval"] == ([0.5, 0.5] if has_interval else None)


def test_metrics_of_packages_are_in_the_order_of_their_names() -> None:
    metrics = {f"metric_{letter}": 1.0 for letter in "hgfedcba"}
    names = [
        difference.metric for difference in stack_comparison(run("ref", **metrics), run("mine", **metrics)).differences
    ]
    assert [name for name in names if name.startswith("metric_")] == sorted(metrics)
