"""Readers of signals of the motion, the belief, and the goals of the robot.

A reader is a function that computes the values (n,) of a signal at the n samples of the truth.

The value of a yes-or-no signal is 0 or 1. Readers raise MissingEvidence if the trace lacks the data of the signal,
and InvalidTrace if the data are not finite.

A belief is an estimated pose with its covariance. Signals of the belief are nan (unknown) until BELIEF_TIMEOUT_S before
the first belief. During this last period, they already have the value of the first belief.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Samples, Ticks
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.estimation_errors import BELIEF_TIMEOUT_S, nees_samples, pose_error
from simscen.criteria.trace_signals.ground_truth import check_samples, drive, speed, teleport_samples, truth
from simscen.criteria.trace_signals.ground_truth import clearance as hull_clearance
from simscen.criteria.trace_signals.ground_truth import turn_rate as unsigned_turn_rate
from simscen.criteria.trace_signals.sampling import SignalQuery, evenly_spaced, sample_and_hold, sample_ticks

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

LOCALIZED_STD_M = 0.5
"""Maximum standard deviation of the estimated position of a localized robot."""


def clearance(query: SignalQuery) -> Array:
    """Return the true distance in m from the robot to the nearest surface, at most the measuring range of the case."""
    return sample_and_hold(query.trace, hull_clearance(query.trace), "clearance")[:, 0]


def ground_speed(query: SignalQuery) -> Array:
    """Return the true speed over ground in m/s."""
    return sample_and_hold(query.trace, speed(query.trace), "velocity")[:, 0]


def forward_speed(query: SignalQuery) -> Array:
    """Return the true speed along the robot's x axis in m/s."""
    return _velocity(query.trace)[:, 0]


def turn_rate(query: SignalQuery) -> Array:
    """Return the magnitude of the true turn rate in rad/s."""
    return sample_and_hold(query.trace, unsigned_turn_rate(query.trace), "velocity")[:, 0]


def yaw_rate(query: SignalQuery) -> Array:
    """Return the true turn rate in rad/s, positive to the left."""
    return _velocity(query.trace)[:, 2]


def acceleration(query: SignalQuery) -> Array:
    """Return the change of the speed over ground since the previous sample, per time, in m/s²."""
    return _finite_difference(query.trace, ground_speed(query), 1)


def angular_acceleration(query: SignalQuery) -> Array:
    """Return the change of the yaw rate since the previous sample, per time, in rad/s²."""
    return _finite_difference(query.trace, yaw_rate(query), 1)


def jerk(query: SignalQuery) -> Array:
    """Return the magnitude of the jerk in m/s³: |v[k+1] - 2 v[k] + v[k-1]| / dt² of the speed over ground v."""
    return np.abs(_finite_difference(query.trace, ground_speed(query), 2))


def localization_error(query: SignalQuery) -> Array:
    """Return the distance in m between the estimated and the true position."""
    return sample_and_hold_belief(query.trace, pose_error(query.trace), "belief")[:, 0]


def localization_yaw_error(query: SignalQuery) -> Array:
    """Return the angle in rad between the estimated and the true heading."""
    return sample_and_hold_belief(query.trace, pose_error(query.trace), "belief")[:, 1]


def position_std(query: SignalQuery) -> Array:
    """Return the standard deviation in m of the estimated position in the direction with the largest variance."""
    xx, xy, _, yy, _, _ = _covariance(query.trace).T
    spread = np.hypot((xx - yy) / 2, xy)
    std: Array = np.sqrt(np.maximum((xx + yy) / 2 + spread, 0.0))
    return std


def yaw_std(query: SignalQuery) -> Array:
    """Return the standard deviation in rad of the estimated heading."""
    return np.sqrt(np.maximum(_covariance(query.trace)[:, 5], 0.0))


def nees(query: SignalQuery) -> Array:
    """Return the NEES (normalized estimation error squared) of the newest belief; inf if the covariance is singular."""
    return sample_and_hold_belief(query.trace, nees_samples(query.trace), "covariance")[:, 0]


def belief_age(query: SignalQuery) -> Array:
    """Return the time in s since the newest belief was published; before the first one, since the start."""
    return _age(query.trace, query.trace.belief.ticks)


def scan_age(query: SignalQuery) -> Array:
    """Return the time in s since the stack received the newest scan; before the first one, since the start."""
    return _age(query.trace, query.trace.scans)


def localized(query: SignalQuery) -> Array:
    """Return whether the newest belief is at most BELIEF_TIMEOUT_S old and its position_std at most LOCALIZED_STD_M."""
    if not len(query.trace.belief):
        return np.zeros(len(sample_ticks(query.trace)))
    has_belief = sample_ticks(query.trace) >= query.trace.belief.ticks[0]
    is_fresh = belief_age(query) <= BELIEF_TIMEOUT_S
    return np.where(has_belief & is_fresh & (position_std(query) <= LOCALIZED_STD_M), 1.0, 0.0)


def goal_distance(query: SignalQuery) -> Array:
    """Return the true distance in m to the goal accepted last; before the first acceptance, to this first goal."""
    goals, poses = _current_goals(query.trace, query.case), true_poses(query.trace)
    return np.hypot(poses[:, 0] - goals[:, 0], poses[:, 1] - goals[:, 1])


def goal_heading_error(query: SignalQuery) -> Array:
    """Return the angle in rad between the true heading and the heading of the goal of `goal_distance`."""
    return np.abs(wrap_array(true_poses(query.trace)[:, 2] - _current_goals(query.trace, query.case)[:, 2]))


def travelled(query: SignalQuery) -> Array:
    """Return the distance in m driven so far."""
    path, clock = drive(query.trace), sample_ticks(query.trace)
    return path.travelled[np.searchsorted(path.ticks, clock, side="right") - 1]


