"""Conversion of the times of a real log, which can repeat, be late, or jump, to the ticks of a Trace."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.simtime import NS_PER_SECOND

MAX_BACKWARD_JUMP_NS = NS_PER_SECOND
"""Maximum difference to an earlier but newer stamp of the topic. A larger one means that the clock was reset."""
MAX_LOGGING_DELAY_NS = 10 * NS_PER_SECOND
"""Maximum difference between the stamps of two topics at the same time. A larger one means different clocks."""


@dataclass(frozen=True, eq=False)
class StampedMessages:
    """Times of the messages of a topic in ns, in the order of logging: times of logging, and stamps of the headers.

    Raises UnusableLog if the stamps jump back.
    """

    topic: str
    logged: Ticks
    stamps: Ticks

    def __post_init__(self) -> None:
        newest = np.maximum.accumulate(self.stamps)
        jumps = newest - self.stamps
        if len(jumps) and jumps.max() > MAX_BACKWARD_JUMP_NS:
            index = int(np.argmax(jumps > MAX_BACKWARD_JUMP_NS))
            seconds = jumps[index] / NS_PER_SECOND
            text = f"the time of {self.topic} jumps back by {seconds:.1f} s at its message {index + 1}"
            raise UnusableLog(text, "a clock was reset or a bag looped: cut the log there, or judge it with --time log")

    @property
    def disorder(self) -> str:
        """Description of late and repeated stamps, or ""."""
        late = int((np.diff(self.stamps) < 0).sum())
        repeated = len(self.stamps) - len(np.unique(self.stamps))
        texts = [
            f"{late} messages out of order" if late else "",
            f"{repeated} repeated stamps, of which the last message is used" if repeated else "",
        ]
        return ", ".join(text for text in texts if text)


@dataclass(frozen=True, eq=False)
class Timebase:
    """Ticks of a log: 1/`rate` s since the first message at `start`, until the last message at `stop` (ns).

    `anchor` are messages with both times; they convert times of logging to times of headers. Without an anchor, the
    times of logging are used.
    """

    start: int
    stop: int
    rate: int
    anchor: StampedMessages | None = None

    @classmethod
    def from_logged(cls, logged: Iterable[Ticks], rate: int, anchor: StampedMessages | None) -> Timebase:
        """Return the timebase of messages that were logged at these times (at least one)."""
        times = np.concatenate(list(logged))
        start, stop = _header_times(np.array([times.min(), times.max()]), anchor).tolist()
        return cls(start, stop, rate, anchor)

    @property
    def end(self) -> int:
        """Last tick."""
        return int(self._ticks(np.array([self.stop]))[0])

    def ticks_of_logged(self, logged: Ticks) -> Ticks:
        """Return the ticks of messages without stamps."""
        return self._ticks(_header_times(logged, self.anchor))

    def ticks_of_stamped(self, messages: StampedMessages) -> Ticks:
        """Return the ticks of messages with stamps. Raises UnusableLog if their clock differs from the anchor's."""
        if self.anchor is None:
            return self._ticks(messages.logged)
        delays = np.abs(messages.stamps - _header_times(messages.logged, self.anchor))
        if len(delays) > 2 and np.median(delays) > MAX_LOGGING_DELAY_NS:
            seconds = float(np.median(delays)) / NS_PER_SECOND
            topics = f"{messages.topic} and {self.anchor.topic}"
            text = f"{topics} do not share a clock: their stamps differ by {seconds:.1f} s"
            raise UnusableLog(text, "is use_sim_time the same for all nodes? --time log judges by the time of logging")
        return self._ticks(messages.stamps)

    def _ticks(self, times: Ticks) -> Ticks:
        """Return the nearest ticks within the log. Latched messages can be older than the log, transforms newer."""
        since: Ticks = np.clip(times, self.start, self.stop) - self.start
        ticks: Ticks = (since * self.rate + NS_PER_SECOND // 2) // NS_PER_SECOND
        return ticks


def _header_times(logged: Ticks, anchor: StampedMessages | None) -> Ticks:
    """Convert times of logging to times of headers by interpolation. Outside the anchor, the difference is constant."""
    if anchor is None:
        return logged
    stamps = np.maximum.accumulate(anchor.stamps)
    first, begin = int(anchor.logged[0]), int(stamps[0])
    known = (anchor.logged - first).astype(np.float64)
    between = np.interp((logged - first).astype(np.float64), known, (stamps - begin).astype(np.float64))
    beyond = np.minimum(logged - first, 0) + np.maximum(logged - int(anchor.logged[-1]), 0)
    times: Ticks = begin + np.rint(between).astype(np.int64) + beyond
    return times
