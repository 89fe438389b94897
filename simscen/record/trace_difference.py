"""Comparison of the traces of two runs that should be equal, for --check-determinism and --check-against."""

from collections.abc import Iterator

import numpy as np

from simscen.core.records.events import Event
from simscen.core.records.trace import Samples, Trace

_POSE = ("x", "y", "yaw")
_COLUMNS = {
    "truth": _POSE,
    "velocity": ("vx", "vy", "wz"),
    "clearance": ("clearance",),
    "belief": (*_POSE, "xx", "xy", "xyaw", "yy", "yyaw", "yawyaw"),
    "odometry": _POSE,
    "command": ("vx", "vy", "wz"),
}
"""Names of the columns of each signal. Signals that are missing here have the columns _POSE."""

Difference = tuple[int, str]
"""Tick and description of a difference."""


def first_difference(first: Trace, second: Trace) -> str | None:
    """Return a description of the first difference of two traces; None if the traces are equal to the bit.

    If several fields differ at this tick, describe the first of them in this order: truth, velocity, clearance,
    odometry, objects, scans, belief, command, plans, events.
    """
    if first.tick_rate != second.tick_rate:
        return f"tick rate: {first.tick_rate} against {second.tick_rate} Hz"
    differences = list(_differences(first, second))
    if not differences:
        return None
    tick, text = min(differences, key=lambda difference: difference[0])
    return f"tick {tick} (t = {first.seconds(tick):.3f} s): {text}"


def _differences(first: Trace, second: Trace) -> Iterator[Difference]:
    """Yield the first difference of each signal, all differences of plans and events, and different ends of the run."""
    for name in ("truth", "velocity", "clearance", "odometry"):
        yield from _sample_differences(name, getattr(first, name), getattr(second, name))
    empty = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    for name in sorted({*first.objects, *second.objects}):
        yield from _sample_differences(
            f"object {name}", first.objects.get(name, empty), second.objects.get(name, empty)
        )
    scans = (Samples(trace.scans, np.empty((len(trace.scans), 0))) for trace in (first, second))
    yield from _sample_differences("scan", *scans)
    for name in ("belief", "command"):
        yield from _sample_differences(name, getattr(first, name), getattr(second, name))
    for a, b in zip(first.plans, second.plans, strict=False):
        if a.tick != b.tick:
            yield min(a.tick, b.tick), f"plan: at tick {a.tick} against {b.tick}"
        elif len(a.points) != len(b.points):
            yield a.tick, f"plan: {len(a.points)} against {len(b.points)} poses"
        elif a.points.tobytes() != b.points.tobytes():
            yield a.tick, f"plan: the {len(a.points)} poses differ"
    yield from _length_difference("plan", [p.tick for p in first.plans], [p.tick for p in second.plans])
    for event, other_event in zip(first.events, second.events, strict=False):
        if repr(event) != repr(other_event):
            yield min(event.tick, other_event.tick), _describe_events(event, other_event)
    yield from _length_difference("event", [e.tick for e in first.events], [e.tick for e in second.events])
    if first.end != second.end:
        yield min(first.end, second.end), f"end of the run: tick {first.end} against {second.end}"


def _describe_events(first: Event, second: Event) -> str:
    """Return a description of two different events. If kind and name are equal, describe the ticks and the data."""
    if (first.kind, first.name) != (second.kind, second.name):
        return f"event: {first.kind} {first.name} against {second.kind} {second.name}"
    values = f"tick {first.tick} {dict(first.data)} against tick {second.tick} {dict(second.data)}"
    return f"event: {first.kind} {first.name}: {values}"


def _sample_differences(name: str, first: Samples, second: Samples) -> Iterator[Difference]:
    """Yield the first difference of a signal: a row that differs in at least one bit, or an additional row.

    nan equals nan, but 0.0 differs from -0.0.
    """
    n = min(len(first), len(second))
    if not n:
        yield from _length_difference(name, first.ticks.tolist(), second.ticks.tolist())
        return
    if first.values.shape[1] != second.values.shape[1]:
        counts = f"{first.values.shape[1]} against {second.values.shape[1]} columns"
        yield int(min(first.ticks[0], second.ticks[0])), f"{name}: {counts}"
        return
    a, b = (np.ascontiguousarray(samples.values[:n]) for samples in (first, second))
    differs = a.view(np.int64) != b.view(np.int64)
    rows = np.flatnonzero(differs.any(axis=1) | (first.ticks[:n] != second.ticks[:n]))
    if not len(rows):
        yield from _length_difference(name, first.ticks.tolist(), second.ticks.tolist())
        return
    row = int(rows[0])
    tick = int(min(first.ticks[row], second.ticks[row]))
    columns = np.flatnonzero(differs[row])
    if first.ticks[row] != second.ticks[row] or not len(columns):
        yield tick, f"{name}: at tick {first.ticks[row]} against {second.ticks[row]}"
        return
    column = int(columns[0])
    label = _COLUMNS.get(name, _POSE)[column]
    yield tick, f"{name}.{label}: {float(a[row, column])!r} against {float(b[row, column])!r}"


def _length_difference(name: str, first: list[int], second: list[int]) -> Iterator[Difference]:
    """Yield a difference at the first additional tick if one list of ticks is longer."""
    if len(first) != len(second):
        longer = max(first, second, key=len)
        yield longer[min(len(first), len(second))], f"{name}: {len(first)} against {len(second)}"


POSE_TOLERANCE_M_RAD = 1e-5
"""Maximum difference of true poses that `first_pose_difference` ignores, in m and rad."""


def first_pose_difference(first: Trace, second: Trace) -> str | None:
    """Return a description of the first difference of true poses above POSE_TOLERANCE_M_RAD; None without a difference.

    If all poses agree, describe different ends of the runs or different numbers of poses. This comparison is for runs
    on different processors.
    """
    if first.tick_rate != second.tick_rate:
        return f"tick rate: {first.tick_rate} against {second.tick_rate} Hz"
    count = min(len(first.truth.ticks), len(second.truth.ticks))
    distance = np.abs(first.truth.values[:count] - second.truth.values[:count])
    distance[:, 2] = np.minimum(distance[:, 2], np.abs(2 * np.pi - distance[:, 2]))
    rows = np.flatnonzero(
        (first.truth.ticks[:count] != second.truth.ticks[:count]) | ~(distance <= POSE_TOLERANCE_M_RAD).all(axis=1)
    )
    if len(rows):
        tick = int(first.truth.ticks[rows[0]])
        x, y, yaw = distance[rows[0]].tolist()
        time = f"tick {tick} (t = {first.seconds(tick):.3f} s)"
        return f"{time}: the true pose differs by {x:.2g} m, {y:.2g} m, {yaw:.2g} rad"
    if first.end != second.end:
        return f"the runs end at ticks {first.end} and {second.end}"
    if len(first.truth) != len(second.truth):
        return f"the traces have {len(first.truth)} and {len(second.truth)} true poses"
    return None