def time(query: SignalQuery) -> Array:
    """Return the simulated time in s."""
    return sample_ticks(query.trace) / query.trace.tick_rate


def command_speed(query: SignalQuery) -> Array:
    """Return the commanded speed in m/s; 0 before the first command."""
    command = _newest_command(query.trace)
    return np.hypot(command[:, 0], command[:, 1])


def command_turn_rate(query: SignalQuery) -> Array:
    """Return the magnitude of the commanded turn rate in rad/s; 0 before the first command."""
    return np.abs(_newest_command(query.trace)[:, 2])


def in_region(query: SignalQuery) -> Array:
    """Return whether the robot's true position is in the region of the query."""
    name = str(query.arguments["region"])
    if name not in query.case.regions:
        raise MissingEvidence(f"the world has no region `{name}`")
    inside = points_in_polygon(query.case.regions[name], true_poses(query.trace)[:, :2])
    return np.where(inside, 1.0, 0.0)


def true_poses(trace: Trace) -> Array:
    """Return the true poses (n, 3) of the robot in the world frame: x and y in m, yaw in rad."""
    sample_ticks(trace)
    return truth(trace).values


def _velocity(trace: Trace) -> Array:
    """Return the true velocity (n, 3) in the base frame: vx, vy (m/s) and wz (rad/s)."""
    return sample_and_hold(trace, check_samples(trace.velocity, "the true velocity", trace), "velocity")


def _covariance(trace: Trace) -> Array:
    """Return the upper triangle (n, 6) of the covariance of the newest belief: xx, xy, xyaw, yy, yyaw, yawyaw."""
    belief = check_samples(trace.belief, "the belief", trace)
    if not len(belief) or belief.values.shape[1] < 9:
        raise MissingEvidence("no covariance of the belief was recorded")
    return sample_and_hold_belief(trace, belief, "belief")[:, 3:]


def sample_and_hold_belief(trace: Trace, samples: Samples, what: str) -> Array:
    """Return the newest values (n, k) of `samples`, whose first sample is at the first belief; nan where unknown.

    Raises MissingEvidence if `samples` are empty; `what` is the name of the data in the message.
    """
    values = sample_and_hold(trace, samples, what)
    is_known = sample_ticks(trace) >= samples.ticks[0] - BELIEF_TIMEOUT_S * trace.tick_rate
    known_values: Array = np.where(is_known[:, np.newaxis], values, np.nan)
    return known_values


def _newest_command(trace: Trace) -> Array:
    """Return the newest command (n, 3): vx, vy (m/s) and wz (rad/s); zeros before the first command."""
    clock, command = sample_ticks(trace), check_samples(trace.command, "the command", trace)
    if not len(command):
        raise MissingEvidence("no command was recorded")
    return np.where((clock >= command.ticks[0])[:, np.newaxis], command.at(clock), 0.0)


def _finite_difference(trace: Trace, values: Array, order: int) -> Array:
    """Return the first or second time derivative (n,) of `values` (n,), computed by finite differences.

    `order` is 1 or 2. Unevenly spaced values are resampled. Teleportation does not count as a change.
    """
    ticks = sample_ticks(trace)
    even = evenly_spaced(Samples(ticks, values[:, np.newaxis]), trace.tick_rate)
    if len(even) <= order:
        raise MissingEvidence(f"the run is too short: {len(even)} samples of the truth")
    step = float(even.ticks[1] - even.ticks[0]) / trace.tick_rate
    first = np.diff(even.values[:, 0]) / step
    jumps = [k - 1 for k in teleport_samples(trace, even.ticks) if 0 < k < len(even)]
    first[jumps] = 0.0
    if order == 1:
        found = np.concatenate((first[:1], first))
    else:
        second = np.diff(first) / step
        for jump in jumps:
            second[max(jump - 1, 0) : jump + 1] = 0.0
        found = np.concatenate((second[:1], second, second[-1:]))
    return Samples(even.ticks, found[:, np.newaxis]).at(ticks)[:, 0]


def _age(trace: Trace, received: Ticks) -> Array:
    """Return the time in s since the newest of the ticks `received`; before the first one, since the start."""
    clock = sample_ticks(trace)
    if not len(received):
        return clock / trace.tick_rate
    at = np.searchsorted(received, clock, side="right") - 1
    newest = np.where(at >= 0, received[np.maximum(at, 0)], 0)
    return (clock - newest) / trace.tick_rate


def _current_goals(trace: Trace, case: Case) -> Array:
    """Return x, y, yaw (n, 3) of the goal accepted last; before the first acceptance, of the goal accepted first.

    If no goal was accepted, return x, y, yaw (1, 3) of the scenario's first goal.
    """
    clock = sample_ticks(trace)
    pose_by_name = {goal.name: goal.pose for goal in reversed(case.every_goal)}
    ticks, poses = [], []
    for event in trace.of_kind(EventKind.GOAL_ACCEPTED):
        pose = tuple(event.data.get(key) for key in ("x", "y", "yaw"))
        has_pose = all(isinstance(coordinate, int | float) for coordinate in pose)
        if has_pose or event.name in pose_by_name:
            ticks.append(event.tick)
            poses.append(pose if has_pose else pose_by_name[event.name])
    if not poses and not case.goals:
        raise MissingEvidence("there was no goal")
    if not poses:
        return np.array([case.goals[0].pose], dtype=np.float64)
    accepted = Samples(np.array(ticks, dtype=np.int64), np.array(poses, dtype=np.float64))
    return check_samples(accepted, "the pose of the goal", trace).at(clock)
