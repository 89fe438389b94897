"""Functions that create findings. A finding is the result of checking one bound: passed, failed, or inconclusive.

Common parameters:

- `what`: measured quantity, e.g. "path_length".
- `value`, `limit`: measured value and its limit in `unit`. `measured` is a measured value as text.
- `context`: text after the limit, e.g. "after lidar.off".
- `detail`: lines that explain a failure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Finding, Status

if TYPE_CHECKING:
    from simscen.core.records.trace import Trace

    At = tuple[Trace, int] | None
    """The trace and the tick that decided a finding; None if no single tick decided it."""


class InvalidTrace(ValueError):
    """The trace contains invalid values, such as nan, so that a criterion cannot be judged."""


class MissingEvidence(ValueError):
    """The trace lacks data that a criterion or a signal needs, so that the criterion is inconclusive."""


def at_most(
    what: str, value: float, limit: float, unit: str, *, at: At = None, context: str = "", detail: Sequence[str] = ()
) -> Finding:
    """Return a finding that passes if `value` <= `limit`. Raises InvalidTrace if `value` is nan."""
    return _bound_finding(what, value, limit, unit, limit - value, "≤", at, context, detail)


def at_least(
    what: str, value: float, limit: float, unit: str, *, at: At = None, context: str = "", detail: Sequence[str] = ()
) -> Finding:
    """Return a finding that passes if `value` >= `limit`. Raises InvalidTrace if `value` is nan."""
    return _bound_finding(what, value, limit, unit, value - limit, "≥", at, context, detail)


def counted(
    what: str, count: int, noun: str, low: int | None, high: int | None, *, at: At = None, detail: Sequence[str] = ()
) -> list[Finding]:
    """Return one finding for each bound on a number of events: for the minimum `low`, and for the maximum `high`.

    A bound of None is not checked. `noun` is the name of one event, e.g. "collision".
    """
    has_plural_ies = noun.endswith("y") and noun[-2:-1] not in tuple("aeiou")
    plural = f"{noun[:-1]}ies" if has_plural_ies else f"{noun}s"
    measured = f"{count} {noun if count == 1 else plural}"
    bounds = [] if low is None else [(count - low, f"≥ {low}")]
    bounds += [] if high is None else [(high - count, f"≤ {high}")]
    return [_finding(what, measured, limit, float(margin), "", float(count), at, detail) for margin, limit in bounds]


def undecided(what: str, because: str, limit: str = "", detail: Sequence[str] = ()) -> Finding:
    """Return an inconclusive finding with its reason."""
    return Finding(Status.INCONCLUSIVE, what, because, limit, detail=tuple(detail))


def if_complete(trace: Trace, finding: Finding) -> Finding:
    """Return the finding if the log is complete.

    If the log is truncated, return an inconclusive finding, because the value could still change.
    """
    if trace.of_kind(EventKind.RUN_ENDED):
        return finding
    return undecided(finding.what, f"{finding.measured} so far", finding.limit)


def missed(what: str, measured: str, limit: str, at: At = None, detail: Sequence[str] = ()) -> Finding:
    """Return a failed finding that has only text: no margin and no value."""
    return Finding(Status.FAIL, what, measured, limit, None, "", None, *_tick_and_place(at), detail=tuple(detail))


def held(what: str, measured: str, limit: str, at: At = None) -> Finding:
    """Return a passed finding that has only text: no margin and no value."""
    return Finding(Status.PASS, what, measured, limit, None, "", None, *_tick_and_place(at))


def format_quantity(value: float, unit: str, digits: int) -> str:
    """Return a number with its unit as text, e.g. "0.84 s" with 2 decimal digits."""
    return f"{value:.{digits}f} {unit}".rstrip()


def _bound_finding(
    what: str,
    value: float,
    limit: float,
    unit: str,
    margin: float,
    sign: str,
    at: At,
    context: str,
    detail: Sequence[str],
) -> Finding:
    if math.isnan(value):
        raise InvalidTrace(f"{what} is not a number")
    digits = decimals(value, limit)
    text = f"{sign} {format_quantity(limit, unit, digits)} {context}".rstrip()
    return _finding(what, format_quantity(value, unit, digits), text, margin, unit, value, at, detail)


def _finding(
    what: str, measured: str, limit: str, margin: float, unit: str, value: float, at: At, detail: Sequence[str]
) -> Finding:
    """Return a finding that passes if the margin is not negative. A passed finding has no details."""
    status, shown = (Status.PASS, ()) if margin >= 0 else (Status.FAIL, tuple(detail))
    return Finding(status, what, measured, limit, margin, unit, value, *_tick_and_place(at), shown)


def _tick_and_place(at: At) -> tuple[int | None, tuple[float, float] | None]:
    if at is None:
        return None, None
    trace, tick = at
    return tick, trace.place(tick) if len(trace.truth) else None


def decimals(value: float, limit: float) -> int:
    """Return how many decimal digits (2 to 9) are needed to print two numbers differently; 2 for equal numbers."""
    if value == limit or not math.isfinite(value) or not math.isfinite(limit):
        return 2
    return next((digits for digits in range(2, 9) if f"{value:.{digits}f}" != f"{limit:.{digits}f}"), 9)
