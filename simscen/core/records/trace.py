"""The recorded run on the lockstep clock: one Moment per control step, and sampled signals.

The MCAP recorder and the TraceBuilder take the same moments, and a replayed log gives the same Trace, so that a run can
be judged later without a simulator.
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
    """The robot as it really is: `pose` of its base in the world, `twist` in its own frame.

    `clearance` is the distance in meters from the robot's hull to the nearest obstacle surface (negative when they
    overlap, at most the range that was searched). `objects` are the poses of things that move.
    """

    pose: Pose3
    twist: Twist
    clearance: float
    objects: Mapping[str, Pose3] = MappingProxyType({})


class DeferredTruth(Protocol):
    """A sample of the truth that is worked out when somebody asks for it."""

    def truth(self) -> Truth:
        """All of it."""
        ...


class LogLine(NamedTuple):
    """A line that a stack would write to /rosout: its severity in rcl_interfaces' numbers, who says it, and what."""

    level: int
    name: str
    text: str


class CostGrid(NamedTuple):
    """A costmap as a stack publishes it: "global" or "local", the frame it is in, and Nav2's costs as 0 … 100, -1."""

    name: str
    frame: str
    grid: OccupancyGrid


@fast_dataclass(eq=False)
class Decision:
    """What the stack made of a beat: its `command`, and what it would publish. None means: nothing new.

    `odometry` are the new readings of its odometry filter, if it has one.
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
    """One beat of the lockstep: truth, what the robot was told (faults applied), what it decided, what happened.

    `sample` is None on beats between two truth samples. `events` are the world's and the scenario's; the stack's own
    stay in `decision.events`. A trace holds both, in that order.
    """

    tick: int
    sample: Truth | DeferredTruth | None
    readings: Readings
    decision: Decision
    events: tuple[Event, ...] = ()

    @property
    def truth(self) -> Truth | None:
        """How the robot really is; None on beats between two samples."""
        sample = self.sample
        return sample if sample is None or isinstance(sample, Truth) else sample.truth()


@dataclass(frozen=True, eq=False)
class Trace:
    """A whole run. A sample's tick is the beat it came with, even when a reading was measured earlier.

    truth:      x, y, yaw in the world              (m, m, rad)
    velocity:   vx, vy, wz in the base frame        (m/s, m/s, rad/s), at truth's ticks
    clearance:  hull to nearest obstacle            (m), at truth's ticks
    belief:     x, y, yaw in the map and the upper triangle of its covariance: xx, xy, xyaw, yy, yyaw, yawyaw
    odometry:   x, y, yaw in the odom frame, of the first odometry sensor that spoke
    command:    vx, vy, wz as sent to the wheels, when it changes and at least 20 times a second
    objects:    name → x, y, yaw of moving things, when it changes and at least once a second
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
        """The simulated time of `tick` in seconds."""
        return tick / self.tick_rate

    def of_kind(self, *kinds: EventKind) -> tuple[Event, ...]:
        """The events of these kinds, in order."""
        return tuple(event for event in self.events if event.kind in kinds)

    def place(self, tick: int) -> tuple[float, float]:
        """Where the robot really was at `tick`."""
        x, y, _ = self.truth.at(np.array([tick]))[0]
        return float(x), float(y)


@dataclass(frozen=True, eq=False)
class Samples:
    """A signal: `ticks` (n,) ascending, `values` (n, k)."""

    ticks: Ticks
    values: Array

    def __len__(self) -> int:
        return len(self.ticks)

    def at(self, ticks: Ticks) -> Array:
        """The newest value at each of `ticks` (sample and hold); the first value before the first sample."""
        return self.values[np.maximum(np.searchsorted(self.ticks, ticks, side="right") - 1, 0)]
