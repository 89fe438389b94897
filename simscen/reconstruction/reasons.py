"""Reconstructed parts of a scenario with the reason for them: when it was seen, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask


@dataclass(frozen=True)
class Reason:
    """Why a part of the scenario is there.

    Attributes:
        text: What the log shows, in one sentence without a period.
        begin: First time in s at which the log shows it; None if it is not bound to a time.
        end: Last such time in s.
        confidence: "high", "medium", or "low".
    """

    text: str
    begin: float | None = None
    end: float | None = None
    confidence: str = "high"

    @property
    def comment(self) -> str:
        """The reason as one line."""
        times = "" if self.begin is None else f", t = {self.begin:.2f} s"
        times += "" if self.begin is None or self.end is None else f" to {self.end:.2f} s"
        return f"{self.text}{times} (confidence: {self.confidence})"


@dataclass(frozen=True)
class FoundFault:
    """Fault of a sensor, the wheels, the localizer, or the commands.

    Attributes:
        target: What it affects: "lidar", "odom", "imu", "wheels", "cmd_vel", or "localizer".
        kind: Key of the fault in the scenario language, for example "off".
        values: Its parameters by key.
        begin: Start in s; None from the start of the drive.
        duration: Duration in s; None until the end.
        reason: Why it is there.
    """

    target: str
    kind: str
    values: Mapping[str, object] = field(default_factory=dict)
    begin: float | None = None
    duration: float | None = None
    reason: Reason = field(default_factory=lambda: Reason(""))


@dataclass(frozen=True)
class Window:
    """Time window from `begin` to `end` in s, and the `first` and `last` index of the samples in it."""

    begin: float
    end: float
    first: int
    last: int

    @property
    def length(self) -> float:
        """Length in s."""
        return self.end - self.begin

    @property
    def samples(self) -> slice:
        """Slice of the samples in the window."""
        return slice(self.first, self.last + 1)


def windows(mask: Mask, times: Array, min_length: float = 0.0, max_gap: float = 0.0) -> list[Window]:
    """Return the windows in which `mask` (n,) holds at `times` (n,), without those shorter than `min_length` s.

    Two windows that are at most `max_gap` s apart are one.
    """
    indices = np.flatnonzero(mask)
    if not len(indices):
        return []
    steps = np.diff(indices)
    apart = (steps > 1) & (times[indices[1:]] - times[indices[:-1]] > max_gap)
    first = np.concatenate(([indices[0]], indices[1:][apart]))
    last = np.concatenate((indices[:-1][apart], [indices[-1]]))
    found = [Window(float(times[a]), float(times[b]), int(a), int(b)) for a, b in zip(first, last, strict=True)]
    return [window for window in found if window.length >= min_length]
