"""How far ahead of a moment a condition must look before it can be decided."""

from __future__ import annotations

from simscen.criteria.condition import Condition, Window


def needed(condition: Condition, holds: bool = True) -> float:
    """The least seconds after which it can be known that it holds, or does not.

    A window without an end is decided by the end of the run, whenever that is.
    """
    if condition.all is not None or condition.any is not None:
        every = (condition.all is not None) == holds
        times = [needed(part, holds) for part in condition.all or condition.any or ()]
        return max(times) if every else min(times)
    if condition.not_ is not None:
        return needed(condition.not_, not holds)
    if condition.always is not None:
        return in_time("always", condition.always, condition.always, holds)
    if condition.eventually is not None:
        return in_time("eventually", condition.eventually, condition.eventually, holds)
    if condition.until is not None:
        return released(condition.until.release, condition.until) if holds else 0.0
    return 0.0


def in_time(operator: str, part: Condition, window: Window, holds: bool = True) -> float:
    """Of always or eventually: all of the window, or its first moment."""
    begin, end = window.stretch
    whole = (operator == "always") == holds
    return (begin if not whole or end is None else end) + needed(part, holds)


def released(release: Condition, window: Window) -> float:
    """Of a release in a window: its first moment."""
    return window.stretch[0] + needed(release)
