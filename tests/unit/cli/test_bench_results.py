"""Tests of result files of `simscen bench`: reading, comparison, and errors."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.bench.speed.measurement import Measurement
from simscen.bench.speed.session_speed import SuiteResult
from simscen.cli.benchmarks.results import FORMAT_VERSION, Result, as_json, comparison_text, judgment, read_result
from simscen.core.errors import UsageError

BEFORE = Result(
    {
        "patrol": Measurement.from_rounds((36.0, 40.0, 35.0), "ms per simulated second"),
        "log": Measurement.from_rounds((3.0, 3.2), "ms per simulated second"),
        "suite: runs a minute": Measurement(50.0, "", (), more_is_better=True),
        "scan": Measurement(0.0, "ms"),
    },
    "x86_64, 2 cores, avx",
    "0.1.0",
)
AFTER = Result(
    {
        "patrol": Measurement.from_rounds((18.0, 17.0, 20.0), "ms per simulated second"),
        "log": Measurement.from_rounds((3.1, 3.3), "ms per simulated second"),
        "suite: runs a minute": Measurement(100.0, "", (), more_is_better=True),
        "step": Measurement(14.0, "µs"),
    },
    "x86_64, 2 cores, avx",
    "0.1.0",
)

TABLE = """\
                                         before                      after  ratio  rounds before  rounds after
patrol                 36 ms per simulated second   18 ms per simulated second   0.50   35 … 40   17 … 20  better
log                   3.1 ms per simulated second  3.2 ms per simulated second   1.03   3 … 3.2  3.1 … 3.3  noise
suite: runs a minute                           50                          100   2.00         -          -
only before: scan
only after: step"""


def test_each_common_figure_has_a_line_with_its_judgment() -> None:
    output = comparison_text(BEFORE, AFTER)
    assert [line.split() for line in output.splitlines()] == [line.split() for line in TABLE.splitlines()]


def test_other_machine_and_version_are_reported() -> None:
    output = comparison_text(BEFORE, replace(AFTER, machine="aarch64, 4 cores", simscen="0.2.0"))
    assert "simscen 0.1.0 before, 0.2.0 after" in output
    assert "different machines: x86_64, 2 cores, avx before, aarch64, 4 cores after; compare only ratios" in output


def test_judgment_respects_direction_and_needs_two_rounds() -> None:
    slower, faster = (
        Measurement(10.5, "", (10.0, 11.0), more_is_better=True),
        Measurement(20.5, "", (20.0, 21.0), more_is_better=True),
    )
    assert (judgment(slower, faster), judgment(faster, slower)) == ("better", "worse")
    assert judgment(slower, Measurement.from_rounds((20.0,), "")) == ""


def test_zero_before_has_no_ratio() -> None:
    assert comparison_text(BEFORE, BEFORE).splitlines()[-1].split() == ["scan", "0", "ms", "0", "ms", "-", "-", "-"]


def test_result_survives_writing_and_reading(tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    file.write_text(as_json(BEFORE, {"patrol": {"cpu": 2.1}}))
    assert read_result(file) == BEFORE


@pytest.mark.parametrize(
    ("text", "expected_text"),
    [
        ("", "is not a result of `simscen bench --format json`: Expecting value"),
        ("[" * 100_000, "is not a result of `simscen bench --format json`"),
        ("[1]", "is not a result of `simscen bench --format json`: the key `simscen_bench` is missing"),
        ('{"patrol": {"cpu": 2.17}}', "the key `simscen_bench` is missing"),
        (
            json.dumps({"simscen_bench": FORMAT_VERSION + 1}),
            f"of another version of simscen bench (format {FORMAT_VERSION + 1}, this",
        ),
        (json.dumps({"simscen_bench": FORMAT_VERSION}), "is a damaged result of simscen bench: KeyError at 'figures'"),
        (
            json.dumps({"simscen_bench": FORMAT_VERSION, "figures": [1]}),
            "is a damaged result of simscen bench: AttributeError",
        ),
        (
            json.dumps(
                {"simscen_bench": FORMAT_VERSION, "figures": {"patrol": {"value": "fast", "unit": "", "rounds": []}}}
            ),
            "is a damaged result of simscen bench: ValueError",
        ),
    ],
)
def test_invalid_result_is_a_usage_error(tmp_path: Path, text: str, expected_text: str) -> None:
    file = tmp_path / "result.json"
    file.write_text(text)
    with pytest.raises(UsageError) as error:
        read_result(file)
    assert str(file) in str(error.value)
    assert expected_text in str(error.value)


@pytest.mark.parametrize("exists", [False, True])
def test_unreadable_result_is_a_usage_error(tmp_path: Path, exists: bool) -> None:
    file = tmp_path / "result.json"
    if exists:
        file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match=r"cannot read .*result\.json: (not UTF-8 text|No such file or directory)"):
        read_result(file)


def test_results_of_different_commands_cannot_be_compared() -> None:
    with pytest.raises(UsageError, match="no common figure; compare results of the same command"):
        comparison_text(BEFORE, replace(AFTER, figures={"2 robots": Measurement(80.0, "ms per simulated second")}))


def test_suite_in_which_all_runs_were_aborted_has_no_figures(simscen, monkeypatch: pytest.MonkeyPatch) -> None:
    empty_suite = SuiteResult(1, ("good",), 1, simulated=0.0, wall=1.0, cpu=0.0, memory=(), baseline=0.1)
    monkeypatch.setattr("simscen.bench.speed.session_speed.measure_suite", lambda *_: empty_suite)
    result = simscen("bench", "suite", "good.scenario.yaml", "-j", "1")
    assert (result.code, result.out, result.err) == (3, "", "1 runs were aborted: good\n")
