import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.criteria.timeline import Span, clip_samples, enabled_spans, never_started, spans
from simscen.testing.synthetic_trace import synthetic_trace

SECOND = 240


def happened(*events):
    kinds = {"+": "fault.started", "-": "fault.ended"}
    listed = [[at, kinds[sign], "lidar.off", {"entry": entry}] for at, sign, entry in events]
    return spans(synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": listed}), "lidar.off")


def lasted(start, end):
    return Span(start * SECOND, end * SECOND, True)


def to_the_end(start):
    return Span(start * SECOND, 20 * SECOND, False)


@pytest.mark.parametrize(
    ("events", "expected"),
    [
        ([(2, "+", 0), (3, "-", 0)], [lasted(2, 3)]),
        ([(2, "+", 0), (3, "-", 0), (3, "+", 0), (5, "-", 0)], [lasted(2, 3), lasted(3, 5)]),
        ([(2, "+", 0), (4, "+", 1), (6, "-", 1)], [to_the_end(2), lasted(4, 6)]),
        ([(2, "+", 1), (4, "+", 0), (5, "-", 0), (9, "-", 1)], [lasted(2, 9), lasted(4, 5)]),
        (
            [(2, "+", 1), (3, "-", 1), (4, "+", 0), (5, "-", 0), (6, "+", 1), (7, "-", 1)],
            [lasted(2, 3), lasted(4, 5), lasted(6, 7)],
        ),
        ([(2, "+", 0), (2, "-", 0)], [to_the_end(2)]),
    ],
    ids=["once", "again", "another entry's end is not its own", "one within the other", "in turns", "no time"],
)
def test_fault_is_active_from_its_start_to_its_end(events, expected):
    assert happened(*events) == expected


def switched(*switches, grace=0.0, region="wet"):
    """Return when the keepout zone `wet` was on, in s; `switches` are (seconds, enabled, region, filter)."""
    events = [
        [at, "zone.switched", *(rest[:1] or ["wet"]), {"filter": (rest[1:] or ["keepout"])[0], "enabled": enabled}]
        for at, enabled, *rest in switches
    ]
    trace = synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": events})
    return [(first / SECOND, last / SECOND) for first, last in enabled_spans(trace, "keepout", region, grace)]


def test_zone_is_enabled_between_switching_on_and_off():
    assert switched((2, True), (5, False), (7, True), (9, False)) == [(2, 5), (7, 9)]
    assert switched((2, True)) == [(2, 20)]
    assert switched() == []


def test_zone_first_switched_off_is_enabled_from_the_start():
    assert switched((3, False)) == [(0, 3)]
    assert switched((0, False)) == [(0, 0)]


def test_switching_to_the_same_state_changes_nothing():
    assert switched((2, True), (4, True), (6, False), (8, False), (9, True)) == [(2, 6), (9, 20)]


def test_grace_period_follows_each_switch_on():
    assert switched((2, True), (5, False), (7, True), (8, False), grace=1.0) == [(3, 5), (8, 8)]
    assert switched((2, True), (3, False), grace=1.5) == []


def test_other_zones_and_filters_do_not_count():
    assert switched((2, True), (3, False, "dry"), (4, False, "wet", "speed"), (5, False)) == [(2, 5)]


def samples():
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
    clipped = clip_samples(samples(), first, last)
    assert dict(zip(clipped.ticks.tolist(), clipped.values[:, 0].tolist(), strict=True)) == expected


def test_started_entries_are_listed_by_name():
    events = [[k, "event.started", name] for k, name in enumerate("gfedcba")]
    trace = synthetic_trace({"seconds": 20, "truth": [[0, 0, 0]], "events": events})
    because, detail = never_started(trace, "gust")
    assert because.startswith("`gust` never started; the run ended at t = 20.00 s")
    assert detail == ["started in this run: `a`, `b`, `c`, `d`, `e`, `f`, `g`"]
