"""Tests of results of runs and their JSON files, and of runs with invalid signals."""

import json
import math

import pytest

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.verdict import ExpectedFailure
from simscen.criteria.clearance import Clearance
from simscen.criteria.registry import AnyCriterion
from simscen.judge.result_json import from_json, read_result, to_json
from simscen.judge.run_result import judge_run
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

TRACE = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": 0.5, "events": [[1, "plan.made", "", {}]]}


def conclude(trace, *criteria):
    built, case = synthetic_trace(trace), synthetic_case({})
    entries = [AnyCriterion.model_validate(words) for words in criteria]
    lines = tuple(range(10, 10 + len(criteria)))
    return judge_run(RunKey("a/b", 7), "scenarios/a/b.scenario.yaml", entries, built, case, lines)


def test_result_is_unchanged_after_writing_and_reading(tmp_path):
    result = conclude(TRACE, {"clearance": {"min": 0.6}}, {"goals_reached": {}})
    path = tmp_path / "result.json"
    path.write_text(to_json(result), encoding="utf-8")
    assert read_result(path) == result


def test_result_file_contains_texts_and_numbers_of_findings():
    data = json.loads(to_json(conclude(TRACE, {"clearance": {"min": 0.6}})))
    (verdict,) = data["verdicts"]
    (finding,) = verdict["findings"]
    assert data["outcome"] == "failed"
    assert data["again"] == "simscen run scenarios/a/b.scenario.yaml --seed 7"
    assert data["events"] == {"plan.made": 1, "run.ended": 1}
    assert data["simulated_seconds"] == 4.0
    assert verdict["line"] == 10
    assert finding["message"] == "clearance: 0.50 m < 0.60 m, at t = 0.00 s, (0.00, 0.00)"
    assert finding["margin"] == pytest.approx(-0.1)


def test_equal_runs_give_equal_result_files():
    words = ({"clearance": {"min": 0.2}}, {"collisions": {}}, {"speed": {"max": 1.0}})
    assert to_json(conclude(TRACE, *words)) == to_json(conclude(TRACE, *words))


def test_non_finite_numbers_become_null():
    text = to_json(conclude({**TRACE, "clearance": math.inf}, {"clearance": {"min": 0.2}}))
    assert "Infinity" not in text
    assert json.loads(text)["verdicts"][0]["findings"][0]["margin"] is None


def test_nan_in_an_unused_signal_makes_the_run_an_error():
    result = conclude({**TRACE, "truth": [[0, 0, 0], [2, math.nan, 0]]}, {"collisions": {}})
    assert result.outcome is Outcome.ERROR
    assert "not finite" in result.error.message


@pytest.mark.parametrize("broken", [math.nan, -math.inf])
def test_invalid_clearance_makes_the_run_an_error_without_a_criterion(broken):
    result = conclude({**TRACE, "clearance": [[0, 0.5], [2, broken], [4, 0.5]]}, {"collisions": {}})
    assert result.outcome is Outcome.ERROR
    assert "the clearance is not a number at t = " in result.error.message


