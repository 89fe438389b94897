"""What is measured of every run, whether a criterion asks for it or not: the numbers that studies compare."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from simscen.core.case import CLEARANCE_RANGE, Case
from simscen.core.events import EventKind
from simscen.core.geometry import Array
from simscen.core.trace import Trace
from simscen.core.verdict import Status
from simscen.criteria.goals_reached import GoalsReached
from simscen.criteria.moments import stories
from simscen.criteria.path_length import shortest_way
from simscen.criteria.signal_table import read
from simscen.criteria.signal_values import Unavailable
from simscen.criteria.signals import check_finite, drive, speed, truth, turn_rate
from simscen.criteria.smooth import STILL, ldlj, sparc
from simscen.judge.measure.people import person_metrics
from simscen.judge.measure.pose import pose_metrics
from simscen.judge.measure.table import METRICS
from simscen.judge.measure.way import Values, way_metrics

STANDING_SPEED, STANDING_TURN = 0.01, 0.02
"""m/s and rad/s below which a robot does not move (HuNavSim, which forgot the absolute value of the turn rate)."""

OPTIMAL_SPEED = 2.0
"""m/s; BARN's optimal time is the reference way at this speed."""


@dataclass(frozen=True)
class Measures:
    """Every metric by name in SI units, None where it is not defined for this run; and why it is not."""

    values: Mapping[str, float | None]
    undefined: Mapping[str, str]


def measure(trace: Trace, case: Case) -> Measures:
    """All metrics of judge.measure.table. Raises BrokenTrace when a signal is not finite."""
    check_finite(trace)
    way = drive(trace)
    found: Values = {
        **_navigation(trace, case, way.length),
        **way_metrics(trace, way),
        **_motion(trace, case),
        **_clearance(trace),
        **person_metrics(trace, case),
        **_contacts(trace),
        "replans": float(sum(plan.data.get("reason", "goal") != "goal" for plan in trace.of_kind(EventKind.PLAN_MADE))),
        "recoveries": float(len(trace.of_kind(EventKind.RECOVERY_STARTED))),
        **pose_metrics(trace),
    }
    ordered = {name: found[name] for name in METRICS}
    return Measures(
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
    optimal = reference_length / OPTIMAL_SPEED
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
    ends = [story.reached for story in stories(trace, case) if story.awaited]
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
    standing = (speeds < STANDING_SPEED) & (turning.values[:, 0] < STANDING_TURN)
    lasts = np.diff(np.append(fast.ticks, trace.end)) / trace.tick_rate
    return {
        "max_speed": float(speeds.max()),
        "time_not_moving": float(lasts[standing].sum()),
        **_jerk(trace, case),
        **_smoothness(trace, speeds),
    }


def _jerk(trace: Trace, case: Case) -> Values:
    try:
        jerk = read("jerk", trace, case, {})
    except Unavailable as why:
        return {"mean_jerk": str(why), "max_jerk": str(why)}
    return {"mean_jerk": float(jerk.mean()), "max_jerk": float(jerk.max())}


def _smoothness(trace: Trace, speeds: Array) -> Values:
    if speeds.max() < STILL:
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
