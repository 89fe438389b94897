"""Tests of `simscen compare`: pairing, `--fail-on`, errors, and formats."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.metrics.comparison import compare_sessions
from simscen.judge.significance import Significance
from simscen.report.journal import Journal
from simscen.report.journal_reader import PlannedRun

PASS, FAIL, ERROR = Outcome.PASSED, Outcome.FAILED, Outcome.ERROR


def result(
    outcome: Outcome, seed: int, scenario: str = "a", time: float = 10.0, stack: str = "", clearance: float = 0.5
) -> RunResult:
    finding = Finding(Status.FAIL, "clearance", "0.03 m", "≥ 0.05 m", -0.02, "m", tick=240, place=(1.0, 2.0))
    verdicts = (Verdict("clearance", "clearance", "fail", (finding,)),) if outcome is FAIL else ()
    error = RunFailure("crashed", "SIGSEGV") if outcome is ERROR else None
    metrics = {"time_to_goal": time, "path_length": 5.0, "min_clearance": clearance, "collisions": 0.0}
    key = RunKey(scenario, seed, stack_name=stack)
    return RunResult(key, f"{scenario}.scenario.yaml", outcome, verdicts, metrics={} if error else metrics, error=error)


@pytest.fixture
def folder(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes an output folder with the journal of finished runs."""

    def write(name: str, results: Sequence[RunResult], definition: str = "same") -> Path:
        path = tmp_path / name
        path.mkdir()
        journal = Journal(path)
        journal.plan([PlannedRun(result.key, result.path, definition=definition) for result in results], "0.1.0", 1)
        for result in results:
            journal(RunFinished(result, again=f"simscen run {result.path} --seed {result.key.seed}"))
        journal.close()
        return path

    return write


def compare(*arguments: object) -> Result:
    """Return the result of `simscen compare ARGUMENTS`, with its exception."""
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


def test_equal_sessions_are_not_worse(folder: Callable[..., Path]) -> None:
    runs = [result(PASS, seed) for seed in range(4)]
    comparison = compare(folder("a", runs), folder("b", runs))
    assert comparison.exit_code == 0
    assert "4 pairs of the same scenario and seed, all with equal outcomes" in comparison.output
    assert comparison.output.rstrip().endswith("candidate is not significantly worse in 4 pairs")


@pytest.mark.parametrize("outcome", [PASS, FAIL])
def test_baseline_without_completed_runs_cannot_be_compared(folder: Callable[..., Path], outcome: Outcome) -> None:
    comparison = compare(folder("a", [result(ERROR, 1)]), folder("b", [result(outcome, 1)]))
    assert "nothing to compare" in comparison.output
    assert comparison.exit_code == 3


def test_six_new_failures_in_six_pairs_are_significant_and_five_in_five_are_not(folder: Callable[..., Path]) -> None:
    """McNemar's exact test: p = 2 / 2^6 = 0.031 and 2 / 2^5 = 0.0625."""
    baseline = [result(PASS, seed) for seed in range(6)]
    candidate = [result(FAIL, seed) for seed in range(6)]
    six_pairs = compare(folder("a", baseline), folder("b", candidate))
    assert six_pairs.exit_code == 1
    assert "worse  a: pass rate 100% → 0% (p = 0.031, 6 pairs)" in six_pairs.output
    assert "simscen run a.scenario.yaml --seed 3" in six_pairs.output
    five_pairs = compare(folder("c", baseline[:5]), folder("d", candidate[:5]))
    assert five_pairs.exit_code == 0
    assert "5 runs fail that passed before, which may be chance" in five_pairs.output


def test_a_better_candidate_is_not_worse(folder: Callable[..., Path]) -> None:
    baseline = [result(FAIL, seed, time=20.0) for seed in range(8)]
    candidate = [result(PASS, seed, time=10.0 + seed / 100) for seed in range(8)]
    comparison = compare(folder("a", baseline), folder("b", candidate))
    assert comparison.exit_code == 0
    assert "better a: pass rate 0% → 100%" in comparison.output
    assert "better a: time_to_goal 20.00 → 10.04 s" in comparison.output


@pytest.mark.parametrize(
    ("metric", "baseline", "candidate", "is_worse"),
    [
        ("time", 10.0, 12.0, True),
        ("time", 12.0, 10.0, False),
        ("clearance", 0.5, 0.4, True),
        ("clearance", 0.4, 0.5, False),
        ("time", 10.0, 10.4, False),  # less than 5 %
    ],
)
def test_metrics_have_a_direction_and_a_smallest_effect(
    folder: Callable[..., Path], metric: str, baseline: float, candidate: float, is_worse: bool
) -> None:
    baseline_runs = [result(PASS, seed, **{metric: baseline + seed / 1000}) for seed in range(8)]
    candidate_runs = [result(PASS, seed, **{metric: candidate + seed / 900}) for seed in range(8)]
    assert compare(folder("a", baseline_runs), folder("b", candidate_runs)).exit_code == is_worse


