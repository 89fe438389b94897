"""Text of conditions and of their decisive values, for reports."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from simscen.criteria.findings import decimals, quantity

if TYPE_CHECKING:
    from simscen.criteria.stl.condition import Condition, Op, Window
    from simscen.criteria.stl.robustness import Witness

_SIGNS: dict[Op, str] = {">=": "≥", ">": ">", "<=": "≤", "<": "<"}
_OPPOSITE: dict[Op, Op] = {">=": "<", ">": "<=", "<=": ">", "<": ">="}


def describe(condition: Condition) -> str:
    """Return all of it in words: "whenever localization_error > 0.5 m, then eventually within 5 s speed < 1 m/s"."""
    if condition.signal is not None:
        return f"{describe_signal(condition)} {_bound(condition)}".rstrip()
    if condition.all is not None:
        return " and ".join(_grouped(part) for part in condition.all)
    if condition.any is not None:
        return " or ".join(_grouped(part) for part in condition.any)
    if condition.not_ is not None:
        return f"not {_grouped(condition.not_)}"
    if condition.always is not None:
        return describe_windowed("always", condition.always, condition.always)
    if condition.eventually is not None:
        return describe_windowed("eventually", condition.eventually, condition.eventually)
    if condition.until is not None:
        return describe_until(condition.until.hold, condition.until.release, condition.until)
    assert condition.whenever is not None and condition.then is not None
    return describe_response(condition.whenever, condition.then)


def describe_windowed(operator: str, part: Condition, window: Window) -> str:
    """Return `always` or `eventually` in a window, in words."""
    return f"{' '.join(filter(None, (operator, describe_window(window))))} {_grouped(part)}"


def describe_until(hold: Condition, release: Condition, window: Window) -> str:
    """Return `hold` until `release` in a window, in words."""
    return " ".join(filter(None, (_grouped(hold), "until", describe_window(window), _grouped(release))))


def describe_response(premise: Condition, response: Condition) -> str:
    """Return "whenever …, then …"."""
    return f"whenever {describe(premise)}, then {describe(response)}"


def describe_window(window: Window) -> str:
    """Return a window in words; "" for the rest of the run."""
    if window.between is not None:
        return f"between {window.between[0]:g} s and {window.between[1]:g} s"
    if window.after is not None:
        return f"after {window.after:g} s"
    return "" if window.within is None else f"within {window.within:g} s"


def describe_signal(condition: Condition) -> str:
    """Return the signal and its arguments: "distance_to cart"."""
    arguments = " ".join(str(value) for value in condition.arguments.values())
    return f"{condition.signal} {arguments}".rstrip()


def describe_value(witness: Witness) -> str:
    """Return the decisive value with its unit."""
    comparison = witness.comparison
    signal = comparison.definition
    if signal.is_boolean:
        return "yes" if witness.value else "no"
    assert comparison.value is not None
    if math.isinf(witness.value):
        return "infinite"
    return quantity(witness.value, signal.unit, decimals(witness.value, comparison.value))


def describe_limit(witness: Witness) -> str:
    """Return the bound of the decisive value."""
    comparison = witness.comparison
    signal = comparison.definition
    if signal.is_boolean:
        return "no" if witness.negated else "yes"
    assert comparison.value is not None and comparison.op is not None
    op = _OPPOSITE[comparison.op] if witness.negated else comparison.op
    digits = decimals(witness.value, comparison.value)
    return f"{_SIGNS[op]} {quantity(comparison.value, signal.unit, digits)}"


def _bound(condition: Condition) -> str:
    signal = condition.definition
    if signal.is_boolean:
        return ""
    assert condition.op is not None and condition.value is not None
    return f"{_SIGNS[condition.op]} {condition.value:g} {signal.unit}".rstrip()


def _grouped(condition: Condition) -> str:
    """Return the condition in words, in parentheses unless it is a single comparison."""
    return describe(condition) if condition.signal is not None else f"({describe(condition)})"
