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
from simscen.reconstruction.reasons import windows
from simscen.record.foreign.goal_events import goal_events
from simscen.record.messages import event_text
from simscen.record.messages.decode import StampedPose

SAME_GOAL_M = 0.05
"""Maximum distance between the ends of two successive plans to the same goal."""
STOPPED_SPEED_M_S, STOPPED_TURN_RAD_S = 0.03, 0.05
"""Speed and turn rate below which the robot counts as standing still."""
MIN_STOP_S = 2.0
"""Minimum duration of a stop that counts as a goal."""
MIN_LEG_M = 0.5
"""Minimum distance between two stops that count as goals."""
MIN_BEND_M = 0.5
"""Minimum deviation of the path between two stops from a straight line for an additional goal at the bend."""
STOP_SOURCE, BEND_SOURCE = "the robot stopped there", "its path bends there"
"""Values of RecordedGoal.source for goals derived from the driven path."""
_STATUS_OF_EVENTS = {
    EventKind.GOAL_REACHED: "reached",
    EventKind.GOAL_PASSED: "passed",
    EventKind.GOAL_FAILED: "failed",
    EventKind.GOAL_CANCELED: "canceled",
}
ToSeconds = Callable[[int], float]
"""Function that converts a log time in ns to s since the start of the drive."""
ToMap = Callable[[StampedPose, float], Pose2]
"""Function that converts a pose in any frame, at a time in s, to the map frame."""


def find_goals(
    messages: LogMessages, to_seconds: ToSeconds, to_map: ToMap, poses: TimedValues
) -> Iterator[RecordedGoal]:
    """Return the goals of a drive. `poses` (n, 3) are the best known poses x, y, yaw in the map frame."""
    sent = [
        RecordedGoal("", to_map(message.content, time), time, source="/goal_pose")
        for message in messages.of("goal")
        for time in [to_seconds(message.log_time)]
    ]
    events = [
        (to_seconds(message.log_time), event_text.from_json(message.content)) for message in messages.of("events")
    ]
    if events:
        return _with_results_of_events(sent, events)
    if not sent:
        sent = list(_goals_from_plans(messages, to_seconds))
    return _with_results_of_actions(sent, messages, to_seconds) if sent else goals_from_motion(poses)


def _with_results_of_events(
    sent: Sequence[RecordedGoal], events: Sequence[tuple[float, Event]]
) -> Iterator[RecordedGoal]:
    """Yield the `sent` goals that were accepted, with names and results from the events of simscen's navigator.

    `events` are pairs of a time in s and an event.
    """
    accepted = [(time, event) for time, event in events if event.kind is EventKind.GOAL_ACCEPTED]
    poses = list(sent)
    for time, event in accepted:
        match = min(poses, key=lambda goal: abs(goal.sent - time), default=None)
        if match is None or abs(match.sent - time) > 1e-3:
            continue
        poses.remove(match)
        ending = next(
            ((t, e) for t, e in events if e.kind in _STATUS_OF_EVENTS and e.name == event.name and t >= time),
            None,
        )
        goal = replace(match, name=event.name, source="/goal_pose and the events of the navigator")
        if ending is not None:
            code = str(ending[1].data.get("error_name", "") or "")
            goal = replace(goal, ended=ending[0], status=_STATUS_OF_EVENTS[ending[1].kind], error=code)
        yield goal


def _with_results_of_actions(
    sent: Sequence[RecordedGoal], messages: LogMessages, to_seconds: ToSeconds
) -> Iterator[RecordedGoal]:
    """Yield the goals with the results of their Nav2 actions, or without results if actions and goals do not match."""
    states = [(message.log_time, message.content) for message in messages.of("status")]
    names = [str(number) for number in range(len(sent))]
    events = goal_events(states, names) if states and sent else "no status"
    if isinstance(events, str):
        yield from sent
        return
    for name, goal in zip(names, sent, strict=True):
        own = [event for event in events if event.name == name]
        accepted = next((to_seconds(event.tick) for event in own if event.kind is EventKind.GOAL_ACCEPTED), goal.sent)
        ending = next((event for event in own if event.kind in _STATUS_OF_EVENTS), None)
        source = f"{goal.source} and the action's status"
        if ending is None:
            yield replace(goal, sent=accepted, source=source)
        else:
            status = _STATUS_OF_EVENTS[ending.kind]
            yield replace(goal, sent=accepted, ended=to_seconds(ending.tick), status=status, source=source)


