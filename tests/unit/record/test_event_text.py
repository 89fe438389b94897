"""Tests of events as JSON and as lines of text."""

from simscen.core.records.events import Event
from simscen.record.messages import event_text


def test_an_event_is_read_back_equal() -> None:
    event = Event(12, "collision.started", 'a "wall" ü', {"x": 1 / 3, "n": 2, "list": [None, True, {"a": 1e-320}]})
    assert event_text.from_json(event_text.to_json(event)) == event


def test_an_event_with_an_infinite_number_is_read_back_equal() -> None:
    event = Event(0, "plan.failed", "", {"length": float("inf")})
    assert event_text.from_json(event_text.to_json(event)) == event


def test_an_event_reads_as_one_line() -> None:
    event = Event(1, "goal.failed", "shelf", {"error_code": 208, "after": 1.23456789})
    assert event_text.log_text(event) == "goal.failed shelf: error_code=208, after=1.235"
    assert event_text.log_text(Event(1, "navigation.ended")) == "navigation.ended"


def test_failures_have_the_level_error_or_warning() -> None:
    levels = [event_text.level(Event(0, kind)) for kind in ("goal.accepted", "recovery.started", "collision.started")]
    assert levels == sorted(set(levels))
