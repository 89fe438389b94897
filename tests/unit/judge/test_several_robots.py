"""Tests of the combined result of several robots."""

from typing import Any

import pytest

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import ExpectedFailure, Finding, Status, Verdict
from simscen.judge.finding_text import DISTURBANCE
from simscen.judge.metrics.compute import NO_GOALS
from simscen.judge.several_robots import combine_robots
from simscen.testing.synthetic_trace import synthetic_trace


def verdict(name: str, status: Status = Status.PASS, criterion: str = "", measured: str = "1 m") -> Verdict:
    return Verdict(criterion or name, name, "fail", (Finding(status, name, measured, ""),))


def result(outcome: Outcome = Outcome.PASSED, **fields: Any) -> RunResult:
    error = RunFailure("invalid", "broken") if outcome is Outcome.ERROR else None
    return RunResult(RunKey("s", 1), "s.scenario.yaml", outcome, error=error, **fields)


def trace(*events: list[Any], seconds: int = 4) -> Trace:
    built: Trace = synthetic_trace({"seconds": seconds, "truth": [[0, 0, 0], [seconds, 1, 0]], "events": list(events)})
    return built


def disturbance(name: str, kind: str, happened: bool = True) -> DisturbanceOutcome:
    return DisturbanceOutcome(Disturbance(name, kind, "", True, 3), (5,) if happened else (), happened, "", 5)


TRACES = {"a": trace(), "b": trace()}


def test_verdicts_metrics_and_reasons_contain_the_robot_name() -> None:
    results = {
        "a": result(verdicts=(verdict("clearance"),), lines=(4,), metrics={"success": 1.0, "collisions": 0.0}),
        "b": result(
            verdicts=(verdict("speed"), verdict("clearance")),
            lines=(7, 8),
            metrics={"success": 1.0},
            undefined={"spl": "no way"},
        ),
    }
    whole = combine_robots(results, TRACES)
    assert [item.id for item in whole.verdicts] == ["a/clearance", "b/speed", "b/clearance"]
    assert whole.lines == (4, 7, 8)
    assert whole.metrics == {"success": 1.0, "a/success": 1.0, "a/collisions": 0.0, "b/success": 1.0}
    assert whole.undefined == {"b/spl": "no way"}
    assert (whole.outcome, whole.error, whole.reason) == (Outcome.PASSED, None, "")


def test_combined_result_has_no_lines_if_a_robot_has_none() -> None:
    results = {"a": result(verdicts=(verdict("clearance"),)), "b": result(verdicts=(verdict("speed"),))}
    assert combine_robots(results, TRACES).lines == ()
    first_only = {"a": result(verdicts=(verdict("clearance"),), lines=(4,)), "b": results["b"]}
    assert combine_robots(first_only, TRACES).lines == (4, 0)


@pytest.mark.parametrize(
    ("one", "two", "whole"),
    [
        (Outcome.PASSED, Outcome.PASSED, Outcome.PASSED),
        (Outcome.PASSED, Outcome.FAILED, Outcome.FAILED),
        (Outcome.ERROR, Outcome.FAILED, Outcome.ERROR),
        (Outcome.PASSED, Outcome.ERROR, Outcome.ERROR),
    ],
)
def test_the_worst_outcome_decides(one: Outcome, two: Outcome, whole: Outcome) -> None:
    assert combine_robots({"a": result(one), "b": result(two)}, TRACES).outcome is whole


def test_the_first_error_is_reported_with_its_robot() -> None:
    whole = combine_robots({"a": result(), "b": result(Outcome.ERROR), "c": result(Outcome.ERROR)}, TRACES)
    assert whole.error == RunFailure("invalid", "b: broken")


@pytest.mark.parametrize(("values", "success"), [((1.0, 1.0), 1.0), ((1.0, 0.0), 0.0), ((1.0, None), None)])
def test_all_robots_must_succeed(values: tuple[float | None, float | None], success: float | None) -> None:
    results = {name: result(metrics={"success": value}) for name, value in zip("ab", values, strict=True)}
    assert combine_robots(results, TRACES).metrics["success"] == success


@pytest.mark.parametrize(("value", "success"), [(1.0, 1.0), (0.0, 0.0), (None, None)])
def test_robot_without_goals_does_not_count_for_the_success(value: float | None, success: float | None) -> None:
    idle = result(metrics={"success": None}, undefined={"success": NO_GOALS})
    results = {"a": result(metrics={"success": value}), "b": idle}
    assert combine_robots(results, TRACES).metrics["success"] == success
    assert combine_robots({"b": idle}, TRACES).metrics["success"] is None


