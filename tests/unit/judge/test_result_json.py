"""Tests of the exact content of result.json."""

import json
import math
from dataclasses import replace

import pytest

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.result_json import from_json, read_key, result_data, to_json

PLACED = Finding(Status.FAIL, "speed", "2.00 m/s", "≤ 1.00 m/s", -1.0, "m/s", 2.0, 600, (1.0, 2.0), ("why: gust",))
GUST = DisturbanceOutcome(Disturbance("gust", "event", "time: 2 s"), (480, 600), True, "pushed it", 480)
FAILED = RunResult(
    RunKey("a", 7),
    "a.scenario.yaml",
    Outcome.FAILED,
    (Verdict("speed", "speed", "fail", (PLACED,)), Verdict("result", "result", "fail")),
    disturbances=(GUST,),
    simulated=4.0,
)


def test_result_file_is_sorted_and_indented_by_two_with_unescaped_unicode():
    text = to_json(FAILED)
    assert text == json.dumps(result_data(FAILED), sort_keys=True, indent=2, ensure_ascii=False) + "\n"
    assert text.startswith('{\n  "again": "simscen run a.scenario.yaml --seed 7",\n')
    assert "≤ 1.00 m/s" in text


def test_result_file_has_format_2_and_other_formats_are_refused():
    assert result_data(FAILED)["format"] == 2
    with pytest.raises(ValueError, match="format 3; this version reads 2"):
        from_json(json.dumps({**result_data(FAILED), "format": 3}))


def test_ticks_have_times_in_seconds():
    data = result_data(FAILED)
    assert data["disturbances"][0]["times"] == [2.0, 2.5]
    assert data["verdicts"][0]["findings"][0]["time"] == 2.5


def test_verdicts_without_a_line_have_line_0():
    assert [verdict["line"] for verdict in result_data(FAILED)["verdicts"]] == [0, 0]


@pytest.mark.parametrize("lines", [(), (3, 0)])
def test_lines_of_verdicts_are_unchanged_after_writing_and_reading(lines):
    result = replace(FAILED, lines=lines)
    assert from_json(to_json(result)) == result


@pytest.mark.parametrize(
    ("name", "value"),
    [("reason", None), ("stack", True), ("path", -1), ("simulated_seconds", []), ("disturbances", 1), ("seed", "x")],
)
def test_value_of_another_type_is_refused(name, value):
    with pytest.raises(ValueError, match="not a result of a run"):
        from_json(json.dumps({**result_data(FAILED), name: value}))


def test_run_failure_is_unchanged_after_writing_and_reading():
    crashed = RunResult(RunKey("a", 7), "a", Outcome.ERROR, error=RunFailure("crashed", "SIGSEGV", "last words"))
    assert result_data(FAILED)["error"] is None
    assert result_data(crashed)["error"] == {"kind": "crashed", "message": "SIGSEGV", "tail": "last words"}
    assert from_json(to_json(crashed)) == crashed


def test_finding_position_is_unchanged_after_writing_and_reading():
    (finding,) = from_json(to_json(FAILED)).verdicts[0].findings
    assert finding == PLACED


def test_nan_times_are_not_written():
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_json(RunResult(RunKey("a", 7), "a", Outcome.PASSED, simulated=math.nan))


def test_number_of_lines_must_equal_number_of_verdicts():
    with pytest.raises(ValueError, match="shorter"):
        result_data(replace(FAILED, lines=(3,)))


def test_keys_of_older_files_without_variations_are_read():
    now = {"scenario": "a", "seed": 3, "variation": "speed=1", "stack_name": "dwb"}
    assert read_key(now) == RunKey("a", 3, "speed=1", "dwb")
    assert read_key({"scenario": "a", "seed": 3, "variation": "dwb"}) == RunKey("a", 3, "", "dwb")


@pytest.mark.parametrize("by_stack", [True, False])
def test_error_states_whether_the_stack_is_its_cause(by_stack):
    failure = RunFailure("crashed", "gone", "the end", by_stack)
    result = RunResult(RunKey("a", 1), "a", Outcome.ERROR, error=failure)
    assert from_json(to_json(result)).error == failure
    assert ("by_stack" in result_data(result)["error"]) == by_stack


@pytest.mark.parametrize("change", [{"simulated_seconds": 10**400}, {"verdicts": [{"line": 0, "findings": []}]}])
def test_values_that_cannot_be_converted_are_refused(change):
    with pytest.raises(ValueError, match="not a result of a run"):
        from_json(json.dumps({**result_data(FAILED), **change}))


def test_deeply_nested_text_and_a_place_without_numbers_are_refused():
    with pytest.raises(ValueError, match="not a result of a run"):
        from_json("[" * 100_000)
    data = result_data(FAILED)
    data["verdicts"][0]["findings"][0]["place"] = []
    with pytest.raises(ValueError, match="not a result of a run"):
        from_json(json.dumps(data))


def test_a_place_that_is_not_finite_is_written_as_unknown():
    finding = replace(PLACED, place=(math.nan, 0.0))
    result = replace(FAILED, verdicts=(Verdict("speed", "speed", "fail", (finding,)),))
    assert from_json(to_json(result)).verdicts[0].findings[0].place is None
