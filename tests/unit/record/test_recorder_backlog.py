"""Tests of the backlog of the recorder: order, completeness, and aborted runs."""

from itertools import pairwise

import pytest
from moments import moments

from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record.moment_buffer import MomentBuffer

SOME = list(moments(2.0))


class Heard:
    """A log that keeps what it is told, with its name, in the order of all logs."""

    def __init__(self, name: str, told: list[tuple[str, int]]) -> None:
        self.name, self.told = name, told

    def append(self, moment: Moment) -> None:
        self.told.append((self.name, moment.tick))


class Full:
    """A log on a disk without room."""

    def append(self, moment: Moment) -> None:
        raise RunError("output", "no space left")


@pytest.mark.parametrize("ticks", [0, 1, 60, 10_000])
def test_queued_messages_are_written_once_in_order(ticks: int) -> None:
    told: list[tuple[str, int]] = []
    backlog = MomentBuffer(ticks)
    robots = [backlog.sink(Heard(name, told)) for name in "ab"]
    for moment in SOME:
        for robot in robots:
            robot.append(moment)
    backlog.flush()
    backlog.flush()
    assert told == [(name, moment.tick) for moment in SOME for name in "ab"]


def test_messages_wait_at_most_for_the_given_ticks() -> None:
    told: list[tuple[str, int]] = []
    log = MomentBuffer(48).sink(Heard("", told))
    for moment in SOME:
        log.append(moment)
        assert moment.tick - told[-1][1] <= 48


def test_messages_are_written_immediately_with_a_delay_of_zero() -> None:
    told: list[tuple[str, int]] = []
    log = MomentBuffer(0).sink(Heard("", told))
    for moment in SOME:
        log.append(moment)
        assert told[-1][1] == moment.tick


def test_file_is_notified_after_each_flush() -> None:
    told: list[tuple[str, int]] = []

    class File:
        def flush_if_due(self) -> None:
            told.append(("file", told[-1][1]))

    log = MomentBuffer(48, File()).sink(Heard("", told))
    for moment in SOME:
        log.append(moment)
    settled = [tick for who, tick in told if who == "file"]
    assert len(settled) > 5
    assert all(later - earlier == 48 for earlier, later in pairwise(settled))


def test_log_of_each_robot_is_complete() -> None:
    told: list[tuple[str, int]] = []
    backlog = MomentBuffer(60)
    log = backlog.sink(Heard("trace", told), Heard("log", told))
    for moment in SOME:
        log.append(moment)
    backlog.flush()
    for name in ("trace", "log"):
        assert [tick for who, tick in told if who == name] == [moment.tick for moment in SOME]


def test_queued_messages_are_written_when_a_run_aborts() -> None:
    told: list[tuple[str, int]] = []
    with pytest.raises(ZeroDivisionError), MomentBuffer(10_000) as backlog:
        log = backlog.sink(Heard("", told))
        for moment in SOME:
            log.append(moment)
        raise ZeroDivisionError
    assert told[-1][1] == SOME[-1].tick


def test_abort_reason_is_reported_despite_a_full_disk() -> None:
    with pytest.raises(ZeroDivisionError), MomentBuffer(10_000) as backlog:
        backlog.next_flush_tick = 1
        backlog.sink(Full()).append(SOME[0])
        raise ZeroDivisionError