@pytest.mark.parametrize("signal", ["truth", "velocity", "belief", "command"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_nan_in_one_sample_makes_the_run_an_error_for_any_criteria(signal, value):
    trace = synthetic_trace(TRACE)
    getattr(trace, signal).values[2, 1] = value
    criteria = [AnyCriterion.model_validate({"collisions": {}})]
    assert judge_run(RunKey("a", 7), "a", criteria, trace, synthetic_case({})).outcome is Outcome.ERROR


def test_object_without_pose_makes_the_run_an_error():
    result = conclude({**TRACE, "objects": {"cart": [[0, 0, 0], [2, math.nan, 0]]}}, {"collisions": {}})
    assert result.outcome is Outcome.ERROR
    assert "the pose of cart is not finite" in result.error.message


def test_infinite_clearance_is_valid_and_its_metric_is_the_maximum_range():
    result = conclude({**TRACE, "clearance": math.inf}, {"collisions": {}})
    assert result.outcome is Outcome.PASSED
    assert result.metrics["min_clearance"] == 2.0


def test_events_are_counted_in_the_order_of_their_names():
    events = [[1, "plan.made"], [2, "goal.accepted", "a"], [3, "plan.made"]]
    counted = conclude({**TRACE, "events": events}, {"collisions": {}}).events
    assert list(counted.items()) == [("goal.accepted", 1), ("plan.made", 2), ("run.ended", 1)]


def test_error_names_the_criteria_with_exceptions(monkeypatch):
    monkeypatch.setattr(Clearance, "judge", lambda *_: 1 / 0)
    criteria = [{"clearance": {"min": 0.1}}, {"collisions": {}}]
    assert conclude(TRACE, *criteria).error.message == "clearance: ZeroDivisionError: division by zero"
    broken = conclude({**TRACE, "truth": [[0, 0, 0], [2, math.nan, 0]]}, *criteria)
    assert broken.error.message == "clearance: ZeroDivisionError: division by zero"


def test_run_without_criteria_is_an_error():
    assert conclude(TRACE).error.message == "no criterion judged this run"
    assert conclude(TRACE, {"collisions": {}}).error is None


@pytest.mark.parametrize("text", ["{}", "[]", "3", '{"format": 99}', "nonsense"])
def test_other_content_is_refused(text):
    with pytest.raises(ValueError, match=r"not a result|format 99|Expecting"):
        from_json(text)


def expecting(trace, *criteria, lines=(10,)):
    built, case = synthetic_trace(trace), synthetic_case({})
    entries = [AnyCriterion.model_validate(words) for words in criteria]
    expected = ExpectedFailure("NAV-1", (), 30)
    return judge_run(RunKey("a/b", 7), "a/b.scenario.yaml", entries, built, case, lines, expected=expected)


def test_verdict_on_an_expected_failure_is_last_and_has_its_line():
    result = expecting(TRACE, {"clearance": {"min": 0.6}})
    assert result.outcome is Outcome.FAILED_AS_EXPECTED
    assert [verdict.criterion for verdict in result.verdicts] == ["clearance", "expected"]
    assert result.lines == (10, 30)
    assert result.reason == "NAV-1"
    held = expecting(TRACE, {"clearance": {"min": 0.2}})
    assert (held.outcome, held.lines) == (Outcome.FAILED, (10, 30))


@pytest.mark.parametrize(("happened", "outcome"), [(True, Outcome.FAILED), (False, Outcome.FAILED_AS_EXPECTED)])
def test_event_that_is_expected_not_to_happen_must_not_happen(happened, outcome):
    effects = [{"happened": happened, "what": "opened"}]
    events = [[1, "event.started", "door", {"entry": 0}], [1, "event.ended", "door", {"entry": 0, "effects": effects}]]
    case = synthetic_case({"disturbances": [{"name": "door", "kind": "event", "required": False}]})
    criteria = [AnyCriterion.model_validate({"clearance": {"min": 0.6}})]
    expected = ExpectedFailure("NAV-1", ("clearance", "door"))
    trace = synthetic_trace({**TRACE, "events": events})
    assert judge_run(RunKey("a", 7), "a", criteria, trace, case, expected=expected).outcome is outcome


def test_expected_failure_has_no_line_without_lines_of_criteria():
    assert expecting(TRACE, {"clearance": {"min": 0.6}}, lines=()).lines == ()


def test_truncated_logs_and_runs_without_expectation_have_no_such_verdict():
    broken = expecting({**TRACE, "ended": None}, {"clearance": {"min": 0.6}})
    assert [verdict.criterion for verdict in broken.verdicts] == ["clearance"]
    assert broken.lines == (10,)
    usual = conclude(TRACE, {"clearance": {"min": 0.6}})
    assert [verdict.criterion for verdict in usual.verdicts] == ["clearance"]
