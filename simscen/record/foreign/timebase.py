"""From the stamps of real messages, which repeat, come late and jump, to the ticks of a trace."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.simtime import NS_PER_SECOND

MAX_BACKWARD_JUMP_NS = NS_PER_SECOND
"""Nanoseconds that a stamp may lie before an earlier one of its topic: messages overtake each other, clocks do not."""
MAX_LOGGING_DELAY_NS = 10 * NS_PER_SECOND
"""Nanoseconds between the stamp of a message and its logging above which they are of different clocks."""


@dataclass(frozen=True, eq=False)
class StampedMessages:
    """The messages of a topic in the order they were logged: `logged` and `stamps` in nanoseconds."""

    topic: str
    logged: Ticks
    stamps: Ticks

    def __post_init__(self) -> None:
        newest = np.maximum.accumulate(self.stamps)
        back = newest - self.stamps
        if len(back) and back.max() > MAX_BACKWARD_JUMP_NS:
            at = int(np.argmax(back > MAX_BACKWARD_JUMP_NS))
            by = back[at] / NS_PER_SECOND
            told = f"the time of {self.topic} jumps back by {by:.1f} s at its message {at + 1}"
            raise UnusableLog(told, "a clock was reset or a bag looped: cut the log there, or judge it with --time log")

    @property
    def disorder(self) -> str:
        """What is odd about the stamps, in words; "" for nothing."""
        late = int((np.diff(self.stamps) < 0).sum())
        again = len(self.stamps) - len(np.unique(self.stamps))
        told = [
            f"{late} came after a later one" if late else "",
            f"{again} had the stamp of another, of which the last counts" if again else "",
        ]
        return ", ".join(text for text in told if text)


@dataclass(frozen=True, eq=False)
class Timebase:
    """The time of a log: ticks of 1/`rate` s since its first message, up to `end` (a tick).

    `anchor` are messages with both times; by them the time of logging becomes that of the headers. None = the time of
    logging is the time.
    """

    start: int
    stop: int
    rate: int
    anchor: StampedMessages | None = None

    @classmethod
    def over(cls, logged: Iterable[Ticks], rate: int, anchor: StampedMessages | None) -> Timebase:
        """That of all messages logged at these times; there must be some."""
        everything = np.concatenate(list(logged))
        first, last = _header_times(np.array([everything.min(), everything.max()]), anchor).tolist()
        return cls(first, last, rate, anchor)

    @property
    def end(self) -> int:
        """The last tick."""
        return int(self._ticks(np.array([self.stop]))[0])

    def of_logged(self, logged: Ticks) -> Ticks:
        """The ticks of messages without a stamp."""
        return self._ticks(_header_times(logged, self.anchor))

    def of_stamped(self, messages: StampedMessages) -> Ticks:
        """The ticks of messages with one. Raises Unusable where the stamps are of another clock."""
        if self.anchor is None:
            return self._ticks(messages.logged)
        late = np.abs(messages.stamps - _header_times(messages.logged, self.anchor))
        if len(late) > 2 and np.median(late) > MAX_LOGGING_DELAY_NS:
            by = float(np.median(late)) / NS_PER_SECOND
            told = f"{messages.topic} and {self.anchor.topic} do not share a clock: their stamps differ by {by:.1f} s"
            raise UnusableLog(told, "is use_sim_time the same for all nodes? --time log judges by the time of logging")
        return self._ticks(messages.stamps)

    def _ticks(self, times: Ticks) -> Ticks:
        """The nearest ticks, all within the log: a latched message may be older than it, a transform newer."""
        since: Ticks = np.clip(times, self.start, self.stop) - self.start
        ticks: Ticks = (since * self.rate + NS_PER_SECOND // 2) // NS_PER_SECOND
        return ticks


def _header_times(logged: Ticks, anchor: StampedMessages | None) -> Ticks:
    """What headers would say at these times of logging; before and after all of them, time goes on as it was."""
    if anchor is None:
        return logged
    stamps = np.maximum.accumulate(anchor.stamps)
    first, begin = int(anchor.logged[0]), int(stamps[0])
    known = (anchor.logged - first).astype(np.float64)
    between = np.interp((logged - first).astype(np.float64), known, (stamps - begin).astype(np.float64))
    beyond = np.minimum(logged - first, 0) + np.maximum(logged - int(anchor.logged[-1]), 0)
    told: Ticks = begin + np.rint(between).astype(np.int64) + beyond
    return told
