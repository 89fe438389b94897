"""Recorded run on the lockstep clock: one Moment per beat, and sampled signals.

The MCAP recorder and the TraceBuilder process the same moments, and reading a log gives the same Trace. A run can
therefore be judged later without a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, Path
from simscen.core.messages.sensor_data import Odometry, Readings
from simscen.core.records.events import Event, EventKind

if TYPE_CHECKING:
    import numpy.typing as npt

    Ticks = npt.NDArray[np.int64]
else:
    Ticks = object  # annotations are not evaluated; commands that only read files need no numpy


class Truth(NamedTuple):
    """True state of the robot: `pose` of its base in the world frame, `twist` in the base frame.

    `clearance` is the distance in m from the robot to the nearest obstacle, negative if they overlap, and at most the
    range that was searched. `objects` are the poses of movable objects.
    """

    pose: Pose3
    twist: Twist
    clearance: float
    objects: Mapping[str, Pose3] = MappingProxyType({})


class DeferredTruth(Protocol):
    """Sample of the ground truth that is computed on demand."""

    def truth(self) -> Truth:
        """Return the ground truth."""
        ...


class LogLine(NamedTuple):
    """Log message of a stack for /rosout: severity as in rcl_interfaces, name of the logger, and text."""

    level: int
    name: str
    text: str


class CostGrid(NamedTuple):
    """Published costmap: "global" or "local", its frame, and costs as occupancy 0 … 100 or -1, as in Nav2."""

    name: str
    frame: str
    grid: OccupancyGrid


@fast_dataclass(eq=False)
class Decision:
    """Output of the stack for a beat: its `command`, and what it publishes; None if there is nothing new.

    `odometry` contains the new output of its odometry filter, if it has one.
    """

    command: Twist
    belief: Belief | None = None
    plan: Path | None = None
    local_plan: Path | None = None
    events: tuple[Event, ...] = ()
    lines: tuple[LogLine, ...] = ()
    costmaps: tuple[CostGrid, ...] = ()
    odometry: tuple[Odometry, ...] = ()


@fast_dataclass(eq=False)
class Moment:
    """One beat of the lockstep: ground truth, readings with faults applied, decision of the stack, and events.

    `sample` is None on beats between two samples of the ground truth. `events` are those of the world and the scenario;
    `decision.events` are those of the stack. A trace contains both, in this order.
    """

    tick: int
    sample: Truth | DeferredTruth | None
    readings: Readings
    decision: Decision
    events: tuple[Event, ...] = ()

    @property
    def truth(self) -> Truth | None:
        """The true state of the robot; None on beats between two samples."""
        sample = self.sample
        return sample if sample is None or isinstance(sample, Truth) else sample.truth()


@dataclass(frozen=True, eq=False)
class Trace:
    """Complete run. The tick of a sample is the beat at which it arrived, even if it was measured earlier.

    truth:      x, y, yaw in the world              (m, m, rad)
    velocity:   vx, vy, wz in the base frame        (m/s, m/s, rad/s), at truth's ticks
    clearance:  hull to nearest obstacle            (m), at truth's ticks
    belief:     x, y, yaw in the map and the upper triangle of its covariance: xx, xy, xyaw, yy, yyaw, yawyaw
    odometry:   x, y, yaw in the odom frame, of the first odometry sensor
    command:    vx, vy, wz as sent to the wheels, on changes and at least 20 times per second
    objects:    name → x, y, yaw of movable objects, on changes and at least once per second
    scans:      ticks at which the stack received a scan
    """

    tick_rate: int
    truth: Samples
    velocity: Samples
    clearance: Samples
    belief: Samples
    odometry: Samples
    command: Samples
    scans: Ticks
    plans: tuple[Path, ...]
    events: tuple[Event, ...]
    objects: Mapping[str, Samples]
    end: int

    def seconds(self, tick: int) -> float:
        """Return the simulated time of a tick in s."""
        return tick / self.tick_rate

    def of_kind(self, *kinds: EventKind) -> tuple[Event, ...]:
        """Return the events of these kinds, in order."""
        return tuple(event for event in self.events if event.kind in kinds)

    def place(self, tick: int) -> tuple[float, float]:
        """Return the true position of the robot at a tick."""
        x, y, _ = self.truth.at(np.array([tick]))[0]
        return float(x), float(y)


@dataclass(frozen=True, eq=False)
class Samples:
    """Sampled signal: `ticks` (n,) in ascending order, and `values` (n, k)."""

    ticks: Ticks
    values: Array

    def __len__(self) -> int:
        return len(self.ticks)

    def at(self, ticks: Ticks) -> Array:
        """Return the latest value at each of `ticks` (sample and hold); before the first sample, the first value."""
        return self.values[np.maximum(np.searchsorted(self.ticks, ticks, side="right") - 1, 0)]
