"""Computation of the metrics of a run: all metrics of the catalog, and the plug-in metrics that a scenario requests."""

import math
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cache
from itertools import accumulate

import numpy as np

from simscen.core.errors import exception_place
from simscen.core.geometry import Array
from simscen.core.records.case import CLEARANCE_RANGE_M, Case
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, Evidence, LogCoverage, Status
from simscen.criteria.base import AnyMeasure
from simscen.criteria.efficiency import shortest_path_length
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.goal_outcomes import first_acceptance, goal_outcomes
from simscen.criteria.goals_reached import GoalsReached
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.distances import INTIMATE_SPACE_M, PERSONAL_SPACE_M, SOCIAL_SPACE_M, pedestrian_gap
from simscen.criteria.trace_signals.event_readers import replans
from simscen.criteria.trace_signals.ground_truth import clearance, drive, speed, truth, turn_rate
from simscen.criteria.trace_signals.sparc_ldlj import MIN_MOVING_SPEED_M_S, evenly_sampled_speed, ldlj, sparc
from simscen.judge.evaluation import missing_evidence_reason, partial_evidence_reason
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.trajectory import PATH_METRICS, POSE_METRICS, Values, path_metrics, pose_metrics

MAX_STANDING_SPEED_M_S, MAX_STANDING_TURN_RATE_RAD_S = 0.01, 0.02
"""Speed and absolute turn rate below which a robot stands still."""

BARN_OPTIMAL_SPEED_M_S = 2.0
"""Mean speed from which the optimal time of the BARN score is computed."""

PERSON_SPACES = {
    "intimate": (0.0, INTIMATE_SPACE_M),
    "personal": (INTIMATE_SPACE_M, PERSONAL_SPACE_M),
    "social": (PERSONAL_SPACE_M, SOCIAL_SPACE_M),
}
"""Hall's spaces around a person: (smallest distance in m, distance in m at which the space ends)."""

NO_GOALS = "the robot has no goals"
"""Reason why the metric `success` is undefined for a robot without goals."""

_SHORTEST_PATH_METRICS = ("barn_score", "shortest_length", "path_length_ratio", "spl", "soft_spl")
_NAVIGATION_METRICS = ("success", "path_length", "time_to_goal", *_SHORTEST_PATH_METRICS)
_SMOOTHNESS_METRICS = ("sparc", "ldlj")
_MOTION_METRICS = ("max_speed", "time_not_moving", "mean_jerk", "max_jerk", *_SMOOTHNESS_METRICS)
_CLEARANCE_METRICS = ("min_clearance", "mean_clearance")
_PEOPLE_METRICS = ("min_person_distance", *(f"intrusion_{space}" for space in PERSON_SPACES))
_EVENT_METRICS = ("collisions", "contact_time", "replans", "recoveries")
"""Groups of metrics. The metrics of a group are computed together."""


@dataclass(frozen=True)
class MetricValues:
    """Values of metrics in SI units, and reasons for undefined metrics (value None), both by name."""

    values: Mapping[str, float | None]
    undefined: Mapping[str, str]


def compute_metrics(trace: Trace, case: Case, coverage: LogCoverage = COMPLETE_COVERAGE) -> MetricValues:
    """Return all metrics of the catalog.

    A metric is undefined if the log lacks the evidence for a part of the run, if one of its signals is not finite, or
    if the metric does not apply to the run.
    """
    path = cache(lambda: drive(trace))
    groups: tuple[tuple[tuple[str, ...], Callable[[], Values]], ...] = (
        (_NAVIGATION_METRICS, lambda: _navigation_metrics(trace, case, path().length)),
        (PATH_METRICS, lambda: path_metrics(trace, path())),
        (_MOTION_METRICS, lambda: _motion_metrics(trace, case)),
        (_CLEARANCE_METRICS, lambda: _clearance_metrics(trace)),
        (_PEOPLE_METRICS, lambda: person_metrics(trace, case)),
        (_EVENT_METRICS, lambda: _event_metrics(trace)),
        (POSE_METRICS, lambda: pose_metrics(trace)),
    )
    computed: Values = {}
    for names, compute in groups:
        computed |= _compute_or_explain(names, compute)
    for name, metric in METRICS.items():
        if reason := _insufficient_evidence(metric.evidence, coverage):
            computed[name] = reason
    return _metric_values({name: computed[name] for name in METRICS})


