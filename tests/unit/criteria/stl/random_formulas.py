"""Random formulas, and runs to judge them by."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from simscen.core.records.trace import Samples
from simscen.criteria.stl.condition import Condition
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CASE = synthetic_case({"clearance_range": math.inf})
SIGNALS = {"clearance": "p", "yaw_rate": "q"}
NUMBERS = st.integers(-3, 3).map(float)
VALUES = st.lists(NUMBERS, min_size=1, max_size=12)


def run(p, q, ended=True):
    """A run with these clearances and yaw rates, one sample a second."""
    trace = synthetic_trace({"seconds": 0, "truth": [[0, 0, 0]], "ended": "navigation ended" if ended else None})
    ticks = np.arange(len(p), dtype=np.int64) * 240
    still = np.zeros((len(p), 3))
    turning = np.column_stack((still[:, :2], q))
    truth, clearance = Samples(ticks, still), Samples(ticks, np.array(p, dtype=np.float64)[:, np.newaxis])
    return replace(trace, truth=truth, velocity=Samples(ticks, turning), clearance=clearance, end=int(ticks[-1]))


WINDOWS = st.tuples(st.integers(0, 4), st.integers(1, 4)).map(lambda w: (w[0], w[0] + w[1]))
BOUNDS = st.tuples(
    st.sampled_from(sorted(SIGNALS)), st.sampled_from([">=", "<=", ">", "<"]), st.sampled_from([0, 1, 2])
)
COMPARISONS = BOUNDS.map(lambda bound: dict(zip(("signal", "op", "value"), bound, strict=True)))


def larger(smaller):
    return st.one_of(
        st.lists(smaller, min_size=1, max_size=3).map(lambda parts: {"all": parts}),
        st.lists(smaller, min_size=1, max_size=3).map(lambda parts: {"any": parts}),
        smaller.map(lambda part: {"not": part}),
        st.tuples(st.sampled_from(["always", "eventually"]), WINDOWS, smaller).map(
            lambda parts: {parts[0]: {**parts[2], "between": list(parts[1])}}
        ),
        st.tuples(smaller, smaller, WINDOWS).map(
            lambda parts: {"until": {"hold": parts[0], "release": parts[1], "between": list(parts[2])}}
        ),
    )


FORMULAS = st.recursive(COMPARISONS, larger, max_leaves=5)


def with_responses(smaller):
    """The same operators and `whenever … then`, with windows to the end of the run as well."""
    return st.one_of(
        larger(smaller),
        st.tuples(smaller, smaller).map(lambda parts: {"whenever": parts[0], "then": parts[1]}),
        st.tuples(st.sampled_from(["always", "eventually"]), smaller).map(
            lambda parts: {parts[0]: parts[1]} if "between" not in parts[1] else parts[1]
        ),
    )


RESPONSES = st.recursive(COMPARISONS, with_responses, max_leaves=6)


def inner(part):
    return {key: value for key, value in part.items() if key != "between"}


def horizon(formula):
    match formula:
        case {"all": parts} | {"any": parts}:
            return max(horizon(part) for part in parts)
        case {"not": part}:
            return horizon(part)
        case {"until": {"hold": hold, "release": release, "between": [_, b]}}:
            return b + max(horizon(hold), horizon(release))
        case {"signal": _}:
            return 0
    (part,) = formula.values()
    return part["between"][1] + horizon(inner(part))


def validated(formula):
    """As YAML gives it: the bounds of windows are numbers of seconds."""
    return Condition.model_validate(formula)
