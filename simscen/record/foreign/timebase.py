"""Conversion of the times in a real robot's log to ticks, and checks for clocks that were set during recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.clock import NS_PER_SECOND
from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog

MAX_BACKWARD_JUMP_NS = NS_PER_SECOND
"""Maximum backward step between stamps of a topic. A larger step means that the clock was reset."""
MIN_CLOCK_STEP_NS = NS_PER_SECOND // 10
"""Minimum change of a clock that is reported."""
MIN_MESSAGES_AROUND_STEP = 20
"""Minimum number of messages before and after the change of a clock that is reported."""
MAX_CLOCK_STEP_RATIO = 1.5
"""Maximum ratio of the permanent change of the offset (stamp minus time of logging) to the change at one message.

When a clock is set, both changes are equal. With a larger ratio, the recorder caught up or lost messages instead."""
MAX_STAMP_DIFFERENCE_NS = 10 * NS_PER_SECOND
"""Maximum difference between stamps of two topics at the same time. A larger difference means different clocks."""
MIN_MESSAGES_OF_CLOCK = 5
"""Minimum number of messages of a topic with which it is checked that the stamps advance."""
MIN_CLOCK_RATE = 0.01
"""Minimum time span of the stamps of a topic, relative to the time span of the times of logging."""


@dataclass(frozen=True, eq=False)
class StampedMessages:
    """Times of logging and stamps (n,) of the messages of a topic in ns, in the order of logging.

    The constructor raises UnusableLog if the stamps stand still or jump back, or if the clock of the stamps was set
    during the recording.
    """

    topic: str
    logged: Ticks
    stamps: Ticks

    def __post_init__(self) -> None:
        if len(self.stamps) >= MIN_MESSAGES_OF_CLOCK and np.ptp(self.stamps) < MIN_CLOCK_RATE * np.ptp(self.logged):
            text = f"the stamps of the {len(self.stamps)} messages of {self.topic} do not advance"
            raise UnusableLog(text, "judge it with --time log")
        newest = np.maximum.accumulate(self.stamps)
        jumps = newest - self.stamps
        if len(jumps) and jumps.max() > MAX_BACKWARD_JUMP_NS:
            index = int(np.argmax(jumps > MAX_BACKWARD_JUMP_NS))
            seconds = jumps[index] / NS_PER_SECOND
            text = f"the time of {self.topic} jumps back by {seconds:.1f} s at its message {index + 1}"
            raise UnusableLog(text, "a clock was reset or a bag looped: cut the log there, or judge it with --time log")
        if (step := find_clock_step(self.logged, self.stamps)) is not None:
            index, seconds = step[0], step[1] / NS_PER_SECOND
            direction = "back" if seconds < 0 else "forward"
            text = f"the clock of {self.topic} was set {direction} by {abs(seconds):.1f} s at its message {index + 1}"
            raise UnusableLog(text, "cut the log there, or judge it with --time log")

    @property
    def order_problems(self) -> str:
        """Text with the numbers of late and repeated stamps; "" if there are none."""
        late = int((np.diff(self.stamps) < 0).sum())
        repeated = len(self.stamps) - len(np.unique(self.stamps))
        texts = [
            f"{late} messages out of order" if late else "",
            f"{repeated} repeated stamps, of which the last message is used" if repeated else "",
        ]
        return ", ".join(text for text in texts if text)


def find_clock_step(logged: Ticks, stamps: Ticks) -> tuple[int, int] | None:
    """Find the message at which the clock of the stamps was set.

    Return the index of the first message after the clock was set, and the change of the clock in ns. Return None if the
    clock was not set. `logged` and `stamps` are the times of logging and the stamps of the messages of one topic in ns,
    in the order of logging.
    """
    # Delays make offsets smaller, so that the maximum offset of many messages is the difference of the two clocks. Only
    # setting a clock changes this maximum permanently and from one message to the next.
    count = MIN_MESSAGES_AROUND_STEP
    if len(stamps) < 2 * count:
        return None
    offsets, stamp_gaps, logged_gaps = stamps - logged, np.diff(stamps), np.diff(logged)
    changes = np.diff(offsets)
    permanent_changes = np.maximum.accumulate(offsets[::-1])[::-1][1:] - np.maximum.accumulate(offsets)[:-1]
    ratios = permanent_changes / np.where(changes == 0, 1, changes)
    is_step = (np.abs(changes) > MIN_CLOCK_STEP_NS) & (ratios > 0.5) & (ratios < MAX_CLOCK_STEP_RATIO)
    is_step &= np.abs(stamp_gaps - np.median(stamp_gaps)) > np.abs(logged_gaps - np.median(logged_gaps))
    steps = np.flatnonzero(is_step[count - 1 : -count + 1])
    if not len(steps):
        return None
    index = int(steps[0]) + count - 1
    return index + 1, int(changes[index])


def check_recorder_clock(topic: str, logged: Sequence[int], stamps: Sequence[int]) -> None:
    """Raise UnusableLog if the clock of the recorder was set back.

    `logged` and `stamps` are the times of logging and the stamps of the messages of one topic in ns, in the order of
    the file.
    """
    # A file with several backward steps, or with parts whose times do not overlap, is only unsorted.
    times = np.array(logged, dtype=np.int64)
    backward = np.flatnonzero(np.diff(times) < 0)
    if len(backward) != 1:
        return
    index = int(backward[0]) + 1
    step = int(times[index - 1] - times[index])
    overlaps = times[-1] > times[0]
    if step > MIN_CLOCK_STEP_NS and overlaps and (stamps[index] < stamps[index - 1] or not any(stamps)):
        text = (
            f"the clock of the recorder was set back by {step / NS_PER_SECOND:.1f} s at message {index + 1} of {topic}"
        )
        raise UnusableLog(text, "cut the log there")


@dataclass(frozen=True, eq=False)
class Timebase:
    """Conversion of the times of messages to ticks.

    start_time:  time of tick 0 in ns, by the clock of the anchor
    end_time:    time of the last tick in ns, by the clock of the anchor
    rate:        ticks per second
    anchor:      messages that relate times of logging to stamps; None if times of logging are used for all messages
    """

    start_time: int
    end_time: int
    rate: int
    anchor: StampedMessages | None = None

    @classmethod
    def from_logged(cls, start: int, end: int, rate: int, anchor: StampedMessages | None) -> Timebase:
        """Return the timebase between the times of logging `start` and `end` in ns."""
        start_time, end_time = _to_clock_of_anchor(np.array([start, end]), anchor).tolist()
        return cls(start_time, end_time, rate, anchor)

    @property
    def last_tick(self) -> int:
        """The last tick."""
        return int(self._ticks(np.array([self.end_time]))[0])

    def ticks_of_logged(self, logged: Ticks) -> Ticks:
        """Return the ticks of messages without stamps, from the times of logging in ns."""
        return self._ticks(_to_clock_of_anchor(logged, self.anchor))

    def ticks_of_stamped(self, messages: StampedMessages) -> Ticks:
        """Return the ticks of messages with stamps. Raises UnusableLog if the anchor has another clock."""
        if self.anchor is None:
            return self._ticks(messages.logged)
        differences = np.abs(messages.stamps - _to_clock_of_anchor(messages.logged, self.anchor))
        if len(differences) > 2 and np.median(differences) > MAX_STAMP_DIFFERENCE_NS:
            seconds = float(np.median(differences)) / NS_PER_SECOND
            topics = f"{messages.topic} and {self.anchor.topic}"
            text = f"{topics} do not share a clock: their stamps differ by {seconds:.1f} s"
            raise UnusableLog(text, "is use_sim_time the same for all nodes? --time log judges by the time of logging")
        return self._ticks(messages.stamps)

    def _ticks(self, times: Ticks) -> Ticks:
        """Return the ticks nearest to times in ns, limited to the first and the last tick."""
        elapsed: Ticks = np.clip(times, self.start_time, self.end_time) - self.start_time
        return (elapsed * self.rate + NS_PER_SECOND // 2) // NS_PER_SECOND


def _to_clock_of_anchor(logged: Ticks, anchor: StampedMessages | None) -> Ticks:
    """Convert times of logging with `to_clock_of_stamps`. Return the times unchanged if there is no anchor."""
    return logged if anchor is None else to_clock_of_stamps(logged, anchor.logged, anchor.stamps)


def to_clock_of_stamps(logged: Ticks, anchor_logged: Ticks, anchor_stamps: Ticks) -> Ticks:
    """Convert times of logging to the clock of stamps, by interpolation between the messages of a topic (the anchor).

    `anchor_logged` and `anchor_stamps` are the times of logging and the stamps of the anchor, in the order of logging.
    Before and after the anchor, the difference of the two clocks is assumed to be constant. All times are in ns.
    """
    stamps = np.maximum.accumulate(anchor_stamps)
    first_logged, first_stamp = int(anchor_logged[0]), int(stamps[0])
    interpolated = np.interp(
        (logged - first_logged).astype(np.float64),
        (anchor_logged - first_logged).astype(np.float64),
        (stamps - first_stamp).astype(np.float64),
    )
    outside = np.minimum(logged - first_logged, 0) + np.maximum(logged - int(anchor_logged[-1]), 0)
    times: Ticks = first_stamp + np.rint(interpolated).astype(np.int64) + outside
    return times
