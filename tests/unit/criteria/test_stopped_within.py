"""Tests of `stopped_within` with one velocity sample per 0.1 s."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

MOVING, STILL = 0.5, 0.0


def stop_findings(speeds, *faults, turn_rate=0.0, scans=(), **keys):
    """Return the findings for speeds at 0, 0.1, 0.2, … s and faults [from, to] in seconds."""
    events = []
    for start, end in faults:
        events.append([start, "fault.started", "lidar.off"])
        events += [] if end is None else [[end, "fault.ended", "lidar.off"]]
    ticks = np.arange(len(speeds), dtype=np.int64) * 24
    velocity = np.column_stack((speeds, np.zeros(len(speeds)), np.full(len(speeds), turn_rate)))
    trace = synthetic_trace({"seconds": (len(speeds) - 1) / 10, "truth": [[0, 0, 0]], "events": events})
    scan_ticks = np.array([round(t * 240) for t in scans], dtype=np.int64)
    trace = replace(trace, velocity=Samples(ticks, velocity), scans=scan_ticks)
    entry = AnyCriterion.model_validate({"stopped_within": {"time": 0.5, "after": "lidar.off", **keys}})
    (verdict,) = judge([entry], trace, synthetic_case({}))
    return verdict.findings


def test_standstill_includes_its_speed_limits():
    (finding,) = stop_findings([MOVING] * 12 + [0.02] * 10, (1.0, None), turn_rate=0.05)
    assert (finding.status, finding.value) == (Status.PASS, 0.2)
    (finding,) = stop_findings([MOVING] * 12 + [0.0201] * 10, (1.0, None))
    assert finding.status is Status.FAIL
    (finding,) = stop_findings([MOVING] * 12 + [STILL] * 10, (1.0, None), turn_rate=0.0501)
    assert finding.status is Status.FAIL


def test_standstill_before_the_fault_does_not_count():
    (finding,) = stop_findings([*[MOVING] * 9, STILL, *[MOVING] * 12], (1.05, None), hold=0.1, time=0.2)
    assert finding.status is Status.FAIL
    speeds = [*[MOVING] * 8, STILL, *[MOVING] * 13]
    (finding,) = stop_findings(speeds, (1.0, None), hold=0.1, time=0.2)
    assert finding.status is Status.FAIL
    assert "it never came to rest" in finding.detail


def test_standstill_that_ends_at_the_start_of_the_fault_does_not_count():
    speeds = [*[MOVING] * 9, STILL, *[MOVING] * 30]
    first, _ = stop_findings(speeds, (1.0, 1.7), (2.5, None), hold=0.1)
    assert (first.status, first.value) == (Status.FAIL, 0.7)


def test_newest_sample_determines_standstill_at_the_fault():
    assert stop_findings([*[MOVING] * 8, STILL, *[MOVING] * 13], (1.0, None))[0].status is Status.FAIL
    assert stop_findings([*[MOVING] * 9, STILL, *[MOVING] * 13], (1.0, None))[0].status is Status.INCONCLUSIVE
    assert stop_findings([STILL, *[MOVING] * 13], (0.0, None))[0].status is Status.INCONCLUSIVE


def test_fault_from_the_first_tick_includes_the_first_sample():
    first, second = stop_findings([STILL, *[MOVING] * 12, *[STILL] * 5], (0.0, 0.5), (1.0, None), hold=0.1)
    assert (first.status, first.value) == (Status.PASS, 0.0)
    assert (second.status, second.value) == (Status.PASS, 0.3)


def test_stop_at_the_end_of_the_fault_counts():
    (finding,) = stop_findings([MOVING] * 15 + [STILL] * 5, (1.0, 1.5))
    assert (finding.status, finding.margin) == (Status.PASS, 0.0)


def test_motion_is_undecided_if_run_and_time_limit_end_together():
    (finding,) = stop_findings([MOVING] * 16, (1.0, None))
    assert finding.status is Status.INCONCLUSIVE
    (finding,) = stop_findings([MOVING] * 17, (1.0, None))
    assert (finding.status, finding.value) == (Status.FAIL, 0.6)


def test_motion_is_undecided_if_fault_and_time_limit_end_together():
    (finding,) = stop_findings([MOVING] * 30, (1.0, 1.5))
    assert finding.status is Status.INCONCLUSIVE


@pytest.mark.parametrize(
    ("scan", "text"),
    [
        (2.0, "drove 0.00 m at 0.00 m/s"),
        (1.8, "drove 0.00 m at 0.00 m/s"),
        (1.775, "drove 0.00 m blind at 0.00 m/s; the newest scan was 0.2 s old"),
    ],
)
def test_a_scan_older_than_two_periods_is_reported(scan, text):
    (finding,) = stop_findings([MOVING] * 20 + [STILL] * 5, (1.0, None), scans=[scan])
    assert finding.detail[0] == text


@pytest.mark.parametrize(("peak", "text"), [(9, "0.50"), (10, "0.75"), (15, "0.75"), (20, "0.50"), (21, "0.50")])
def test_finding_states_the_maximum_speed_in_the_given_duration(peak, text):
    speeds = [MOVING] * 20 + [STILL] * 5
    if peak < 20:
        speeds[peak] = 0.75
    (finding,) = stop_findings(speeds, (1.0, None))
    assert finding.detail[1] == f"its top speed in that time was {text} m/s"


def test_maximum_speed_can_be_at_the_end():
    (finding,) = stop_findings([0.1] * 25, (1.0, None))
    assert finding.detail[1] == "its top speed in that time was 0.10 m/s"
    (finding,) = stop_findings([0.1] * 24 + [0.2], (1.0, None))
    assert finding.detail[1] == "its top speed in that time was 0.20 m/s"
