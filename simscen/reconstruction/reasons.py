"""Results of estimators: reasons for parts of the scenario, faults, and time windows in which a condition is true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask


@dataclass(frozen=True)
class Reason:
    """Reason for a part of the reconstructed scenario; a comment in the scenario file.

    Attributes:
        text: Observation in the log, as a phrase without a period.
        begin: Start of the observation in s; None if it has no time.
        end: End of the observation in s; None for a single time.
        confidence: Confidence that the part of the scenario is right: "high", "medium", or "low".
    """

    text: str
    begin: float | None = None
    end: float | None = None
    confidence: str = "high"

    @property
    def comment(self) -> str:
        """The reason as one line, with times and confidence."""
        times = "" if self.begin is None else f", t = {self.begin:.2f} s"
        times += "" if self.begin is None or self.end is None else f" to {self.end:.2f} s"
        return f"{self.text}{times} (confidence: {self.confidence})"


@dataclass(frozen=True)
class FoundFault:
    """Fault that an estimator found in a log.

    Attributes:
        target: Faulty part: a sensor ("lidar", "odom", "imu"), "wheels", "cmd_vel", or "localizer".
        kind: YAML key of the fault, for example "off".
        values: Parameters of the fault by YAML key.
        begin: Start in s; None for the start of the drive.
        duration: Duration in s; None until the end of the drive.
        reason: Observation that shows the fault.
    """

    target: str
    kind: str
    values: Mapping[str, object] = field(default_factory=dict)
    begin: float | None = None
    duration: float | None = None
    reason: Reason = field(default_factory=lambda: Reason(""))


@dataclass(frozen=True)
class Window:
    """Time window from `begin` to `end` in s. `first` and `last` are the indices of its first and last sample."""

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


def find_windows(mask: Mask, times: Array, min_length: float = 0.0, max_gap: float = 0.0) -> list[Window]:
    """Return the time windows in which all samples of `mask` (n,) at `times` (n,) in s are true.

    Windows that are at most `max_gap` s apart are merged. Windows shorter than `min_length` s are omitted afterwards.
    """
    indices = np.flatnonzero(mask)
    if not len(indices):
        return []
    steps = np.diff(indices)
    is_gap = (steps > 1) & (times[indices[1:]] - times[indices[:-1]] > max_gap)
    first = np.concatenate(([indices[0]], indices[1:][is_gap]))
    last = np.concatenate((indices[:-1][is_gap], [indices[-1]]))
    windows = [Window(float(times[a]), float(times[b]), int(a), int(b)) for a, b in zip(first, last, strict=True)]
    return [window for window in windows if window.length >= min_length]
