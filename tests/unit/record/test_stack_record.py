"""Tests of reading the log lines and the metadata record of an external stack."""

from dataclasses import replace
from pathlib import Path

import pytest
from moments import CLOCK, moments, sample_header

from simscen.core.errors import InvalidInput
from simscen.core.records.trace import LogLine, Moment
from simscen.record import log_header
from simscen.record.log_reader import read_log
from simscen.record.recorder import Recorder

LINES = LogLine(30, "amcl", "no transform"), LogLine(20, "behavior_tree", "Spin: IDLE -> RUNNING")


def run_with_lines(tick: int) -> list[Moment]:
    """Return moments in which the stack logs two lines at a tick."""
    return [
        replace(moment, decision=replace(moment.decision, lines=LINES)) if moment.tick == tick else moment
        for moment in moments(0.5)
    ]


def test_lines_of_the_stack_are_read_at_their_ticks_without_events(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in run_with_lines(48):
            recorder.append(moment)
        recorder.close(120, "{}", {"external": "nav2", "about": "{}"})
    log = read_log(path, with_sensors=True)
    assert log.sensors.stack_lines() == [(48, line) for line in LINES]
    assert log.stack == {"external": "nav2", "about": "{}"}
    assert read_log(path).sensors.stack_lines() == []


def test_each_of_several_robots_has_its_own_stack_and_lines(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    header = replace(sample_header(), robots={name: sample_header() for name in "ab"})
    with Recorder(path, CLOCK, header) as recorder:
        for moment, other in zip(moments(0.5), run_with_lines(24), strict=True):
            recorder.robots["a"].append(moment)
            recorder.robots["b"].append(other)
        recorder.close(120, "{}", {"b.external": "nav2", "b.version": "1"})
    robots = read_log(path, with_sensors=True).robots
    assert [robots[name].stack for name in "ab"] == [{}, {"external": "nav2", "version": "1"}]
    assert robots["a"].sensors.stack_lines() == []
    assert robots["b"].sensors.stack_lines() == [(24, line) for line in LINES]


def test_log_with_two_stack_records_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with Recorder(path, CLOCK, sample_header()) as recorder:
        for moment in moments(0.2):
            recorder.append(moment)
        recorder._writer.add_metadata(log_header.STACK_RECORD, {"external": "nav2"})
        recorder.close(48, "{}", {"external": "other"})
    with pytest.raises(InvalidInput, match=r"two metadata records `simscen\.stack`"):
        read_log(path)
