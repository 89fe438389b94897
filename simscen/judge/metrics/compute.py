"""What is measured of every run, whether a criterion asks for it or not: the numbers that studies compare."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from simscen.core.case import CLEARANCE_RANGE, Case
from simscen.core.events import EventKind
from simscen.core.evidence import Coverage, Evidence
from simscen.core.geometry import Array
from simscen.core.trace import Trace
from simscen.core.verdict import Status
from simscen.criteria.findings import InvalidTrace, MissingEvidence
from simscen.criteria.goal_outcomes import goal_outcomes
from simscen.criteria.goals_reached import GoalsReached
from simscen.criteria.path_length import shortest_way
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.distances import INTIMATE_SPACE_M, PERSONAL_SPACE_M, SOCIAL_SPACE_M, pedestrian_gap
from simscen.criteria.trace_signals.ground_truth import check_finite, drive, speed, truth, turn_rate
from simscen.criteria.trace_signals.sampling import SignalUnavailable
from simscen.criteria.trace_signals.sparc_ldlj import MOVED_SPEED_M_S, ldlj, sparc
from simscen.judge.metrics.catalog import METRICS
from simscen.judge.metrics.path import Values, path_metrics
from simscen.judge.metrics.pose_error import pose_metrics

STANDING_SPEED_M_S, STANDING_TURN_RATE_RAD_S = 0.01, 0.02
"""m/s and rad/s below which a robot does not move (HuNavSim, which forgot the absolute value of the turn rate)."""

BARN_OPTIMAL_SPEED_M_S = 2.0
"""m/s; BARN's optimal time is the reference way at this speed."""


@dataclass(frozen=True)
class MetricValues:
    """Every metric by name in SI units, None where it is not defined for this run; and why it is not."""

    values: Mapping[str, float | None]
    undefined: Mapping[str, str]


def compute_metrics(trace: Trace, case: Case) -> MetricValues:
    """All metrics of judge.measure.table. Raises InvalidTrace when a signal is not finite."""
    check_finite(trace)
    way = drive(trace)
    found: Values = {
        **_navigation(trace, case, way.length),
        **path_metrics(trace, way),
        **_motion(trace, case),
        **_clearance(trace),
        **person_metrics(trace, case),
        **_contacts(trace),
        "replans": float(sum(plan.data.get("reason", "goal") != "goal" for plan in trace.of_kind(EventKind.PLAN_MADE))),
        "recoveries": float(len(trace.of_kind(EventKind.RECOVERY_STARTED))),
        **pose_metrics(trace),
    }
    ordered = {name: found[name] for name in METRICS}
    return MetricValues(
        {name: None if isinstance(value, str) else value for name, value in ordered.items()},
        {name: value for name, value in ordered.items() if isinstance(value, str)},
    )


def barn_score(success: bool, seconds: float, reference_length: float) -> float:
    """The BARN challenge's score of a run: 0, or 0.125 (8 times the optimal time and slower) … 0.5 (twice and faster).

    Its own code for moving obstacles takes the way as a difference of coordinates, which is negative, so that every
    success scores 0.125. Raises ValueError for a reference that is no length.
    """
    if not reference_length > 0:
        raise ValueError(f"a reference way of {reference_length:g} m")
    optimal = reference_length / BARN_OPTIMAL_SPEED_M_S
    return optimal / min(max(seconds, 2 * optimal), 8 * optimal) if success else 0.0


def _navigation(trace: Trace, case: Case, length: float) -> Values:
    shortest, unknown = shortest_way(trace, case)
    success, seconds = _success(trace, case), _time_to_goal(trace, case)
    found: Values = {"success": float(success), "path_length": length, "time_to_goal": seconds}
    if unknown:
        names = ("barn_score", "shortest_length", "path_length_ratio", "spl", "soft_spl")
        return {**found, **dict.fromkeys(names, unknown)}
    return {
        **found,
        "barn_score": _barn_score(case, success, seconds, shortest),
        "shortest_length": shortest,
        "path_length_ratio": length / shortest,
        "spl": success * shortest / max(shortest, length),
        "soft_spl": _soft_spl(trace, case, shortest, length),
    }


def _success(trace: Trace, case: Case) -> bool:
    findings = GoalsReached().judge(trace, case)
    touched = trace.of_kind(EventKind.COLLISION_STARTED)
    return all(finding.status is Status.PASS for finding in findings) and not touched


def _time_to_goal(trace: Trace, case: Case) -> float | str:
    ends = [outcome.reached for outcome in goal_outcomes(trace, case) if outcome.must_be_reached]
    starts = trace.of_kind(EventKind.GOAL_ACCEPTED)
    if not starts or not ends or ends[-1] is None:
        return "the last goal was not reached"
    return trace.seconds(ends[-1] - starts[0].tick)


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
    left = math.hypot(x - goal.x, y - goal.y)
    return max(0.0, 1 - left / shortest) * shortest / max(shortest, length)


