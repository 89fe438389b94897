"""Signal plots on the replay page: signals (quantities over time), and the limits that criteria set on signals."""

from math import isfinite
from typing import Any

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.case import Case
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Verdict
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.trace_signals.catalog import SIGNALS, SignalName, read_signal
from simscen.criteria.trace_signals.sampling import SignalArguments
from simscen.model.scenario import ScenarioSpec
from simscen.report.display_text import one_line
from simscen.report.replay.packed_columns import PackedColumns, extreme_indices

MAX_SAMPLES = 6000
"""Maximum number of samples per plot."""
_FINE_UNITS = frozenset({"m", "rad", "m/s", "rad/s"})
"""Units of values that are rounded to 0.001. Other values are rounded to 0.01."""
_EXCLUDED_SIGNALS = frozenset({"time", "started"})
"""Signals that are not plotted."""
_SIGNAL_OF_CRITERION = {
    ("clearance", "m"): "clearance",
    ("speed", "m/s"): "speed",
    ("speed", "rad/s"): "turn_rate",
    ("localization_error", "m"): "localization_error",
    ("localization_error", "rad"): "localization_yaw_error",
    ("personal_space", "m"): "person_distance",
    ("path_length", "m"): "travelled",
    ("replans", ""): "replan_count",
    ("recoveries", ""): "recovery_count",
    ("collisions", ""): "collision_count",
}
"""Signal that a criterion limits, by (criterion, unit of the finding)."""
_STATISTICS = frozenset({"localization_error rmse", "localization_error final"})
"""`Finding.what` for limits of a statistic. Such a limit is not a limit of the signal at each time."""


def signal_plots(trace: Trace, case: Case, spec: ScenarioSpec | None, columns: PackedColumns) -> list[dict[str, Any]]:
    """Return the data of all plots: signals without arguments, and signals in the temporal criteria of `spec`.

    Signals that the trace (recorded run) does not contain are omitted. `spec` is None if the scenario is invalid.
    """
    plots: dict[str, tuple[SignalName, SignalArguments]] = {
        name: (name, {}) for name, signal in SIGNALS.items() if not signal.alternative_arguments
    }
    criteria = () if spec is None else (entry.chosen for entry in spec.pass_)
    conditions = (criterion.condition for criterion in criteria if isinstance(criterion, TemporalCriterion))
    for comparison in (comparison for condition in conditions for comparison in condition.comparisons()):
        if comparison.signal is not None:
            words = (str(getattr(value, "name", value)) for value in comparison.arguments.values())
            plots[one_line(" ".join((comparison.signal, *words)))] = comparison.signal, comparison.arguments
    data = (
        _plot_data(title, signal, arguments, trace, case, columns)
        for title, (signal, arguments) in plots.items()
        if signal not in _EXCLUDED_SIGNALS
    )
    return [plot for plot in data if plot is not None]


def signal_limits(verdicts: tuple[Verdict, ...], robot: str) -> list[dict[str, Any]]:
    """Return the limits of signals in the findings about `robot` ("" for a single robot), with verdict and status."""
    limits = []
    for verdict in verdicts:
        owner = verdict.id.partition("/")[0] if "/" in verdict.id else ""
        for finding in verdict.findings:
            if (owner == robot or not robot) and (limit := _limit(verdict, finding)) is not None:
                limits.append({**limit, "verdict": one_line(verdict.id), "status": finding.status.value})
    return limits


def _plot_data(
    title: str, name: SignalName, arguments: SignalArguments, trace: Trace, case: Case, columns: PackedColumns
) -> dict[str, Any] | None:
    """Return the data of the plot `title`, such as "distance_to cart"; None if the trace lacks the signal."""
    signal = SIGNALS[name]
    try:
        values = read_signal(name, trace, case, arguments)
    except (MissingEvidence, InvalidTrace):
        return None
    if not len(values) or not np.isfinite(values).any():
        return None
    indices = extreme_indices(np.nan_to_num(values), MAX_SAMPLES)
    return {
        "name": title,
        "text": signal.text,
        "unit": signal.unit,
        "is_boolean": signal.is_boolean,
        "ticks": columns.add(trace.truth.ticks[indices]) if len(indices) < len(values) else None,
        "values": columns.add(values[indices], _step(signal.unit, values)),
    }


def _step(unit: str, values: Array) -> float:
    """Return the rounding step of a signal by its unit; 1 for whole numbers without a unit."""
    finite = values[np.isfinite(values)]
    if unit == "" and np.array_equal(finite, np.rint(finite)):
        return 1.0
    return 1e-3 if unit in _FINE_UNITS else 1e-2


def _limit(verdict: Verdict, finding: Finding) -> dict[str, Any] | None:
    """Return the signal and the limit of a finding; None if the finding limits no signal."""
    relation = finding.limit[:1]
    if finding.margin is None or finding.value is None or relation not in ("≤", "≥", "<", ">"):
        return None
    if finding.what in _STATISTICS:
        return None
    is_minimum = relation in ("≥", ">")
    name = _SIGNAL_OF_CRITERION.get((verdict.criterion, finding.unit)) or finding.what.partition(" ")[0]
    if name not in SIGNALS or SIGNALS[name].unit != finding.unit:
        return None  # with `scale`, the margin has another unit than the signal, and does not give the limit
    value = finding.value - finding.margin if is_minimum else finding.value + finding.margin
    return {"signal": name, "value": round(value, 6), "is_minimum": is_minimum} if isfinite(value) else None