def test_significance_is_corrected_for_the_number_of_tests(folder: Callable[..., Path]) -> None:
    """p = 0.031 is significant as the only test, also with a metric that does not differ, but not as one of two."""
    equal, noise = (
        [result(PASS, seed, "b", time=10.0 + offset * (-1) ** seed) for seed in range(6)] for offset in (0, 1)
    )
    baseline = [result(PASS, seed, time=10.0 + seed) for seed in range(6)]
    candidate = [result(PASS, seed, time=13.0 + 2 * seed) for seed in range(6)]
    assert compare(folder("a", baseline + equal), folder("b", candidate + equal)).exit_code == 1
    assert compare(folder("c", baseline + equal), folder("d", candidate + noise)).exit_code == 0


def test_any_flip_can_set_the_exit_code(folder: Callable[..., Path]) -> None:
    baseline, candidate = (
        folder("a", [result(PASS, 1), result(FAIL, 2)]),
        folder("b", [result(FAIL, 1), result(PASS, 2)]),
    )
    assert compare(baseline, candidate).exit_code == 0
    assert compare(baseline, candidate, "--fail-on", "flip").exit_code == 1
    assert compare(baseline, candidate, "--fail-on", "never").exit_code == 0


def test_runs_of_several_stacks_are_paired_by_stack(folder: Callable[..., Path]) -> None:
    baseline = [result(PASS, 1, stack="rpp"), result(FAIL, 1, stack="dwb")]
    candidate = [result(PASS, 1, stack="rpp"), result(PASS, 1, stack="dwb")]
    comparison = compare(folder("a", baseline), folder("b", candidate))
    assert "better a (dwb), seed 1: passed with candidate, failed with baseline" in comparison.output
    assert "simscen run a.scenario.yaml --seed 1" in comparison.output


def test_runs_that_could_not_be_completed_are_not_compared(folder: Callable[..., Path]) -> None:
    comparison = compare(
        folder("a", [result(PASS, 1), result(PASS, 2)]), folder("b", [result(PASS, 1), result(ERROR, 2)])
    )
    assert comparison.exit_code == 3
    assert "1 pair with an error" in comparison.output


def test_changed_scenarios_are_refused_unless_allowed(folder: Callable[..., Path]) -> None:
    baseline, candidate = folder("a", [result(PASS, 1)]), folder("b", [result(PASS, 1)], definition="other")
    comparison = compare(baseline, candidate)
    assert isinstance(comparison.exception, InvalidInput)
    assert [problem.code for problem in comparison.exception.problems] == ["SC811"]
    assert "a differs from the scenario in the baseline" in str(comparison.exception)
    assert compare(baseline, candidate, "--changed-scenarios").exit_code == 0


def test_sessions_without_a_common_run_are_refused(folder: Callable[..., Path]) -> None:
    comparison = compare(folder("a", [result(PASS, 1)]), folder("b", [result(PASS, 2)]))
    assert isinstance(comparison.exception, InvalidInput)
    assert "no run has a counterpart" in str(comparison.exception)


def test_comparison_is_printed_as_json_and_markdown(folder: Callable[..., Path]) -> None:
    baseline, candidate = folder("a", [result(PASS, 1)]), folder("b", [result(FAIL, 1)])
    data = json.loads(compare(baseline, candidate, "--format", "json").output)
    assert data["worse"] is False
    assert data["against"][0]["flips"][0]["scenario"] == "a"
    lines = compare(baseline, candidate, "--format", "markdown").output.splitlines()
    assert lines[0].startswith("### simscen: candidate is not significantly worse in 1 pair")
    assert "| a | 1/1 | 0/1 |" in lines


@pytest.mark.slow
def test_equal_versions_are_called_worse_with_at_most_the_stated_probability() -> None:
    """Compare three scenarios that fail at random and two noisy metrics, with the rule of the exit code."""
    rng, alarms, trials, alpha = np.random.default_rng(7), 0, 300, 0.1

    def random_result(scenario: str, seed: int) -> RunResult:
        outcome = PASS if rng.random() < 0.7 else FAIL
        return result(outcome, seed, scenario, time=rng.normal(10.0, 2.0), clearance=rng.normal(1.0, 0.2))

    for _ in range(trials):
        names = ("baseline", "candidate")
        sessions = {name: [random_result(scenario, seed) for scenario in "abc" for seed in range(10)] for name in names}
        significance = Significance(alpha, min_effect=0.0)
        (against,) = compare_sessions(sessions, dict.fromkeys(sessions, ""), significance).baseline_comparisons
        alarms += any(change.is_worse for change in against.changes)
    assert 0 < alarms <= trials * (alpha + 3 * (alpha * (1 - alpha) / trials) ** 0.5)


def test_lower_pass_rate_over_all_scenarios_is_significant(folder: Callable[..., Path]) -> None:
    """One of two runs of each of ten scenarios fails, which is not significant for a single scenario."""
    names = "abcdefghij"
    baseline = [result(PASS, seed, name) for name in names for seed in (1, 2)]
    candidate = [result(FAIL if seed == 1 else PASS, seed, name) for name in names for seed in (1, 2)]
    comparison = compare(folder("a", baseline), folder("b", candidate))
    assert comparison.exit_code == 1
    assert "worse  all scenarios: pass rate 100% → 50% (p = 0.021, 20 pairs)" in comparison.output