def _metric_values(computed: Values) -> MetricValues:
    """Separate the numbers from the reasons for undefined metrics."""
    values = {name: None if isinstance(value, str) else value for name, value in computed.items()}
    return MetricValues(values, {name: value for name, value in computed.items() if isinstance(value, str)})


def _compute_or_explain(names: Sequence[str], compute: Callable[[], Values]) -> Values:
    """Return the metrics from `compute`; if it raises InvalidTrace or MissingEvidence, this reason for all `names`."""
    try:
        return compute()
    except (InvalidTrace, MissingEvidence) as reason:
        return dict.fromkeys(names, str(reason))


def _insufficient_evidence(required: Set[Evidence], coverage: LogCoverage) -> str:
    """Return as text which evidence is missing for the run or for a part of the run; "" if nothing is missing."""
    return missing_evidence_reason(required, coverage) or partial_evidence_reason(required, coverage)


def barn_score(success: bool, seconds: float, reference_length: float) -> float:
    """Return the BARN score: optimal time / time, limited to the range from 1/8 to 1/2; 0 without success.

    The optimal time is `reference_length` in m / BARN_OPTIMAL_SPEED_M_S. Raises ValueError if the length is not
    positive.
    """
    if not reference_length > 0:
        raise ValueError(f"the length of the reference path must be positive, but is {reference_length:g} m")
    optimal = reference_length / BARN_OPTIMAL_SPEED_M_S
    return optimal / min(max(seconds, 2 * optimal), 8 * optimal) if success else 0.0


def _navigation_metrics(trace: Trace, case: Case, length: float) -> Values:
    shortest, unknown_reason = shortest_path_length(trace, case)
    success, seconds = _success(trace, case), _time_to_goal(trace, case)
    metrics: Values = {
        "success": float(success) if goal_outcomes(trace, case) else NO_GOALS,
        "path_length": length,
        "time_to_goal": seconds,
    }
    if unknown_reason:
        return {**metrics, **dict.fromkeys(_SHORTEST_PATH_METRICS, unknown_reason)}
    return {
        **metrics,
        "barn_score": _barn_score(case, success, seconds, shortest),
        "shortest_length": shortest,
        "path_length_ratio": length / shortest,
        "spl": success * shortest / max(shortest, length),
        "soft_spl": _soft_spl(trace, case, shortest, length),
    }


def _success(trace: Trace, case: Case) -> bool:
    """Return whether the robot truly reached all goals and touched nothing."""
    findings = GoalsReached().judge(trace, case)
    touched = trace.of_kind(EventKind.COLLISION_STARTED)
    return all(finding.status is Status.PASS for finding in findings) and not touched


def _time_to_goal(trace: Trace, case: Case) -> float | str:
    outcomes = goal_outcomes(trace, case)
    ends = [outcome.reached_tick for outcome in outcomes if outcome.must_be_reached]
    if not ends or ends[-1] is None:
        return "the last goal was not reached"
    start = first_acceptance(outcomes)
    return "the acceptance of the first goal was not recorded" if start is None else trace.seconds(ends[-1] - start)


def _barn_score(case: Case, success: bool, seconds: float | str, shortest: float) -> float | str:
    if len(case.goals) != 1:
        return "only runs with one goal have a score"
    return barn_score(success, seconds, shortest) if isinstance(seconds, float) else 0.0


def _soft_spl(trace: Trace, case: Case, shortest: float, length: float) -> float | str:
    poses = truth(trace)
    if not len(poses):
        return "the true pose was not recorded"
    goal = case.goals[-1].pose
    x, y, _ = poses.values[-1]
    remaining = math.hypot(x - goal.x, y - goal.y)
    return max(0.0, 1 - remaining / shortest) * shortest / max(shortest, length)


def _motion_metrics(trace: Trace, case: Case) -> Values:
    linear, turning = speed(trace), turn_rate(trace)
    if not len(linear):
        return dict.fromkeys(_MOTION_METRICS, "the true velocity was not recorded")
    speeds = linear.values[:, 0]
    is_standing = (speeds < MAX_STANDING_SPEED_M_S) & (turning.values[:, 0] < MAX_STANDING_TURN_RATE_RAD_S)
    durations = np.diff(np.append(linear.ticks, trace.end)) / trace.tick_rate
    return {
        "max_speed": float(speeds.max()),
        "time_not_moving": float(durations[is_standing].sum()),
        **_compute_or_explain(("mean_jerk", "max_jerk"), lambda: _jerk_metrics(trace, case)),
        **_compute_or_explain(_SMOOTHNESS_METRICS, lambda: _smoothness_metrics(trace, speeds)),
    }


