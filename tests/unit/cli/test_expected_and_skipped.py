"""Tests of `expected` and `skip` in all reports."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

import simscen as package
from simscen.cli.session.logs import recorded_result
from simscen.core.errors import InvalidInput
from simscen.record.log_reader import read_run

TEXT = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}, {speed: {max: 0.1}}]
expected: {fail: "too fast, NAV-1"}
variations:
  list:
    - {name: known, seed: 1}
    - {name: other, expected.criteria: [collisions]}
    - {name: mended, pass: [{collisions: {max: 0}}]}
    - {name: skipped, skip: "no lift here, NAV-2"}
"""


@pytest.fixture
def project(simscen, tmp_path: Path) -> Path:
    """Return a folder with a scenario that has a variation that fails as expected."""
    (tmp_path / "good.scenario.yaml").unlink()
    (tmp_path / "a.scenario.yaml").write_text(TEXT)
    return tmp_path


def test_reports_distinguish_expected_failures_and_skipped_runs(simscen, project: Path) -> None:
    result = simscen(
        "run", ".", "--repeat", "2", "--seed", "1", "-k", "not other", "--out", "out", "--format", "github"
    )
    assert result.code == 1, result.out
    output = "failed as expected: too fast, NAV-1 (speed: 0.50 m/s > 0.10 m/s"
    lines = [" ".join(line.split()) for line in result.out.splitlines()]
    assert any(line.startswith("~ a[known] (seed 1) 1.0 s simulated") and output in line for line in lines)
    assert "- a[skipped] (seed 1) skipped: no lift here, NAV-2" in lines
    assert "expected: everything passed; expected a failure: too fast, NAV-1" in result.out
    assert "0 passed, 2 failed, 2 failed as expected, 1 skipped" in result.out
    assert f"::notice file=a.scenario.yaml,line=6,title=a[known] (seed 1)::{output}" in result.out
    assert "::error file=a.scenario.yaml,line=7,title=a[mended] (seed 1)::expected: everything passed" in result.out
    document = json.loads((project / "out/results.json").read_text())
    assert {name: document[name] for name in ("passed", "failed", "error", "failed-as-expected", "skipped")} == {
        "passed": 0,
        "failed": 2,
        "error": 0,
        "failed-as-expected": 2,
        "skipped": 1,
    }
    assert {run["reason"] for run in document["runs"]} == {"too fast, NAV-1", "no lift here, NAV-2"}
    suite = ElementTree.parse(project / "out/junit.xml").find("testsuite")
    assert suite is not None
    assert [suite.get(name) for name in ("tests", "failures", "errors", "skipped")] == ["5", "2", "0", "3"]
    kinds = [(element.get("type"), str(element.get("message"))[:31]) for element in suite.iter("skipped")]
    assert kinds == [("simscen.expected-failure", output[:31])] * 2 + [("simscen.skip", "no lift here, NAV-2")]
    page = (project / "out/report.html").read_text()
    assert "2 failed as expected" in page
    assert "no lift here, NAV-2" in page
    log = project / "out/runs/a/seed-1-known/run.mcap"
    read = read_run(log)
    assert recorded_result(replace(read, result=""), log).outcome is recorded_result(read, log).outcome
    with pytest.raises(InvalidInput, match="its result cannot be read: a result of format 1"):
        recorded_result(replace(read, result='{"format": 1}'), log)
    judged = simscen("judge", "out")
    assert judged.code == 1
    assert "0 passed, 2 failed, 2 failed as expected, 1 skipped" in judged.out


@pytest.mark.slow
def test_session_with_only_expected_outcomes_passes(simscen, project: Path) -> None:
    assert simscen("run", ".", "-k", "known or skipped", "--check-determinism", "--fail-fast").code == 0


@pytest.mark.slow
def test_unexpected_failure_fails(simscen, project: Path) -> None:
    result = simscen("run", ".", "-k", "other")
    assert result.code == 1
    assert "expected: collisions passed; expected a failure" in result.out
    assert "speed: 0.50 m/s > 0.10 m/s" in result.out


def test_session_with_only_skipped_scenarios_selects_nothing(simscen, project: Path) -> None:
    result = simscen("run", ".", "-k", "skipped", "--repeat", "9", "--check-determinism", "--out", "out")
    assert result.code == 5
    assert "nothing was run" in result.err
    assert [run["outcome"] for run in json.loads((project / "out/results.json").read_text())["runs"]] == ["skipped"]


@pytest.mark.slow
def test_aborted_run_is_an_error_despite_an_expected_failure(simscen, project: Path) -> None:
    result = simscen("run", ".", "-k", "known", "--stack", "mine=/bin/false")
    assert result.code == 3
    assert "1 error" in result.out


def test_skipped_scenario_must_be_valid(simscen, project: Path) -> None:
    (project / "a.scenario.yaml").write_text(TEXT.replace("x: 5", "x: 50"))
    assert simscen("run", ".", "-k", "skipped").code == 2


def test_list_shows_expected_failures_and_skips(simscen, project: Path) -> None:
    lines = simscen("list", ".").out.splitlines()
    assert lines[0] == "a[known]    (expected to fail: too fast, NAV-1)"
    assert lines[-1] == "a[skipped]  (skipped: no lift here, NAV-2)"


def test_python_interface_does_not_report_expected_failure_as_passed(project: Path) -> None:
    run = package.simulate("a.scenario.yaml", variation="known")
    assert (run.passed, run.as_expected) == (False, True)
    assert not package.simulate("a.scenario.yaml", variation="mended").as_expected
