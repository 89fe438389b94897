"""Signals of synthetic traces, for tests."""

from simscen.criteria.trace_signals.catalog import read_signal
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

STEP_S = 6 / 240
"""Time between two samples of a synthetic trace."""


def signal(name, trace, case=None, **arguments):
    """Return the values of a signal in a synthetic trace; `trace` is the description of the trace."""
    return read_signal(name, synthetic_trace(trace), synthetic_case(case or {}), arguments)


def value_at(values, seconds):
    """Return the value of a signal at a time in s."""
    return values[round(seconds / STEP_S)]
