"""Property tests of verdicts on random traces and criteria."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples, Trace
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

SECONDS = 8
SQUARE = [[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]]
CASE = {
    "goals": [{"name": "a", "pose": [2, 0, 0]}, {"name": "b", "pose": [0, 2, 1]}],
    "sent": [{"name": "detour", "pose": [1, 1, 0]}],
    "shortest": {"a": 2.0, "b": 2.8},
    "regions": {"wet": [[1, 1], [3, 1], [3, 2], [1, 3]]},
    "footprint": SQUARE,
}
LIMITS = {
    "goals_reached": ("tolerance", "yaw_tolerance", "within"),
    "no_false_success": ("tolerance",),
    "collisions": ("max", "max_impulse"),
    "time_to_goal": ("max",),
    "path_length": ("max", "max_ratio"),
    "speed": ("max", "max_turn_rate"),
    "stuck": ("max",),
    "localization_error": ("max", "rmse", "final", "max_yaw"),
    "relocalized_within": ("time",),
    "stopped_within": ("time",),
    "replans": ("max",),
    "recoveries": ("max",),
}
"""Bounds of each criterion that become looser if they are raised."""
LOWERED = {
    "clearance": ("min",),
    "personal_space": ("min",),
    "keepout": ("distance",),
    "replans": ("min",),
    "recoveries": ("min",),
}
"""Bounds of each criterion that become looser if they are lowered."""
FIXED = {
    "stopped_within": {"after": "lidar.off"},
    "relocalized_within": {"after": "kidnapped"},
    "keepout": {"region": "wet"},
    "result": {"status": "SUCCEEDED", "error_code": "NONE"},
    "error_code": {"code": "NONE", "goal": "a"},
}
TEMPORAL = {"always", "eventually", "until", "whenever", "smoothness", "localization_consistency"}
"""Drawn in test_temporal.py."""
COUNTS = {("collisions", "max"), ("replans", "min"), ("replans", "max"), ("recoveries", "min"), ("recoveries", "max")}


def eighths(low, high):
    """Return multiples of 1/8, which are exact in floating point, so that some values are equal to their bounds."""
    return st.integers(low, high).map(lambda n: n / 8)


COORDINATE, BOUND, TIME = eighths(-24, 24), eighths(1, 48), eighths(0, 8 * SECONDS)


@st.composite
def waypoints(draw):
    times = sorted({0.0, *draw(st.lists(TIME, max_size=4))})
    return [[t, *draw(st.tuples(COORDINATE, COORDINATE, COORDINATE))] for t in times]


@st.composite
def runs(draw) -> dict:
    """Return the description of a run for `synthetic_trace`."""
    times = sorted(draw(st.lists(TIME, min_size=9, max_size=9)))
    kinds = [
        ("goal.accepted", "a", {}),
        draw(st.sampled_from([("goal.reached", "a", {}), ("goal.canceled", "a", {"preempted_by": "detour"})])),
        ("goal.accepted", draw(st.sampled_from(["b", "detour"])), {}),
        ("fault.started", "lidar.off", {}),
        ("event.started", "kidnapped", {}),
        ("plan.made", "a", {"reason": "blocked"}),
        ("collision.started", "wall", {"impulse": draw(BOUND)}),
        ("recovery.started", "spin", {}),
        ("navigation.ended", draw(st.sampled_from(["SUCCEEDED", "FAILED"])), {"error_code": 0}),
    ]
    chosen = draw(st.lists(st.booleans(), min_size=9, max_size=9))
    return {
        "seconds": SECONDS,
        "truth": draw(waypoints()),
        "belief": draw(waypoints()),
        "objects": {"anna": draw(waypoints())},
        "clearance": [[0, draw(BOUND)], [SECONDS, draw(BOUND)]],
        "events": [[0, "object.spawned", "anna", {"person": True, "size": [0.25, 1.7]}]]
        + [[t, *kind] for t, kind, is_chosen in zip(times, kinds, chosen, strict=True) if is_chosen],
    }


KINDS = tuple(sorted({*LIMITS, *LOWERED, *FIXED}))


@st.composite
def criteria(draw, kinds=KINDS):
    """Return the kind of a criterion, and its fields with all bounds."""
    kind = draw(st.sampled_from(kinds))
    fields = dict(FIXED.get(kind, {}))
    for key in (*LIMITS.get(kind, ()), *LOWERED.get(kind, ())):
        fields[key] = draw(st.integers(0, 3)) if (kind, key) in COUNTS else draw(BOUND)
    if {"min", "max"} <= fields.keys():
        fields["min"], fields["max"] = sorted((fields["min"], fields["max"]))
    if kind == "path_length":
        fields["max_ratio"] = max(1.0, fields["max_ratio"])
    return kind, fields


def verdict(kind, fields, trace, case=CASE):
    (found,) = judge([AnyCriterion.model_validate({kind: fields})], trace, synthetic_case(case))
    return found


def test_every_criterion_is_drawn():
    assert {*LIMITS, *LOWERED, *FIXED, *TEMPORAL} >= set(AnyCriterion.choices())


@given(runs(), criteria())
@settings(deadline=None)
def test_the_sign_of_a_margin_is_the_verdict(run, criterion):
    found = verdict(*criterion, synthetic_trace(run))
    for finding in found.findings:
        if finding.margin is not None:
            assert finding.status is (Status.PASS if finding.margin >= 0 else Status.FAIL), finding
    if found.status is Status.PASS:
        assert all(finding.status is Status.PASS for finding in found.findings)


@given(runs(), criteria(), st.data())
@settings(deadline=None)
def test_looser_bound_keeps_a_pass(run, criterion, data):
    (kind, fields), trace = criterion, synthetic_trace(run)
    raised, lowered = LIMITS.get(kind, ()), LOWERED.get(kind, ())
    assume(raised or lowered)
    key = data.draw(st.sampled_from([*raised, *lowered]))
    change = data.draw(st.integers(0, 3)) if (kind, key) in COUNTS else data.draw(BOUND)
    if key in lowered:
        looser = max(fields[key] - change, 0)
    else:
        looser = fields[key] + change
    strict, loose = verdict(kind, fields, trace), verdict(kind, {**fields, key: looser}, trace)
    if strict.status is Status.PASS:
        assert loose.status is Status.PASS
    if loose.status is Status.FAIL:
        assert strict.status is Status.FAIL


def shift(trace: Trace, ticks: int) -> Trace:
    """Return the same run, `ticks` later."""

    def shift_samples(samples: Samples) -> Samples:
        return Samples(samples.ticks + ticks, samples.values)

    signals = ("truth", "velocity", "clearance", "belief", "odometry", "command")
    return replace(
        trace,
        **{name: shift_samples(getattr(trace, name)) for name in signals},
        scans=trace.scans + ticks,
        plans=tuple(replace(plan, tick=plan.tick + ticks) for plan in trace.plans),
        events=tuple(replace(event, tick=event.tick + ticks) for event in trace.events),
        objects={name: shift_samples(poses) for name, poses in trace.objects.items()},
        end=trace.end + ticks,
    )


@given(runs(), criteria(), st.integers(1, 10_000))
@settings(deadline=None)
def test_shifted_run_has_the_same_verdict_at_shifted_ticks(run, criterion, ticks):
    (kind, fields), trace = criterion, synthetic_trace(run)
    assume(kind != "relocalized_within" or "after" in fields)
    original, delayed = verdict(kind, fields, trace), verdict(kind, fields, shift(trace, ticks))
    assert [(f.status, f.what, f.value, f.margin) for f in original.findings] == [
        (f.status, f.what, f.value, f.margin) for f in delayed.findings
    ]
    assert [f.tick if f.tick is None else f.tick + ticks for f in original.findings] == [
        f.tick for f in delayed.findings
    ]


@given(runs(), criteria(), st.integers(1, 400))
@settings(deadline=None)
def test_truncated_log_never_turns_a_verdict_into_a_pass(run, criterion, cut):
    trace = synthetic_trace(run)
    end = trace.end - cut
    events = tuple(e for e in trace.events if e.tick <= end and e.kind is not EventKind.RUN_ENDED)
    assert verdict(*criterion, replace(trace, events=events)).status is not Status.PASS


POSE_CRITERIA = ("keepout", "path_length", "stuck", "localization_error", "relocalized_within")
NAVIGATION_EVENTS = [[0.5, "goal.accepted", "a"], [1, "event.started", "kidnapped"], [6, "goal.reached", "a"]]


@pytest.mark.parametrize("column", [0, 1, 2])
@given(criteria(POSE_CRITERIA), st.integers(0, 300), st.sampled_from([np.nan, np.inf, -np.inf]))
@settings(deadline=None)
def test_nan_pose_never_passes_a_criterion_that_uses_it(column, criterion, k, value):
    trace = synthetic_trace({"seconds": SECONDS, "truth": [[0, 0, 0], [SECONDS, 4, 0]], "events": NAVIGATION_EVENTS})
    trace.truth.values[k, column] = value
    kind, fields = criterion
    assert verdict(kind, fields, trace).status is not Status.PASS


def test_events_of_the_same_tick_keep_their_order():
    events = (Event(5, EventKind.GOAL_ACCEPTED, "a"), Event(5, EventKind.GOAL_REACHED, "a"))
    trace = replace(
        synthetic_trace({"seconds": 1, "truth": [[0, 2, 0, 0]]}), events=(*events, Event(240, EventKind.RUN_ENDED))
    )
    assert verdict("goals_reached", {"goals": ["a"]}, trace).status is Status.PASS