def test_a_missing_event_of_the_world_is_reported_once_and_a_fault_for_its_robot() -> None:
    event, again = disturbance("cart", "event", happened=False), disturbance("lidar.off", "fault", happened=False)
    missing = verdict("cart", Status.FAIL, DISTURBANCE, "cart never came")
    second = verdict("cart#2", Status.FAIL, DISTURBANCE, "cart never came")
    fault = verdict("lidar.off", Status.FAIL, DISTURBANCE, "lidar.off never began")
    own = verdict("clearance")
    results = {
        "a": result(Outcome.FAILED, verdicts=(missing, own), lines=(3, 9), disturbances=(event,)),
        "b": result(
            Outcome.FAILED, verdicts=(missing, second, fault, own), lines=(3, 3, 5, 9), disturbances=(event, again)
        ),
    }
    whole = combine_robots(results, TRACES)
    assert [item.id for item in whole.verdicts] == ["cart", "a/clearance", "b/lidar.off", "b/clearance"]
    assert whole.lines == (3, 9, 5, 9)
    assert [item.findings[0].measured for item in whole.verdicts] == [
        "cart never came", "1 m", "b/lidar.off never began", "1 m",
    ]  # fmt: skip
    assert [outcome.disturbance.name for outcome in whole.disturbances] == ["cart", "b/lidar.off"]


def test_world_events_count_once_and_robot_events_for_each_robot() -> None:
    shared = [[1, "object.moved", "cart", {}], [1, "object.spawned", "b", {}], [1, "floor.changed", "oil", {}]]
    traces = {
        "a": trace(*shared, [2, "plan.made", "", {}]),
        "b": trace(*shared, [2, "plan.made", "", {}], [3, "plan.made", "", {}]),
    }
    counted = combine_robots({"a": result(), "b": result()}, traces).events
    assert counted == {"floor.changed": 1, "object.moved": 1, "plan.made": 3, "run.ended": 1}
    assert list(counted) == sorted(counted)


def test_an_expected_failure_is_judged_over_all_robots() -> None:
    expected = ExpectedFailure("NAV-7", ("b/clearance",), 12)
    bad = result(Outcome.FAILED, verdicts=(verdict("clearance", Status.FAIL),), lines=(9,))
    good = result(verdicts=(verdict("clearance"),), lines=(9,))
    whole = combine_robots({"a": good, "b": bad}, TRACES, expected)
    assert (whole.outcome, whole.reason) == (Outcome.FAILED_AS_EXPECTED, "NAV-7")
    held = combine_robots({"a": good, "b": good}, TRACES, expected)
    assert held.outcome is Outcome.FAILED
    assert (held.verdicts[-1].criterion, held.lines[-1]) == ("expected", 12)


@pytest.mark.parametrize(("name", "kind"), [("door", "event"), ("b/lidar.off", "fault")])
def test_named_disturbance_of_any_robot_must_not_happen(name: str, kind: str) -> None:
    def combined(happened: bool) -> RunResult:
        disturbances = (disturbance(name.removeprefix("b/"), kind, happened),)
        bad = result(Outcome.FAILED, verdicts=(verdict("clearance", Status.FAIL),), disturbances=disturbances)
        first = result(disturbances=disturbances if kind == "event" else ())
        expected = ExpectedFailure("NAV-7", ("b/clearance", name))
        return combine_robots({"a": first, "b": bad}, TRACES, expected)

    assert combined(happened=False).outcome is Outcome.FAILED_AS_EXPECTED
    whole = combined(happened=True)
    assert whole.outcome is Outcome.FAILED
    assert whole.verdicts[-1].findings[0].measured == f"{name} happened"


def test_failure_is_expected_only_if_all_logs_are_complete() -> None:
    bad = result(Outcome.FAILED, verdicts=(verdict("clearance", Status.FAIL),), lines=(4,))
    good = result(verdicts=(verdict("clearance"),), lines=(5,))
    broken = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0], [4, 1, 0]], "ended": None})
    expected = ExpectedFailure("NAV-7", (), 12)
    whole = combine_robots({"a": bad, "b": good}, TRACES, expected)
    assert whole.outcome is Outcome.FAILED_AS_EXPECTED
    cut = combine_robots({"a": bad, "b": good}, {"a": trace(), "b": broken}, expected)
    assert cut.outcome is Outcome.FAILED
    assert [item.criterion for item in cut.verdicts] == ["clearance", "clearance"]
    assert cut.lines == (4, 5)


def test_different_numbers_of_lines_and_verdicts_are_refused() -> None:
    broken = result(verdicts=(verdict("clearance"), verdict("speed")), lines=(4,))
    with pytest.raises(ValueError, match="shorter"):
        combine_robots({"a": broken, "b": result()}, TRACES)
