"""Metrics of installed packages, computed for the scenarios that ask for them."""

import math
from collections.abc import Sequence

from simscen.core.records.case import Case
from simscen.core.records.evidence import Evidence, LogCoverage
from simscen.core.records.trace import Trace
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.judge.metrics.compute import MetricValues


def add_plugin_metrics(
    computed: MetricValues, metrics: Sequence[AnyMeasure], trace: Trace, case: Case, coverage: LogCoverage
) -> MetricValues:
    """Return the metrics with those that a scenario asks for added.

    Raises InvalidTrace if one fails or is not a finite number: the scenario asked for it, and studies compare it.
    """
    values, undefined = dict(computed.values), dict(computed.undefined)
    for entry in metrics:
        found = _value(entry, trace, case, coverage)
        values[entry.kind] = None if isinstance(found, str) else found
        if isinstance(found, str):
            undefined[entry.kind] = found
    return MetricValues(values, undefined)


def _value(entry: AnyMeasure, trace: Trace, case: Case, coverage: LogCoverage) -> float | str:
    """Return the value, or why there is none."""
    wanted = entry.measure.evidence
    lacking = coverage.lacking(frozenset(Evidence) if wanted is None else wanted)
    if lacking:
        return f"the log does not say {' nor '.join(one.value for one in lacking)}"
    try:
        found = entry.measure.measure(trace, case)
    except MissingEvidence as missing:
        return str(missing)
    except Exception as error:  # the boundary to plug-ins, which can raise anything
        raise InvalidTrace(f"metric {entry.kind}: {type(error).__name__}: {error}{entry.added_by}") from error
    if isinstance(found, str) and found:
        return found
    if isinstance(found, bool) or not isinstance(found, int | float) or not math.isfinite(found):
        raise InvalidTrace(f"metric {entry.kind} is no number: {found!r}{entry.added_by}")
    return float(found)