def _jerk_metrics(trace: Trace, case: Case) -> Values:
    jerk = read_signal("jerk", trace, case, {})
    return {"mean_jerk": float(jerk.mean()), "max_jerk": float(jerk.max())}


def _smoothness_metrics(trace: Trace, speeds: Array) -> Values:
    if speeds.max() < MIN_MOVING_SPEED_M_S:
        return dict.fromkeys(_SMOOTHNESS_METRICS, "the robot never moved")
    even_speeds, rate = evenly_sampled_speed(trace)
    spectral, jerk = sparc(even_speeds, rate), ldlj(even_speeds, rate)
    return {
        "sparc": "the run is too short" if spectral is None else spectral,
        "ldlj": "the speed never changed" if jerk is None else jerk,
    }


def _clearance_metrics(trace: Trace) -> Values:
    distances = np.minimum(clearance(trace).values[:, 0], CLEARANCE_RANGE_M)
    if not len(distances):
        return dict.fromkeys(_CLEARANCE_METRICS, "the clearance was not recorded")
    return {"min_clearance": float(distances.min()), "mean_clearance": float(distances.mean())}


def _event_metrics(trace: Trace) -> Values:
    """Return the counts of events, and the time with at least one contact."""
    events = trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED)
    steps = [1 if event.kind == EventKind.COLLISION_STARTED else -1 for event in events]
    # The end of a contact that began before the log must not cancel another one.
    contact_counts = np.array(list(accumulate(steps, lambda number, step: max(number, 0) + step)))
    durations = np.diff([*(event.tick for event in events), trace.end])
    return {
        "collisions": float(steps.count(1)),
        "contact_time": trace.seconds(int(durations[contact_counts > 0].sum())),
        "replans": _replan_count(trace),
        "recoveries": float(len(trace.of_kind(EventKind.RECOVERY_STARTED))),
    }


def _replan_count(trace: Trace) -> float | str:
    try:
        return float(len(replans(trace)))
    except MissingEvidence as reason:
        return str(reason)


def person_metrics(trace: Trace, case: Case) -> Values:
    """Return the smallest gap to a pedestrian in m, and the share of the run in each of the PERSON_SPACES."""
    gaps = pedestrian_gap(trace, case)
    durations = np.diff(np.append(trace.truth.ticks, trace.end))
    total = max(int(durations.sum()), 1)
    shares = [float(durations[(low <= gaps) & (gaps < high)].sum()) / total for low, high in PERSON_SPACES.values()]
    smallest = float(gaps.min())
    min_gap: float | str = (
        smallest if math.isfinite(smallest) else "no pedestrian was present at any sample of the truth"
    )
    return dict(zip(_PEOPLE_METRICS, (min_gap, *shares), strict=True))


def add_plugin_metrics(
    computed: MetricValues, metrics: Sequence[AnyMeasure], trace: Trace, case: Case, coverage: LogCoverage
) -> MetricValues:
    """Return the `computed` metrics and the plug-in metrics that a scenario requests.

    Raises InvalidTrace if a plug-in metric raises an exception or is not finite.
    """
    added = _metric_values({entry.kind: _value(entry, trace, case, coverage) for entry in metrics})
    return MetricValues({**computed.values, **added.values}, {**computed.undefined, **added.undefined})


def _value(entry: AnyMeasure, trace: Trace, case: Case, coverage: LogCoverage) -> float | str:
    """Return the value of a plug-in metric, or the reason why it is undefined. Raises InvalidTrace."""
    required = entry.measure.evidence
    if reason := _insufficient_evidence(frozenset(Evidence) if required is None else required, coverage):
        return reason
    try:
        value = entry.measure.measure(trace, case)
    except MissingEvidence as missing:
        return str(missing)
    except Exception as error:  # a plug-in can raise anything
        place = exception_place(error, type(entry.measure).__module__)
        message = f"metric {entry.kind}: {type(error).__name__}: {error}, at {place}{entry.plugin_suffix}"
        raise InvalidTrace(message) from error
    if isinstance(value, str) and value:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InvalidTrace(f"metric {entry.kind} is not a finite number: {value!r}{entry.plugin_suffix}")
    return float(value)
