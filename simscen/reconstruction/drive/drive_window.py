"""The part of a recording in which the robot drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simscen.reconstruction.drive.recorded_drive import RecordedDrive, Scans, TimedValues

MIN_IDLE_S = 1.0
"""Shorter times before the first goal are kept."""
LEAD_S = 0.5
"""Time before the first motion that is kept if the goals are unknown."""


def from_first_goal(drive: RecordedDrive) -> RecordedDrive:
    """Return the drive without what the log holds before its first goal; times count from then."""
    if not drive.goals:
        return drive
    begin = drive.goals[0].sent
    if drive.goals[0].status == "reached" and not drive.goals[0].source.startswith("/"):
        begin = _first_motion(drive.poses) - LEAD_S
    begin = max(begin, float(drive.poses.times[0]))
    if begin < MIN_IDLE_S:
        return drive
    note = f"what happened in the first {begin:.1f} s of the log, before the first goal"
    goals = tuple(
        replace(goal, sent=max(0.0, goal.sent - begin), ended=None if goal.ended is None else goal.ended - begin)
        for goal in drive.goals
    )
    return replace(
        drive,
        duration=drive.duration - begin,
        poses=_after(drive.poses, begin, keep_last=True),
        belief=_after(drive.belief, begin, keep_last=True),
        corrections=_after(drive.corrections, begin),
        odometry=_after(drive.odometry, begin),
        commands=_after(drive.commands, begin),
        turn_rates=_after(drive.turn_rates, begin),
        bumper=_after(drive.bumper, begin),
        scans=None if drive.scans is None else _scans_after(drive.scans, begin),
        goals=goals,
        notes=(*drive.notes, note),
        begin=begin,
    )


def _first_motion(poses: TimedValues) -> float:
    moved = np.flatnonzero(np.hypot(*(poses.values[:, :2] - poses.values[0, :2]).T) > 0.05)
    return float(poses.times[moved[0]]) if len(moved) else float(poses.times[0])


def _after(signal: TimedValues, begin: float, keep_last: bool = False) -> TimedValues:
    """Return the values from `begin` on; with `keep_last`, also the value that holds then."""
    first = int(np.searchsorted(signal.times, begin))
    if keep_last and first > 0 and (first == len(signal) or signal.times[first] > begin):
        first -= 1
    times = np.maximum(signal.times[first:] - begin, 0.0)
    return TimedValues(times, signal.values[first:], np.maximum(signal.arrivals[first:] - begin, 0.0))


def _scans_after(scans: Scans, begin: float) -> Scans:
    first = int(np.searchsorted(scans.times, begin))
    return replace(
        scans,
        times=scans.times[first:] - begin,
        arrivals=scans.arrivals[first:] - begin,
        ranges=scans.ranges[first:],
        malformed=scans.malformed[first:],
    )
