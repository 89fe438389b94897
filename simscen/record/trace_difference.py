"""Comparison of the traces of two runs that should be equal, as for --check-determinism."""

from collections.abc import Iterator

import numpy as np

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

Difference = tuple[int, str]


def first_difference(one: Trace, other: Trace) -> str | None:
    """Return the first tick and field in which two traces differ by at least one bit, as text; None if they are equal.

    If several fields differ first at the same tick, the likely cause is named: truth before odometry before belief
    before command.
    """
    if one.tick_rate != other.tick_rate:
        return f"tick rate: {one.tick_rate} against {other.tick_rate} Hz"
    differences = list(_differences(one, other))
    if not differences:
        return None
    tick, text = min(differences, key=lambda difference: difference[0])
    return f"tick {tick} (t = {one.seconds(tick):.3f} s): {text}"


def _differences(one: Trace, other: Trace) -> Iterator[Difference]:
    for name in ("truth", "velocity", "clearance", "odometry"):
        yield from _in_samples(name, getattr(one, name), getattr(other, name))
    empty = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    for name in sorted({*one.objects, *other.objects}):
        yield from _in_samples(f"object {name}", one.objects.get(name, empty), other.objects.get(name, empty))
    yield from _in_samples("scan", *(Samples(t.scans, np.empty((len(t.scans), 0))) for t in (one, other)))
    for name in ("belief", "command"):
        yield from _in_samples(name, getattr(one, name), getattr(other, name))
    for a, b in zip(one.plans, other.plans, strict=False):
        if a.tick != b.tick or a.points.tobytes() != b.points.tobytes():
            yield min(a.tick, b.tick), f"plan: {len(a.points)} against {len(b.points)} poses, or other poses"
    yield from _missing("plan", [p.tick for p in one.plans], [p.tick for p in other.plans])
    for event, twin in zip(one.events, other.events, strict=False):
        if repr(event) != repr(twin):
            yield (
                min(event.tick, twin.tick),
                f"event: {event.kind} {event.name} against {twin.kind} {twin.name}",
            )
    yield from _missing("event", [e.tick for e in one.events], [e.tick for e in other.events])
    if one.end != other.end:
        yield min(one.end, other.end), f"end of the run: tick {one.end} against {other.end}"


def _in_samples(name: str, one: Samples, other: Samples) -> Iterator[Difference]:
    """Yield the first row that differs, bit for bit (nan equals itself, 0.0 differs from -0.0)."""
    n = min(len(one), len(other))
    a, b = (np.ascontiguousarray(samples.values[:n]) for samples in (one, other))
    differs = a.view(np.int64) != b.view(np.int64)
    rows = np.flatnonzero(differs.any(axis=1) | (one.ticks[:n] != other.ticks[:n]))
    if not len(rows):
        yield from _missing(name, one.ticks.tolist(), other.ticks.tolist())
        return
    row = int(rows[0])
    tick = int(min(one.ticks[row], other.ticks[row]))
    columns = np.flatnonzero(differs[row])
    if one.ticks[row] != other.ticks[row] or not len(columns):
        yield tick, f"{name}: at tick {one.ticks[row]} against {other.ticks[row]}"
        return
    column = int(columns[0])
    label = _COLUMNS.get(name, _POSE)[column]
    yield tick, f"{name}.{label}: {float(a[row, column])!r} against {float(b[row, column])!r}"


def _missing(name: str, one: list[int], other: list[int]) -> Iterator[Difference]:
    """Yield a difference if one run has more ticks than the other."""
    if len(one) != len(other):
        longer = max(one, other, key=len)
        yield longer[min(len(one), len(other))], f"{name}: {len(one)} against {len(other)}"


POSE_TOLERANCE = 1e-5
"""Tolerance for true poses in m and rad. Machines with different arithmetic differ by less than 1e-12 after 90 s."""


def first_disagreement(one: Trace, other: Trace) -> str | None:
    """Return the first tick at which true poses differ by more than POSE_TOLERANCE, as text; None if there is none."""
    if one.tick_rate != other.tick_rate:
        return f"tick rate: {one.tick_rate} against {other.tick_rate} Hz"
    count = min(len(one.truth.ticks), len(other.truth.ticks))
    distance = np.abs(one.truth.values[:count] - other.truth.values[:count])
    distance[:, 2] = np.minimum(distance[:, 2], np.abs(2 * np.pi - distance[:, 2]))
    rows = np.flatnonzero(
        (one.truth.ticks[:count] != other.truth.ticks[:count]) | ~(distance <= POSE_TOLERANCE).all(axis=1)
    )
    if len(rows):
        tick = int(one.truth.ticks[rows[0]])
        x, y, yaw = distance[rows[0]].tolist()
        when = f"tick {tick} (t = {one.seconds(tick):.3f} s)"
        return f"{when}: the true pose differs by {x:.2g} m, {y:.2g} m, {yaw:.2g} rad"
    if one.end != other.end:
        return f"the runs end at ticks {one.end} and {other.end}"
    return None
