"""The metrics that installed packages add, measured beside the others."""

import math
from collections.abc import Sequence

from simscen.core.case import Case
from simscen.core.evidence import Coverage, Evidence
from simscen.core.trace import Trace
from simscen.criteria.bounds import BrokenTrace, NotRecorded
from simscen.criteria.measure import AnyMeasure
from simscen.judge.measure.metrics import Measures


def with_added(
    measures: Measures, metrics: Sequence[AnyMeasure], trace: Trace, case: Case, coverage: Coverage
) -> Measures:
    """The same with the metrics that a scenario asks for. Raises BrokenTrace for one that is no number.

    A number that its author did not mean is worse than none: studies compare it.
    """
    values, undefined = dict(measures.values), dict(measures.undefined)
    for entry in metrics:
        found = _measured(entry, trace, case, coverage)
        values[entry.kind] = None if isinstance(found, str) else found
        if isinstance(found, str):
            undefined[entry.kind] = found
    return Measures(values, undefined)


def _measured(entry: AnyMeasure, trace: Trace, case: Case, coverage: Coverage) -> float | str:
    wanted = entry.measure.evidence
    lacking = [one.value for one in Evidence if one in coverage.missing and (wanted is None or one in wanted)]
    if lacking:
        return f"the log does not say {' nor '.join(lacking)}"
    try:
        found = entry.measure.measure(trace, case)
    except NotRecorded as missing:
        return str(missing)
    except Exception as error:  # the boundary to code of others, which can raise anything
        raise BrokenTrace(f"metric {entry.kind}: {type(error).__name__}: {error}{entry.added_by}") from error
    if isinstance(found, str) and found:
        return found
    if isinstance(found, bool) or not isinstance(found, int | float) or not math.isfinite(found):
        raise BrokenTrace(f"metric {entry.kind} is no number: {found!r}{entry.added_by}")
    return float(found)