def _goals_from_plans(messages: LogMessages, to_seconds: ToSeconds) -> Iterator[RecordedGoal]:
    """Yield a goal for each plan that ends elsewhere than the previous one."""
    last: Pose2 | None = None
    for message in messages.of("plan"):
        if not len(message.content.poses):
            continue
        end = Pose3(*message.content.poses[-1].tolist()).plane
        if last is None or end.distance(last) > SAME_GOAL_M:
            yield RecordedGoal("", end, to_seconds(message.log_time), source="end of the plan on /plan")
        last = end


def goals_from_motion(poses: TimedValues) -> Iterator[RecordedGoal]:
    """Yield a goal for each stop of at least MIN_STOP_S, each bend of the path between stops, and the last pose."""
    if len(poses) < 2:
        return
    is_last = np.append(np.diff(poses.times) > 0.0, True)  # of several poses with the same stamp
    times, values = poses.times[is_last], poses.values[is_last]
    if len(times) < 2:
        return
    steps = np.diff(times)
    speeds = np.hypot(*np.diff(values[:, :2], axis=0).T) / steps
    turns = np.abs(np.diff(np.unwrap(values[:, 2]))) / steps
    window = min(max(1, round(0.5 / float(np.median(steps)))), len(steps))
    kernel = np.ones(window) / window
    still = (np.convolve(speeds, kernel, "same") < STOPPED_SPEED_M_S) & (
        np.convolve(turns, kernel, "same") < STOPPED_TURN_RAD_S
    )
    last, sent, since = Pose2(*values[0].tolist()), float(times[0]), 0
    stops = windows(still, times[1:], min_length=MIN_STOP_S, max_gap=0.5)
    ends = [(stop.begin, stop.end, stop.first + 1) for stop in stops if stop.begin > float(times[0]) + 1e-3]
    if not ends or ends[-1][2] < len(times) - 1:
        ends.append((float(times[-1]), float(times[-1]), len(times) - 1))
    for begin, end, index in ends:
        pose = Pose2(*values[index].tolist())
        bends = [since + bend for bend in path_corners(values[since : index + 1, :2], MIN_BEND_M)]
        if pose.distance(last) < MIN_LEG_M and not bends:
            continue
        for bend in bends:
            passed = float(times[bend])
            yield RecordedGoal("", Pose2(*values[bend].tolist()), sent, passed, "reached", source=BEND_SOURCE)
            sent = passed
        yield RecordedGoal("", pose, sent, begin, "reached", source=STOP_SOURCE)
        last, sent, since = pose, end, index


MIN_IDLE_S = 1.0
"""Minimum time before the first goal that is cut off."""
LEAD_S = 0.5
"""Time to keep before the first motion, if goals are derived from the motion."""


def trim_to_first_goal(drive: RecordedDrive) -> RecordedDrive:
    """Return the drive without the time before the first goal. All times become relative to the new start.

    If goals are derived from the motion, only the time before the first motion is cut off. A drive with less than
    MIN_IDLE_S to cut off is returned unchanged.
    """
    if not drive.goals:
        return drive
    begin = drive.goals[0].sent
    if drive.goals[0].source in (STOP_SOURCE, BEND_SOURCE):
        moved = np.hypot(*(drive.poses.values[:, :2] - drive.poses.values[0, :2]).T) > 0.05
        begin = float(drive.poses.times[np.argmax(moved)]) - LEAD_S
    begin = max(begin, float(drive.poses.times[0]))
    if begin < MIN_IDLE_S:
        return drive
    note = f"what happened in the first {begin:.1f} s of the log, before the first goal"
    goals = tuple(
        replace(goal, sent=max(0.0, goal.sent - begin), ended=None if goal.ended is None else goal.ended - begin)
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
    """Return the values from `begin` on. With `keep_last`, the newest value before `begin` is kept at time 0."""
    first = int(np.searchsorted(signal.times, begin))
    if keep_last and first > 0 and (first == len(signal) or signal.times[first] > begin):
        first -= 1
    times = np.maximum(signal.times[first:] - begin, 0.0)
    return TimedValues(times, signal.values[first:], np.maximum(signal.arrivals[first:] - begin, 0.0))
