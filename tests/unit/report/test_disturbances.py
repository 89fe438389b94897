"""Tests of events and faults in reports."""

import io
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.report.console_reporter import text_reporter
from simscen.report.github import annotations
from simscen.report.junit import xml_parts
from simscen.report.suite import SessionReport, to_html

FALLEN = DisturbanceOutcome(
    Disturbance("pallet falls", "event", "time: 3 s", line=7), (720,), True, "spawned pallet", 720
)
REPEATED = DisturbanceOutcome(
    Disturbance("push", "event", "…", line=8), tuple(range(240, 2000, 240)), True, "pushed", 240
)
NEVER = DisturbanceOutcome(Disturbance("<b>::error::", "fault", "time: 90 s", line=9), (), False, "it never began")


@pytest.fixture
def run_with_disturbances(failed):
    """Return a failed run with a disturbance that happened, one that happened often, and one that never began."""
    finding = Finding(Status.FAIL, "disturbance did not happen", "<b>::error:: (when time: 90 s)", "")
    verdict = Verdict("disturbance", NEVER.disturbance.name, "fail", (finding,))
    result = failed.result
    return replace(failed, result=replace(
        result,
        disturbances=(FALLEN, REPEATED, NEVER),
        verdicts=(verdict, *result.verdicts),
        lines=(9, *result.lines),
    ))  # fmt: skip


def console_lines(run) -> list[str]:
    """Return the lines that the console reporter prints for a run."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with text_reporter(out) as listener:
        listener(run)
    out.seek(0)
    return out.read().splitlines()


def test_console_lists_disturbances_of_a_failed_run_with_times(run_with_disturbances):
    lines = console_lines(run_with_disturbances)
    assert lines[1] == "      disturbance did not happen: <b>::error:: (when time: 90 s)"
    assert lines[5:8] == [
        "      happened  pallet falls: t = 3.00 s, spawned pallet",
        "                push: t = 1.00 s, 2.00 s, 3.00 s, 4.00 s, 5.00 s and 3 more, pushed",
        "      scenario  scenarios/faults/lidar_off.scenario.yaml:9",
    ]


def test_passed_run_is_one_line(passed):
    assert (
        len(console_lines(replace(passed, result=replace(passed.result, disturbances=(FALLEN, REPEATED, NEVER))))) == 1
    )


def test_junit_lists_all_disturbances_and_the_failed_one(run_with_disturbances):
    case = next(ElementTree.fromstring(b"".join(xml_parts([run_with_disturbances]))).iter("testcase"))
    assert case.find("failure").get("type") == "disturbance"
    assert "lidar_off.scenario.yaml:9: disturbance did not happen" in case.find("failure").text
    assert case.find("system-out").text.splitlines()[1:4] == [
        "event pallet falls: t = 3.00 s, spawned pallet",
        "event push: t = 1.00 s, 2.00 s, 3.00 s, 4.00 s, 5.00 s and 3 more, pushed",
        "fault <b>::error::: it never began, so it did not happen",
    ]


def test_annotation_has_the_line_of_the_entry(run_with_disturbances):
    assert any("line=9" in line and "disturbance did not happen" in line for line in annotations(run_with_disturbances))


def test_page_lists_disturbances_as_escaped_text(run_with_disturbances):
    page = to_html(SessionReport([run_with_disturbances]))
    assert "<td>happened</td><td>pallet falls</td><td>when time: 3 s</td><td>t = 3.00 s</td>" in page
    assert '<tr class="bad"><td>did not happen</td><td>&lt;b&gt;::error::</td>' in page
