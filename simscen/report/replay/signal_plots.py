"""Signals of a run as strips over time, with the bounds that criteria set on them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from simscen.core.geometry import Array
from simscen.core.records.case import Case
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import Finding, Verdict
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.trace_signals.catalog import SIGNALS, SignalName, read_signal
from simscen.criteria.trace_signals.sampling import SignalArguments, SignalUnavailable
from simscen.model.scenario import ScenarioSpec
from simscen.report.display_text import one_line
from simscen.report.replay.packed_columns import PackedColumns, keep_extremes

MAX_SAMPLES = 6000
"""Samples of a strip; twice as many as a wide screen has columns."""
_RESOLUTION_OF_UNIT = {"m": 1e-3, "rad": 1e-3, "s": 1e-2, "m/s": 1e-3, "rad/s": 1e-3, "m/s²": 1e-2, "m/s2": 1e-2}
_EXCLUDED_SIGNALS = frozenset({"time", "started"})
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
"""Criterion and unit of its finding → the signal that it bounds."""


@dataclass(frozen=True)
class SignalPlot:
    """A signal, and what it is about where it has to be said."""

    signal: SignalName
    of: SignalArguments

    @property
    def name(self) -> str:
        """E.g. "distance_to cart"."""
        about = [str(getattr(value, "name", value)) for value in self.of.values()]
        return one_line(" ".join((self.signal, *about)))


def signal_plots(trace: Trace, case: Case, spec: ScenarioSpec | None, columns: PackedColumns) -> list[dict[str, Any]]:
    """Every signal that the trace holds: those that need no more to be said, and those that criteria compare."""
    asked = dict.fromkeys(_signals_in_criteria(spec)) if spec is not None else {}
    plain = [
        SignalPlot(name, {})
        for name, signal in SIGNALS.items()
        if not signal.required_arguments and name not in _EXCLUDED_SIGNALS
    ]
    found = {strip.name: strip for strip in (*plain, *(SignalPlot(name, dict(of)) for name, of in asked))}
    return [told for strip in found.values() if (told := _plot_data(strip, trace, case, columns)) is not None]


def signal_limits(verdicts: tuple[Verdict, ...], robot: str) -> list[dict[str, Any]]:
    """The bounds of findings that bound a signal: which, how, and whether they held."""
    told = []
    for verdict in verdicts:
        whose, _, _ = verdict.id.rpartition("/")
        for finding in verdict.findings:
            if (whose == robot or not robot) and (bound := _bound(verdict, finding)) is not None:
                told.append({**bound, "verdict": one_line(verdict.id), "status": finding.status.value})
    return told


def _plot_data(strip: SignalPlot, trace: Trace, case: Case, columns: PackedColumns) -> dict[str, Any] | None:
    signal = SIGNALS[strip.signal]
    try:
        values = read_signal(strip.signal, trace, case, strip.of)
    except (SignalUnavailable, InvalidTrace):
        return None
    if not len(values) or not np.isfinite(values).any():
        return None
    kept = keep_extremes(np.nan_to_num(values), MAX_SAMPLES)
    return {
        "name": strip.name,
        "text": signal.text,
        "unit": signal.unit,
        "asks": signal.is_boolean,
        "ticks": columns.add(trace.truth.ticks[kept]) if len(kept) < len(values) else None,
        "values": columns.add(values[kept], _step(signal.unit, values)),
    }


def _step(unit: str, values: Array) -> float:
    """A thousandth of a meter and the like; of what counts, whole numbers."""
    finite = values[np.isfinite(values)]
    if unit == "" and np.array_equal(finite, np.rint(finite)):
        return 1.0
    return _RESOLUTION_OF_UNIT.get(unit, 1e-2)


def _signals_in_criteria(spec: ScenarioSpec) -> Iterator[tuple[SignalName, tuple[tuple[str, Any], ...]]]:
    for entry in spec.pass_:
        chosen = entry.chosen
        for one in chosen.compared() if isinstance(chosen, TemporalCriterion) else ():
            if one.signal is not None and one.signal not in _EXCLUDED_SIGNALS:
                yield one.signal, tuple(one.arguments.items())


def _bound(verdict: Verdict, finding: Finding) -> dict[str, Any] | None:
    relation = finding.limit[:1]
    if finding.margin is None or finding.value is None or relation not in ("≤", "≥", "<", ">"):
        return None
    least = relation in ("≥", ">")
    name = _SIGNAL_OF_CRITERION.get((verdict.criterion, finding.unit)) or finding.what.partition(" ")[0]
    if name not in SIGNALS or SIGNALS[name].unit != finding.unit:  # a margin in scales is no distance to a bound
        return None
    value = finding.value - finding.margin if least else finding.value + finding.margin
    return {"signal": name, "value": round(value, 6), "least": least}
