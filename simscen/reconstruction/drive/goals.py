"""Finds the goals of a drive in a log, and cuts off the time before the first goal.

Goals are read from goal messages. Without goal messages, goals are the ends of plans. Without plans, goals are the
stops and bends of the driven path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.polylines import path_corners
from simscen.core.records.events import Event, EventKind
from simscen.reconstruction.drive.log_messages import LogMessages
from simscen.reconstruction.drive.recorded_drive import RecordedDrive, RecordedGoal, TimedValues
from simscen.reconstruction.reasons import find_windows
from simscen.record.foreign.goal_events import goal_events
from simscen.record.messages import event_text
from simscen.record.messages.decode import StampedPose

MAX_SAME_GOAL_DISTANCE_M = 0.05
"""Maximum distance between the ends of two successive plans to the same goal."""
MAX_STOPPED_SPEED_M_S, MAX_STOPPED_TURN_RATE_RAD_S = 0.03, 0.05
"""Speed and turn rate below which the robot counts as standing still."""
SMOOTHING_S = 0.5
"""Time over which speeds and turn rates are averaged."""
MIN_STOP_S, MAX_STOP_GAP_S = 2.0, 0.5
"""Minimum duration of a stop that counts as a goal, and maximum duration of a motion within a stop."""
MIN_LEG_M = 0.5
"""Minimum distance between two stops that count as goals."""
MIN_BEND_M = 0.5
"""Minimum deviation of the path between two stops from a straight line for an additional goal at the bend."""
STOP_SOURCE, BEND_SOURCE = "the robot stopped there", "its path bends there"
"""Values of RecordedGoal.source for goals derived from the driven path."""
_STATUS_BY_EVENT = {
    EventKind.GOAL_REACHED: "reached",
    EventKind.GOAL_PASSED: "passed",
    EventKind.GOAL_FAILED: "failed",
    EventKind.GOAL_CANCELED: "canceled",
}
ToSeconds = Callable[[int], float]
"""Function that converts a log time in ns to s since the start of the drive."""
ToMap = Callable[[StampedPose, float], Pose2]
"""Function that converts a pose to the map frame. Its arguments are the pose in any frame, and the time in s."""


def find_goals(
    messages: LogMessages, to_seconds: ToSeconds, to_map: ToMap, poses: TimedValues
) -> Iterator[RecordedGoal]:
    """Return the goals of a drive. `poses` (n, 3) are the best known poses x, y, yaw in the map frame."""
    goals = [
        RecordedGoal("", to_map(message.content, time), time, source="/goal_pose")
        for message in messages.get("goal")
        for time in [to_seconds(message.log_time)]
    ]
    events = [
        (to_seconds(message.log_time), event_text.from_json(message.content)) for message in messages.get("events")
    ]
    if events:
        return _with_results_of_events(goals, events)
    if not goals:
        goals = list(_goals_from_plans(messages, to_seconds))
    return _with_results_of_actions(goals, messages, to_seconds) if goals else goals_from_motion(poses)


def _with_results_of_events(
    goals: Sequence[RecordedGoal], events: Sequence[tuple[float, Event]]
) -> Iterator[RecordedGoal]:
    """Yield the goals that were accepted, with names and results from the events of simscen's navigator.

    `events` are pairs of a time in s and an event.
    """
    accept_events = [(time, event) for time, event in events if event.kind is EventKind.GOAL_ACCEPTED]
    unmatched = list(goals)
    for time, event in accept_events:
        match = min(unmatched, key=lambda goal: abs(goal.sent_time - time), default=None)
        if match is None or abs(match.sent_time - time) > 1e-3:
            continue
        unmatched.remove(match)
        ending = next(
            ((t, e) for t, e in events if e.kind in _STATUS_BY_EVENT and e.name == event.name and t >= time),
            None,
        )
        goal = replace(match, name=event.name, source="/goal_pose and the events of the navigator")
        if ending is not None:
            end_time, end_event = ending
            error = str(end_event.data.get("error_name", "") or "")
            goal = replace(goal, end_time=end_time, status=_STATUS_BY_EVENT[end_event.kind], error=error)
        yield goal


def _with_results_of_actions(
    goals: Sequence[RecordedGoal], messages: LogMessages, to_seconds: ToSeconds
) -> Iterator[RecordedGoal]:
    """Yield the goals with the results of their Nav2 actions, or without results if actions and goals do not match."""
    states = [(message.log_time, message.content) for message in messages.get("status")]
    names = [str(number) for number in range(len(goals))]
    events = goal_events(states, names) if states and goals else "no status"
    if isinstance(events, str):
        yield from goals
        return
    for name, goal in zip(names, goals, strict=True):
        events_of_goal = [event for event in events if event.name == name]
        accept_event = next((event for event in events_of_goal if event.kind is EventKind.GOAL_ACCEPTED), None)
        end_event = next((event for event in events_of_goal if event.kind in _STATUS_BY_EVENT), None)
        sent_time = goal.sent_time if accept_event is None else to_seconds(accept_event.tick)
        accepted_goal = replace(goal, sent_time=sent_time, source=f"{goal.source} and the action's status")
        if end_event is None:
            yield accepted_goal
        else:
            status = _STATUS_BY_EVENT[end_event.kind]
            yield replace(accepted_goal, end_time=to_seconds(end_event.tick), status=status)


def _goals_from_plans(messages: LogMessages, to_seconds: ToSeconds) -> Iterator[RecordedGoal]:
    """Yield a goal for each plan that ends elsewhere than the previous plan."""
    previous_end: Pose2 | None = None
    for message in messages.get("plan"):
        if not len(message.content.poses):
            continue
        end = Pose3(*message.content.poses[-1].tolist()).plane
        if previous_end is None or end.distance(previous_end) > MAX_SAME_GOAL_DISTANCE_M:
            yield RecordedGoal("", end, to_seconds(message.log_time), source="end of the plan on /plan")
        previous_end = end


def goals_from_motion(poses: TimedValues) -> Iterator[RecordedGoal]:
    """Yield a goal for each stop of at least MIN_STOP_S, each bend of the path between stops, and the last pose."""
    if len(poses) < 2:
        return
    is_kept = np.append(np.diff(poses.times) > 0.0, True)  # the last one of several poses with the same stamp
    times, values = poses.times[is_kept], poses.values[is_kept]
    if len(times) < 2:
        return
    steps = np.diff(times)
    speeds = np.hypot(*np.diff(values[:, :2], axis=0).T) / steps
    turn_rates = np.abs(np.diff(np.unwrap(values[:, 2]))) / steps
    window = min(max(1, round(SMOOTHING_S / float(np.median(steps)))), len(steps))
    kernel = np.ones(window) / window
    is_stopped = (np.convolve(speeds, kernel, "same") < MAX_STOPPED_SPEED_M_S) & (
        np.convolve(turn_rates, kernel, "same") < MAX_STOPPED_TURN_RATE_RAD_S
    )
    windows = find_windows(is_stopped, times[1:], min_length=MIN_STOP_S, max_gap=MAX_STOP_GAP_S)
    stops = [(stop.begin, stop.end, stop.first + 1) for stop in windows if stop.begin > float(times[0]) + 1e-3]
    if not stops or stops[-1][2] < len(times) - 1:
        stops.append((float(times[-1]), float(times[-1]), len(times) - 1))
    last_pose, sent_time, leg_start = Pose2(*values[0].tolist()), float(times[0]), 0
    for begin, end, index in stops:
        pose = Pose2(*values[index].tolist())
        bends = [leg_start + bend for bend in path_corners(values[leg_start : index + 1, :2], MIN_BEND_M)]
        if pose.distance(last_pose) < MIN_LEG_M and not bends:
            continue
        for bend in bends:
            bend_time, bend_pose = float(times[bend]), Pose2(*values[bend].tolist())
            yield RecordedGoal("", bend_pose, sent_time, bend_time, "reached", source=BEND_SOURCE)
            sent_time = bend_time
        yield RecordedGoal("", pose, sent_time, begin, "reached", source=STOP_SOURCE)
        last_pose, sent_time, leg_start = pose, end, index


MIN_IDLE_S = 1.0
"""Minimum time before the first goal that is cut off."""
LEAD_S = 0.5
"""Time to keep before the first motion, if goals are derived from the motion."""
MIN_MOTION_M = 0.05
"""Minimum distance from the first pose that counts as motion."""


def trim_to_first_goal(drive: RecordedDrive) -> RecordedDrive:
    """Return the drive without the time before the first goal. All times become relative to the new start.

    If goals are derived from the motion, only the time before the first motion is cut off. If this time is less than
    MIN_IDLE_S, the drive is returned unchanged.
    """
    if not drive.goals:
        return drive
    begin = drive.goals[0].sent_time
    if drive.goals[0].source in (STOP_SOURCE, BEND_SOURCE):
        has_moved = np.hypot(*(drive.poses.values[:, :2] - drive.poses.values[0, :2]).T) > MIN_MOTION_M
        begin = float(drive.poses.times[np.argmax(has_moved)]) - LEAD_S
    begin = max(begin, float(drive.poses.times[0]))
    if begin < MIN_IDLE_S:
        return drive
    note = f"what happened in the first {begin:.1f} s of the log, before the first goal"
    goals = tuple(
        replace(
            goal,
            sent_time=max(0.0, goal.sent_time - begin),
            end_time=None if goal.end_time is None else goal.end_time - begin,
        )
        for goal in drive.goals
    )
    scans = drive.scans
    if scans is not None:
        scans = scans.subset(slice(int(np.searchsorted(scans.times, begin)), None))
        scans = replace(scans, times=scans.times - begin, arrivals=scans.arrivals - begin)
    return replace(
        drive,
        duration=drive.duration - begin,
        poses=_values_from(drive.poses, begin, keep_last=True),
        belief=_values_from(drive.belief, begin, keep_last=True),
        corrections=_values_from(drive.corrections, begin),
        odometry=_values_from(drive.odometry, begin),
        commands=_values_from(drive.commands, begin),
        turn_rates=_values_from(drive.turn_rates, begin),
        bumper=_values_from(drive.bumper, begin),
        scans=scans,
        goals=goals,
        notes=(*drive.notes, note),
        begin=begin,
    )


def _values_from(signal: TimedValues, begin: float, keep_last: bool = False) -> TimedValues:
    """Return the samples from `begin` on. If `keep_last` is True, the last sample before `begin` is moved to time 0."""
    first = int(np.searchsorted(signal.times, begin))
    if keep_last and first > 0 and (first == len(signal) or signal.times[first] > begin):
        first -= 1
    times = np.maximum(signal.times[first:] - begin, 0.0)
    return TimedValues(times, signal.values[first:], np.maximum(signal.arrivals[first:] - begin, 0.0))
