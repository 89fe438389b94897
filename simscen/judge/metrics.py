"""What is measured of every run, whether a criterion asks for it or not: the numbers that studies compare."""

import math

import numpy as np

from simscen.core.case import CLEARANCE_RANGE, Case
from simscen.core.events import EventKind
from simscen.core.geometry import Array, wrap_array
from simscen.core.trace import Trace
from simscen.core.verdict import Status
from simscen.criteria.goals_reached import GoalsReached
from simscen.criteria.moments import stories
from simscen.criteria.path_length import shortest_way
from simscen.criteria.signals import check_finite, drive, finite, pose_error, speed, truth, turn_rate

STANDING_SPEED, STANDING_TURN = 0.01, 0.02
"""m/s and rad/s below which a robot does not move (HuNavSim, which forgot the absolute value of the turn rate)."""

Metrics = dict[str, float | None]


def measure(trace: Trace, case: Case) -> Metrics:
    """All metrics by name, in SI units; None where a run has none. Raises BrokenTrace when a signal is not finite.

    success: every goal truly reached (0 or 1) · spl, soft_spl: Anderson et al. 2018, Habitat · path_length,
    shortest_length: m · path_ratio · time_to_goal: s · heading_change: rad · clearance_min, clearance_mean: m, where
    more than 2 m count as 2 m, however far was searched ·
    speed_max: m/s · time_standing: s · collisions, contact_time: s · replans, recoveries ·
    localization_{rmse,mean,max,final}: m, localization_yaw_rmse: rad · nees: mean over the run, 3 when consistent.
    """
    check_finite(trace)
    return {
        **_navigation(trace, case),
        **_motion(trace),
        **_contacts(trace),
        **_localization(trace),
        "replans": float(sum(plan.data.get("reason", "goal") != "goal" for plan in trace.of_kind(EventKind.PLAN_MADE))),
        "recoveries": float(len(trace.of_kind(EventKind.RECOVERY_STARTED))),
    }


def _navigation(trace: Trace, case: Case) -> Metrics:
    length = drive(trace).length
    shortest, unknown = shortest_way(trace, case)
    known = not unknown
    success = _success(trace, case)
    ends = [story.reached for story in stories(trace, case) if not story.preempted]
    starts = trace.of_kind(EventKind.GOAL_ACCEPTED)
    arrived = starts and ends and ends[-1] is not None
    return {
        "success": float(success),
        "path_length": length,
        "shortest_length": shortest if known else None,
        "path_ratio": length / shortest if known else None,
        "spl": success * shortest / max(shortest, length) if known else None,
        "soft_spl": _soft_spl(trace, case, shortest, length) if known else None,
        "time_to_goal": trace.seconds((ends[-1] or 0) - starts[0].tick) if arrived else None,
    }


def _success(trace: Trace, case: Case) -> bool:
    findings = GoalsReached().judge(trace, case)
    return all(finding.status is Status.PASS for finding in findings)


def _soft_spl(trace: Trace, case: Case, shortest: float, length: float) -> float | None:
    poses = truth(trace)
    if not len(poses):
        return None
    goal = case.goals[-1].pose
    x, y, _ = poses.values[-1]
    left = math.hypot(x - goal.x, y - goal.y)
    return max(0.0, 1 - left / shortest) * shortest / max(shortest, length)


def _motion(trace: Trace) -> Metrics:
    poses, fast, turning = truth(trace), speed(trace), turn_rate(trace)
    near = np.minimum(trace.clearance.values[:, 0], CLEARANCE_RANGE)
    standing = (fast.values[:, 0] < STANDING_SPEED) & (turning.values[:, 0] < STANDING_TURN)
    lasts = np.diff(np.append(fast.ticks, trace.end)) / trace.tick_rate
    return {
        "heading_change": float(np.abs(wrap_array(np.diff(poses.values[:, 2]))).sum()),
        "clearance_min": float(near.min()) if len(near) else None,
        "clearance_mean": float(near.mean()) if len(near) else None,
        "speed_max": float(fast.values.max()) if len(fast) else None,
        "time_standing": float(lasts[standing].sum()),
    }


def _contacts(trace: Trace) -> Metrics:
    """Rising edges, and the time during which at least one contact lasts."""
    touching, since, total = 0, 0, 0
    for event in trace.of_kind(EventKind.COLLISION_STARTED, EventKind.COLLISION_ENDED):
        if event.kind == EventKind.COLLISION_STARTED:
            since = event.tick if touching == 0 else since
            touching += 1
        elif touching:
            touching -= 1
            total += event.tick - since if touching == 0 else 0
    total += trace.end - since if touching else 0
    return {"collisions": float(len(trace.of_kind(EventKind.COLLISION_STARTED))), "contact_time": trace.seconds(total)}


def _localization(trace: Trace) -> Metrics:
    error = pose_error(trace)
    names = ("rmse", "mean", "max", "final")
    if not len(error):
        return {**{f"localization_{name}": None for name in names}, "localization_yaw_rmse": None, "nees": None}
    off, turned = error.values.T
    values = (_rms(off), float(off.mean()), float(off.max()), float(off[-1]))
    return {
        **{f"localization_{name}": value for name, value in zip(names, values, strict=True)},
        "localization_yaw_rmse": _rms(turned),
        "nees": _nees(trace),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _nees(trace: Trace) -> float | None:
    """Normalised estimation error squared, e' P^-1 e, averaged over the run; None when a covariance is singular."""
    belief, poses = finite(trace.belief, "the belief", trace), truth(trace)
    if belief.values.shape[1] < 9:
        return None
    xx, xy, xa, yy, ya, aa = belief.values[:, 3:9].T
    covariance = np.stack((np.stack((xx, xy, xa)), np.stack((xy, yy, ya)), np.stack((xa, ya, aa)))).transpose(2, 0, 1)
    if (np.linalg.eigvalsh(covariance)[:, 0] <= 0).any():
        return None
    x, y = (np.interp(belief.ticks, poses.ticks, poses.values[:, axis]) for axis in (0, 1))
    yaw = np.interp(belief.ticks, poses.ticks, np.unwrap(poses.values[:, 2]))
    error = np.column_stack((belief.values[:, 0] - x, belief.values[:, 1] - y, wrap_array(belief.values[:, 2] - yaw)))
    weighted = np.linalg.solve(covariance, error[:, :, np.newaxis])[:, :, 0]
    return float(np.mean(np.sum(error * weighted, axis=1)))
