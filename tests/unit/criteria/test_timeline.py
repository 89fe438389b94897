"""Tests of spans of faults and zones, of clipped samples, and of entries that never started."""

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.criteria.timeline import Span, clip_samples, enabled_spans, never_started, spans
from simscen.testing.synthetic_trace import synthetic_trace

SECOND = 240


def fault_spans(*events):
    """Return the spans of the fault `lidar.off`; `events` are (seconds, "+" for start or "-" for end, entry)."""
    kinds = {"+": "fault.started", "-": "fault.ended"}
    trace_events = [[seconds, kinds[sign], "lidar.off", {"entry": entry}] for seconds, sign, entry in events]
    return spans(synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": trace_events}), "lidar.off")


def complete_span(start, end):
    return Span(start * SECOND, end * SECOND, True)


def unfinished_span(start):
    return Span(start * SECOND, 20 * SECOND, False)


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([(2, "+", 0), (3, "-", 0)], [complete_span(2, 3)]),
        ([(2, "+", 0), (3, "-", 0), (3, "+", 0), (5, "-", 0)], [complete_span(2, 3), complete_span(3, 5)]),
        ([(2, "+", 0), (4, "+", 1), (6, "-", 1)], [unfinished_span(2), complete_span(4, 6)]),
        ([(2, "+", 1), (4, "+", 0), (5, "-", 0), (9, "-", 1)], [complete_span(2, 9), complete_span(4, 5)]),
        (
            [(2, "+", 1), (3, "-", 1), (4, "+", 0), (5, "-", 0), (6, "+", 1), (7, "-", 1)],
            [complete_span(2, 3), complete_span(4, 5), complete_span(6, 7)],
        ),
        ([(2, "+", 0), (2, "-", 0)], [unfinished_span(2)]),
    ],
    ids=["once", "again", "another entry's end is not its own", "one within the other", "in turns", "no time"],
)
def test_fault_is_active_from_its_start_to_its_end(events, expected):
    assert fault_spans(*events) == expected


def enabled_seconds(*switches, grace=0.0, region="wet"):
    """Return when the keepout zone `wet` was on, in s; `switches` are (seconds, enabled, region, filter)."""
    events = [
        [
            seconds,
            "zone.switched",
            *(target[:1] or ["wet"]),
            {"filter": (target[1:] or ["keepout"])[0], "enabled": enabled},
        ]
        for seconds, enabled, *target in switches
    ]
    trace = synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": events})
    return [(first / SECOND, last / SECOND) for first, last in enabled_spans(trace, "keepout", region, grace)]


def test_zone_is_enabled_between_switching_on_and_off():
    assert enabled_seconds((2, True), (5, False), (7, True), (9, False)) == [(2, 5), (7, 9)]
    assert enabled_seconds((2, True)) == [(2, 20)]
    assert enabled_seconds() == []


def test_zone_first_switched_off_is_enabled_from_the_start():
    assert enabled_seconds((3, False)) == [(0, 3)]
    assert enabled_seconds((0, False)) == [(0, 0)]


def test_switching_to_the_same_state_changes_nothing():
    assert enabled_seconds((2, True), (4, True), (6, False), (8, False), (9, True)) == [(2, 6), (9, 20)]


def test_grace_period_follows_each_switch_on():
    assert enabled_seconds((2, True), (5, False), (7, True), (8, False), grace=1.0) == [(3, 5), (8, 8)]
    assert enabled_seconds((2, True), (3, False), grace=1.5) == []


def test_other_zones_and_filters_do_not_count():
    assert enabled_seconds((2, True), (3, False, "dry"), (4, False, "wet", "speed"), (5, False)) == [(2, 5)]


def four_samples():
    return Samples(np.array([10, 20, 30, 40]), np.array([[1.0], [2.0], [3.0], [4.0]]))


@pytest.mark.parametrize(
    ("first", "last", "expected"),
    [
        (20, 30, {20: 2.0, 30: 3.0}),
        (15, 35, {15: 1.0, 20: 2.0, 30: 3.0, 35: 3.0}),
        (0, 50, {10: 1.0, 20: 2.0, 30: 3.0, 40: 4.0}),
        (10, 40, {10: 1.0, 20: 2.0, 30: 3.0, 40: 4.0}),
        (40, 40, {40: 4.0}),
        (0, 5, {}),
    ],
)
def test_clipped_samples_are_held_at_both_ends(first, last, expected):
    clipped = clip_samples(four_samples(), first, last)
    assert dict(zip(clipped.ticks.tolist(), clipped.values[:, 0].tolist(), strict=True)) == expected


def test_started_entries_are_listed_by_name():
    events = [[k, "event.started", name] for k, name in enumerate("gfedcba")]
    trace = synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": events})
    reason, detail = never_started(trace, "gust")
    assert reason.startswith("`gust` never started; the run ended at t = 20.00 s")
    assert detail == ["started in this run: `a`, `b`, `c`, `d`, `e`, `f`, `g`"]
