"""Where two runs that should be equal part."""

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
    """The first tick and field in which two traces differ by a bit, as a sentence; None when they are equal.

    Fields that part at the same tick are told in the order of cause and effect: truth before odometry before belief
    before command.
    """
    if one.tick_rate != other.tick_rate:
        return f"tick rate: {one.tick_rate} against {other.tick_rate} Hz"
    found = list(_differences(one, other))
    if not found:
        return None
    tick, what = min(found, key=lambda difference: difference[0])
    return f"tick {tick} (t = {one.seconds(tick):.3f} s): {what}"


def _differences(one: Trace, other: Trace) -> Iterator[Difference]:
    for name in ("truth", "velocity", "clearance", "odometry"):
        yield from _in_samples(name, getattr(one, name), getattr(other, name))
    nothing = Samples(np.empty(0, dtype=np.int64), np.empty((0, 3)))
    for name in sorted({*one.objects, *other.objects}):
        yield from _in_samples(f"object {name}", one.objects.get(name, nothing), other.objects.get(name, nothing))
    yield from _in_samples("scan", *(Samples(t.scans, np.empty((len(t.scans), 0))) for t in (one, other)))
    for name in ("belief", "command"):
        yield from _in_samples(name, getattr(one, name), getattr(other, name))
    for a, b in zip(one.plans, other.plans, strict=False):
        if a.tick != b.tick or a.points.tobytes() != b.points.tobytes():
            yield min(a.tick, b.tick), f"plan: {len(a.points)} against {len(b.points)} poses, or other poses"
    yield from _missing("plan", [p.tick for p in one.plans], [p.tick for p in other.plans])
    for event, twin in zip(one.events, other.events, strict=False):
        if repr(event) != repr(twin):
            yield min(event.tick, twin.tick), f"event: {event.kind} {event.name} against {twin.kind} {twin.name}"
    yield from _missing("event", [e.tick for e in one.events], [e.tick for e in other.events])
    if one.end != other.end:
        yield min(one.end, other.end), f"end of the run: tick {one.end} against {other.end}"


def _in_samples(name: str, one: Samples, other: Samples) -> Iterator[Difference]:
    """The first row that differs, bit for bit (nan equals itself, 0.0 is not -0.0)."""
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
    """That one run has more of something."""
    if len(one) != len(other):
        longer = max(one, other, key=len)
        yield longer[min(len(one), len(other))], f"{name}: {len(one)} against {len(other)}"


POSE_TOLERANCE = 1e-5
"""m and rad by which true poses may differ. Without fused multiply-add they differ by less than 1e-12 after 90 s."""


def first_disagreement(one: Trace, other: Trace) -> str | None:
    """The first tick at which the true poses are not the same within TOLERANCE, as a sentence; None: there is none."""
    if one.tick_rate != other.tick_rate:
        return f"tick rate: {one.tick_rate} against {other.tick_rate} Hz"
    both = min(len(one.truth.ticks), len(other.truth.ticks))
    apart = np.abs(one.truth.values[:both] - other.truth.values[:both])
    apart[:, 2] = np.minimum(apart[:, 2], np.abs(2 * np.pi - apart[:, 2]))
    wrong = np.flatnonzero(
        (one.truth.ticks[:both] != other.truth.ticks[:both]) | ~(apart <= POSE_TOLERANCE).all(axis=1)
    )
    if len(wrong):
        tick = int(one.truth.ticks[wrong[0]])
        x, y, yaw = apart[wrong[0]].tolist()
        when = f"tick {tick} (t = {one.seconds(tick):.3f} s)"
        return f"{when}: the true pose differs by {x:.2g} m, {y:.2g} m, {yaw:.2g} rad"
    if one.end != other.end:
        return f"the runs end at ticks {one.end} and {other.end}"
    return None
