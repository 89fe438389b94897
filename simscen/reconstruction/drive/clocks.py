"""Relation of the clock of the stamps to the clock of the log times, which can have another origin or rate."""

from __future__ import annotations

import numpy as np

from simscen.core.clock import NS_PER_SECOND
from simscen.reconstruction.drive.log_messages import LoggedMessage, LogMessages
from simscen.record.foreign.timebase import MIN_CLOCK_RATE, to_clock_of_stamps

MAX_CLOCK_DIFFERENCE_NS = 10 * NS_PER_SECOND
"""Maximum difference between the stamp and the log time of a message if both are from the same clock."""
MAX_CLOCK_RATE_ERROR = 0.002
"""Maximum deviation from 1 of the ratio between the rates of two clocks that measure the same time."""


def _stamped(messages: LogMessages) -> list[list[LoggedMessage]]:
    """Return the messages with stamps of each role whose stamps are compared with the log times."""
    roles = ("scan", "odom", "amcl_pose", "truth")
    return [[message for message in messages.of(role) if message.stamp] for role in roles]


def adjust_clock_rate(messages: LogMessages) -> None:
    """Convert all log times to the clock of the stamps if its rate differs, as for a simulator in slow motion."""
    anchor = max(_stamped(messages), key=len)
    if not anchor:
        return
    logged, stamps = (np.array([message[column] for message in anchor], dtype=np.int64) for column in (0, 1))
    rate = float(np.ptp(stamps)) / max(1.0, float(np.ptp(logged)))
    is_same_clock = np.median(np.abs(stamps - logged)) <= MAX_CLOCK_DIFFERENCE_NS
    if is_same_clock or rate < MIN_CLOCK_RATE or abs(rate - 1.0) <= MAX_CLOCK_RATE_ERROR:
        return
    messages.notes.append(f"delays of messages, because stamps advance {rate:.3f} s per second of log time")
    for role, of_role in messages.by_role.items():
        times = np.array([message.log_time for message in of_role], dtype=np.int64)
        converted = to_clock_of_stamps(times, logged, stamps).tolist()
        messages.by_role[role] = [
            message._replace(log_time=time) for message, time in zip(of_role, converted, strict=True)
        ]


def clock_offset(messages: LogMessages) -> int:
    """Return the difference in ns between the clock of the stamps and the clock of the log; 0 for one clock."""
    differences = [message.stamp - message.log_time for of_role in _stamped(messages) for message in of_role]
    if not differences or abs(offset := max(differences)) <= MAX_CLOCK_DIFFERENCE_NS:
        return 0
    messages.notes.append("the smallest delay of messages, because stamps and log times are of different clocks")
    return offset
