"""Tests of MomentBuffer, which delays recording: order, completeness, and aborted runs."""

from itertools import pairwise

import pytest
from moments import moments

from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record.moment_buffer import MomentBuffer

MOMENTS = list(moments(2.0))


class ListLog:
    """Log that appends its name and the tick of each moment to a list that all logs share."""

    def __init__(self, name: str, written: list[tuple[str, int]]) -> None:
        self.name, self.written = name, written

    def append(self, moment: Moment) -> None:
        self.written.append((self.name, moment.tick))


class FullDisk:
    """Log on a full disk."""

    def append(self, moment: Moment) -> None:
        raise RunError("output", "no space left")


@pytest.mark.parametrize("ticks", [0, 1, 60, 10_000])
def test_queued_messages_are_written_once_in_order(ticks: int) -> None:
    written: list[tuple[str, int]] = []
    buffer = MomentBuffer(ticks)
    robots = [buffer.sink(ListLog(name, written)) for name in "ab"]
    for moment in MOMENTS:
        for robot in robots:
            robot.append(moment)
    buffer.flush()
    buffer.flush()
    assert written == [(name, moment.tick) for moment in MOMENTS for name in "ab"]


def test_moments_are_written_after_at_most_the_given_ticks() -> None:
    written: list[tuple[str, int]] = []
    log = MomentBuffer(48).sink(ListLog("", written))
    for moment in MOMENTS:
        log.append(moment)
        assert moment.tick - written[-1][1] <= 48


def test_messages_are_written_immediately_with_a_delay_of_zero() -> None:
    written: list[tuple[str, int]] = []
    log = MomentBuffer(0).sink(ListLog("", written))
    for moment in MOMENTS:
        log.append(moment)
        assert written[-1][1] == moment.tick


def test_file_is_notified_after_each_flush() -> None:
    written: list[tuple[str, int]] = []

    class File:
        def flush_if_due(self) -> None:
            written.append(("file", written[-1][1]))

    log = MomentBuffer(48, File()).sink(ListLog("", written))
    for moment in MOMENTS:
        log.append(moment)
    flushes = [tick for log_name, tick in written if log_name == "file"]
    assert len(flushes) > 5
    assert all(later - earlier == 48 for earlier, later in pairwise(flushes))


def test_log_of_each_robot_is_complete() -> None:
    written: list[tuple[str, int]] = []
    buffer = MomentBuffer(60)
    log = buffer.sink(ListLog("trace", written), ListLog("log", written))
    for moment in MOMENTS:
        log.append(moment)
    buffer.flush()
    for name in ("trace", "log"):
        assert [tick for log_name, tick in written if log_name == name] == [moment.tick for moment in MOMENTS]


def test_queued_messages_are_written_when_a_run_aborts() -> None:
    written: list[tuple[str, int]] = []
    with pytest.raises(ZeroDivisionError), MomentBuffer(10_000) as buffer:
        log = buffer.sink(ListLog("", written))
        for moment in MOMENTS:
            log.append(moment)
        raise ZeroDivisionError
    assert written[-1][1] == MOMENTS[-1].tick


def test_abort_reason_is_reported_despite_a_full_disk() -> None:
    with pytest.raises(ZeroDivisionError), MomentBuffer(10_000) as buffer:
        buffer.next_flush_tick = 1
        buffer.sink(FullDisk()).append(MOMENTS[0])
        raise ZeroDivisionError
