"""Tests of junit.xml with junitparser and the schema of Jenkins."""

import io
import re
from dataclasses import replace
from xml.etree import ElementTree

import junitparser
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.report.junit import xml_parts

JENKINS = {  # attributes that Jenkins' junit-10.xsd allows
    "testsuites": {"name", "time", "tests", "failures", "errors"},
    "testsuite": {"name", "tests", "failures", "errors", "time", "skipped", "timestamp", "hostname", "id", "file"},
    "testcase": {"name", "time", "classname", "group"},
    "failure": {"type", "message"},
    "error": {"type", "message"},
    "skipped": {"type", "message"},
    "system-out": set(),
}


def with_result(run, **changes):
    """Return the run with other values in its result."""
    return replace(run, result=replace(run.result, **changes))


def read_junit(runs, **options):
    return junitparser.JUnitXml.fromstring(b"".join(xml_parts(runs, **options)))


def cases_by_name(document):
    return {case.name: case for suite in document for case in suite}


def test_junitparser_reads_one_case_for_each_run(passed, failed, crashed):
    document = read_junit([failed, crashed, passed])
    assert (document.tests, document.failures, document.errors) == (3, 1, 1)
    assert [suite.name for suite in document] == sorted(run.result.path for run in (passed, failed, crashed))
    cases = cases_by_name(document)
    assert cases["goal [seed 1]"].is_passed
    assert cases["goal [seed 1]"].classname == "navigation.goal"
    assert cases["lidar_off [seed 7]"].result[0].type == "stopped_within"


def test_junitparser_reads_known_failures_and_unrun_cases_as_skipped(passed, failed):
    known_failure = with_result(failed, outcome=Outcome.FAILED_AS_EXPECTED, reason="NAV-1")
    skipped = with_result(passed, outcome=Outcome.SKIPPED, verdicts=(), lines=(), reason="NAV-2")
    document = read_junit([known_failure, skipped])
    assert (document.failures, document.errors) == (0, 0)
    assert [suite.skipped for suite in document] == [1, 1]
    messages = {case.result[0].message for case in cases_by_name(document).values()}
    assert messages == {
        "failed as expected: NAV-1 (stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41))",
        "NAV-2",
    }


def test_failure_has_position_and_reason_of_each_criterion(failed):
    (element,) = ElementTree.fromstring(b"".join(xml_parts([failed]))).iter("failure")
    message = "stopped_within: 0.84 s > 0.50 s after lidar.off, at t = 10.84 s, (2.10, 3.41)"
    assert element.get("message") == message
    assert element.text.splitlines() == [
        f"scenarios/faults/lidar_off.scenario.yaml:27: {message}",
        "    drove 0.31 m blind at 0.37 m/s; the newest scan was 0.9 s old",
        "again: simscen run scenarios/faults/lidar_off.scenario.yaml --seed 7",
    ]


def test_testcase_has_file_line_properties_and_attachments(failed):
    (case,) = ElementTree.fromstring(b"".join(xml_parts([failed]))).iter("testcase")
    properties = {entry.get("name"): entry.get("value") for entry in case.iter("property")}
    assert case.get("file") == failed.result.path
    with_other_path = replace(failed, file="../scenarios/lidar_off.scenario.yaml")
    suite = ElementTree.fromstring(b"".join(xml_parts([with_other_path])))[0]
    assert (suite.get("name"), suite[0].get("file")) == (with_other_path.file,) * 2
    assert case.get("line") == "27", "the line of the first failed criterion"
    assert case.get("time") == "0.350"
    assert properties["simulated_seconds"] == "31.000"
    assert properties["margin.stopped_within"] == "-0.34 s"
    (output,) = case.iter("system-out")
    assert output.text.splitlines() == [
        "scenarios/faults/lidar_off.scenario.yaml:28: warning: speed: 0.60 m/s > 0.50 m/s, at t = 1.00 s, (1.00, 1.00)",
        "[[ATTACHMENT|out/x/map.png]]",
        "[[ATTACHMENT|out/x/run.mcap]]",
        "[[ATTACHMENT|out/x/result.json]]",
    ]


def test_strict_family_conforms_to_the_jenkins_schema(passed, failed, crashed):
    known_failure = with_result(failed, outcome=Outcome.FAILED_AS_EXPECTED, reason="NAV-1")
    skipped = with_result(passed, outcome=Outcome.SKIPPED, verdicts=(), lines=(), reason="NAV-2")
    root = ElementTree.fromstring(
        b"".join(xml_parts([passed, failed, crashed, known_failure, skipped], family="xunit2"))
    )
    for element in root.iter():
        assert set(element.keys()) <= JENKINS[element.tag]
        if (seconds := element.get("time")) is not None:
            assert re.fullmatch(r"(([0-9]{0,3},)*[0-9]{3}|[0-9]{0,3})*(\.[0-9]{0,3})?", seconds)


@pytest.mark.parametrize(
    "kind", ["crashed", "timeout", "out-of-memory", "invalid", "interrupted", "not-run", "internal"]
)
def test_aborted_run_is_an_error_with_its_kind(crashed, kind):
    run = with_result(crashed, error=RunFailure(kind, "why", "output of the worker"))
    (element,) = ElementTree.fromstring(b"".join(xml_parts([run]))).iter("error")
    assert element.get("type") == kind
    assert "output of the worker" in element.text


def test_names_are_unique_even_if_runs_are_equal(passed):
    document = read_junit([passed, passed, passed])
    assert len(cases_by_name(document)) == 3


def test_order_of_finished_runs_does_not_change_the_file(passed, failed, crashed):
    assert b"".join(xml_parts([passed, failed, crashed])) == b"".join(xml_parts([crashed, passed, failed]))


@settings(max_examples=60)
@given(st.text(max_size=60), st.text(max_size=200), st.text(max_size=40))
def test_document_with_any_text_is_well_formed(name, tail, kind):
    failure = RunFailure(kind, tail, tail)
    run = RunFinished(RunResult(RunKey(name, 1), name, Outcome.ERROR, error=failure, ended=name), again=tail)
    root = ElementTree.parse(io.BytesIO(b"".join(xml_parts([run])))).getroot()
    assert len(list(root.iter("testcase"))) == 1


def test_escape_sequences_and_lone_surrogates_are_made_visible(crashed):
    run = with_result(crashed, error=RunFailure("crashed", "\x1b[31m \ud800 \u202e", "\x00"))
    text = b"".join(xml_parts([run])).decode()
    assert r"\x1b[31m \ud800 \u202e" in text
    assert r"\x00" in text