def _motion(trace: Trace, case: Case) -> Values:
    fast, turning = speed(trace), turn_rate(trace)
    if not len(fast):
        none = "the true velocity was not recorded"
        return dict.fromkeys(("max_speed", "time_not_moving", "mean_jerk", "max_jerk", "sparc", "ldlj"), none)
    speeds = fast.values[:, 0]
    standing = (speeds < STANDING_SPEED_M_S) & (turning.values[:, 0] < STANDING_TURN_RATE_RAD_S)
    lasts = np.diff(np.append(fast.ticks, trace.end)) / trace.tick_rate
    return {
        "max_speed": float(speeds.max()),
        "time_not_moving": float(lasts[standing].sum()),
        **_jerk(trace, case),
        **_smoothness(trace, speeds),
    }


def _jerk(trace: Trace, case: Case) -> Values:
    try:
        jerk = read_signal("jerk", trace, case, {})
    except SignalUnavailable as why:
        return {"mean_jerk": str(why), "max_jerk": str(why)}
    return {"mean_jerk": float(jerk.mean()), "max_jerk": float(jerk.max())}


def _smoothness(trace: Trace, speeds: Array) -> Values:
    if speeds.max() < MOVED_SPEED_M_S:
        return dict.fromkeys(("sparc", "ldlj"), "the robot never moved")
    if len(speeds) < 2:
        return dict.fromkeys(("sparc", "ldlj"), "the run is too short")
    rate = trace.tick_rate / float(trace.velocity.ticks[1] - trace.velocity.ticks[0])
    spectral, jerky = sparc(speeds, rate), ldlj(speeds, rate)
    return {
        "sparc": "the run is too short" if spectral is None else spectral,
        "ldlj": "the speed never changed" if jerky is None else jerky,
    }


def _clearance(trace: Trace) -> Values:
    near = np.minimum(trace.clearance.values[:, 0], CLEARANCE_RANGE)
    if not len(near):
        return {"min_clearance": "it was not recorded", "mean_clearance": "it was not recorded"}
    return {"min_clearance": float(near.min()), "mean_clearance": float(near.mean())}


def _contacts(trace: Trace) -> Values:
    """Rising edges, and the time during which at least one contact lasts."""
    events = trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED)
    steps = [1 if event.kind == EventKind.COLLISION_STARTED else -1 for event in events]
    # The end of a contact that began before the log did is not one of those that are known.
    touching = np.array(list(accumulate(steps, lambda number, step: max(number, 0) + step)))
    lasts = np.diff([*(event.tick for event in events), trace.end])
    return {"collisions": float(steps.count(1)), "contact_time": trace.seconds(int(lasts[touching > 0].sum()))}


# MERGED: How near people the robot was, for how long.
ZONES = {
    "intimate": (0.0, INTIMATE_SPACE_M),
    "personal": (INTIMATE_SPACE_M, PERSONAL_SPACE_M),
    "social": (PERSONAL_SPACE_M, SOCIAL_SPACE_M),
}
"""Metres from and to."""


def person_metrics(trace: Trace, case: Case) -> Values:
    """The least gap, and the shares of the run in Hall's zones; each sample lasts until the next."""
    names = ("min_person_distance", *(f"intrusion_{zone}" for zone in ZONES))
    try:
        gaps = pedestrian_gap(trace, case)
    except SignalUnavailable as why:
        return dict.fromkeys(names, str(why))
    lasts = np.diff(np.append(trace.truth.ticks, trace.end))
    whole = max(int(lasts.sum()), 1)
    shares = [float(lasts[(low <= gaps) & (gaps < high)].sum()) / whole for low, high in ZONES.values()]
    nearest = float(gaps.min())
    least: float | str = nearest if np.isfinite(nearest) else "nobody was there at a sample of the truth"
    return dict(zip(names, (least, *shares), strict=True))


# MERGED: The metrics that installed packages add, measured beside the others.
def add_plugin_metrics(
    measures: MetricValues, metrics: Sequence[AnyMeasure], trace: Trace, case: Case, coverage: Coverage
) -> MetricValues:
    """The same with the metrics that a scenario asks for. Raises InvalidTrace for one that is no number.

    A number that its author did not mean is worse than none: studies compare it.
    """
    values, undefined = dict(measures.values), dict(measures.undefined)
    for entry in metrics:
        found = _measured(entry, trace, case, coverage)
        values[entry.kind] = None if isinstance(found, str) else found
        if isinstance(found, str):
            undefined[entry.kind] = found
    return MetricValues(values, undefined)


def _measured(entry: AnyMeasure, trace: Trace, case: Case, coverage: Coverage) -> float | str:
    wanted = entry.measure.evidence
    lacking = [one.value for one in Evidence if one in coverage.missing and (wanted is None or one in wanted)]
    if lacking:
        return f"the log does not say {' nor '.join(lacking)}"
    try:
        found = entry.measure.measure(trace, case)
    except MissingEvidence as missing:
        return str(missing)
    except Exception as error:  # the boundary to code of others, which can raise anything
        raise InvalidTrace(f"metric {entry.kind}: {type(error).__name__}: {error}{entry.added_by}") from error
    if isinstance(found, str) and found:
        return found
    if isinstance(found, bool) or not isinstance(found, int | float) or not math.isfinite(found):
        raise InvalidTrace(f"metric {entry.kind} is no number: {found!r}{entry.added_by}")
    return float(found)
