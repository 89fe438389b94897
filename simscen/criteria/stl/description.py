"""Descriptions of conditions, and of the measured values that decide them, as text for reports."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from simscen.criteria.findings import decimals, format_quantity

if TYPE_CHECKING:
    from simscen.criteria.stl.condition import Condition, Op, Window
    from simscen.criteria.stl.robustness import Witness

_SIGNS: dict[Op, str] = {">=": "≥", ">": ">", "<=": "≤", "<": "<"}
"""Printed sign of each comparison operator."""
_OPPOSITE: dict[Op, Op] = {">=": "<", ">": "<=", "<=": ">", "<": ">="}
"""Negation of each comparison operator."""


def describe(condition: Condition) -> str:
    """Return a condition as text, e.g. "whenever scan_age > 0.3 s, then eventually within 1 s speed < 0.01 m/s"."""
    if condition.signal is not None:
        return f"{describe_signal(condition)} {_limit(condition)}".rstrip()
    if condition.all is not None:
        return " and ".join(_in_parentheses(part) for part in condition.all)
    if condition.any is not None:
        return " or ".join(_in_parentheses(part) for part in condition.any)
    if condition.not_ is not None:
        return f"not {_in_parentheses(condition.not_)}"
    if condition.always is not None:
        return f"always {_window_text(condition.always)}{_in_parentheses(condition.always)}"
    if condition.eventually is not None:
        return f"eventually {_window_text(condition.eventually)}{_in_parentheses(condition.eventually)}"
    if condition.until is not None:
        until = condition.until
        return f"{_in_parentheses(until.hold)} until {_window_text(until)}{_in_parentheses(until.release)}"
    assert condition.whenever is not None and condition.then is not None
    return f"whenever {describe(condition.whenever)}, then {describe(condition.then)}"


def _window_text(window: Window) -> str:
    """Return a window as text with a space behind it, e.g. "within 5 s "; "" for the rest of the run."""
    if window.between is not None:
        return f"between {window.between[0]:g} s and {window.between[1]:g} s "
    if window.after is not None:
        return f"after {window.after:g} s "
    return "" if window.within is None else f"within {window.within:g} s "


def describe_signal(condition: Condition) -> str:
    """Return the signal of a comparison with its arguments, e.g. "distance_to cart"."""
    arguments = " ".join(str(value) for value in condition.arguments.values())
    return f"{condition.signal} {arguments}".rstrip()


def describe_value(witness: Witness) -> str:
    """Return the value of the signal of a witness with its unit, e.g. "0.62 m"; "yes" or "no" for yes-or-no signals.

    A witness is the comparison that decides a condition.
    """
    comparison = witness.comparison
    signal = comparison.definition
    if signal.is_boolean:
        return "yes" if witness.value else "no"
    assert comparison.value is not None
    if math.isinf(witness.value):
        return "infinite"
    return format_quantity(witness.value, signal.unit, decimals(witness.value, comparison.value))


def describe_limit(witness: Witness) -> str:
    """Return the limit of the comparison of a witness, e.g. "≥ 0.50 m". Below a `not`, return the negated limit."""
    comparison = witness.comparison
    signal = comparison.definition
    if signal.is_boolean:
        return "no" if witness.is_negated else "yes"
    assert comparison.value is not None and comparison.op is not None
    op = _OPPOSITE[comparison.op] if witness.is_negated else comparison.op
    digits = decimals(witness.value, comparison.value)
    return f"{_SIGNS[op]} {format_quantity(comparison.value, signal.unit, digits)}"


def _limit(condition: Condition) -> str:
    """Return the limit of a comparison, e.g. "≥ 0.5 m"; "" for a yes-or-no signal."""
    signal = condition.definition
    if signal.is_boolean:
        return ""
    assert condition.op is not None and condition.value is not None
    return f"{_SIGNS[condition.op]} {condition.value:g} {signal.unit}".rstrip()


def _in_parentheses(condition: Condition) -> str:
    """Return a condition as text, in parentheses unless it is a single comparison."""
    return describe(condition) if condition.signal is not None else f"({describe(condition)})"
