"""Recording of a run: a Moment for each beat, and the Trace of the whole run.

A beat is a tick at which a sensor, the stack, or a sample of the ground truth is due.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

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
    Ticks = object  # annotations are not evaluated, and numpy's types take long to import


class Truth(NamedTuple):
    """Sample of the ground truth: `pose` of the robot's base in the world frame, `twist` in the base frame.

    `clearance` is the distance in m from the robot to the nearest obstacle, up to the measuring range; negative if the
    robot overlaps the obstacle. `objects` contains the poses of movable objects in the world frame, by name.
    """

    pose: Pose3
    twist: Twist
    clearance: float
    objects: Mapping[str, Pose3] = MappingProxyType({})


class DeferredTruth(Protocol):
    """Sample of the ground truth that is computed only if it is needed."""

    def truth(self) -> Truth:
        """Return the ground truth."""


class LogLine(NamedTuple):
    """Log message of a stack on /rosout, with the severity `level` of rcl_interfaces and the `name` of the logger."""

    level: int
    name: str
    text: str


class CostGrid(NamedTuple):
    """Published costmap: `name` is "global" or "local", and `grid` contains the costs as 0 … 100, or -1 if unknown.

    `frame` is the frame of the grid: map or odom.
    """

    name: str
    frame: str
    grid: OccupancyGrid


@fast_dataclass(eq=False)
class Decision:
    """Output of the stack at one beat: the velocity `command` in the base frame, and new messages.

    Attributes without a new message are None or empty. `belief` is the pose estimate, `lines` are log messages, and
    `odometry` is the output of the odometry filter.
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
    """Everything that is recorded at one beat.

    `sample` is the ground truth; None if no sample is due. `readings` are the readings that the stack received, with
    faults applied. `events` are the events of the world and the scenario; `decision` contains the events of the stack.
    """

    tick: int
    sample: Truth | DeferredTruth | None
    readings: Readings
    decision: Decision
    events: tuple[Event, ...] = ()

    @property
    def truth(self) -> Truth | None:
        """The ground truth; None if no sample was due."""
        sample = self.sample
        return sample if sample is None or isinstance(sample, Truth) else sample.truth()


@dataclass(frozen=True, eq=False)
class Trace:
    """Recording of one robot in a whole run. The tick of a sample is the beat at which it was recorded.

    Attributes:
        tick_rate: Ticks per second.
        truth: True x, y, yaw of the robot in the world frame (m, m, rad).
        velocity: True vx, vy, wz of the robot in the base frame (m/s, m/s, rad/s), at the ticks of `truth`.
        clearance: True distance from the robot to the nearest obstacle (m), at the ticks of `truth`.
        belief: Estimated x, y, yaw in the map frame, followed by the upper triangle of the covariance: xx, xy, xyaw,
            yy, yyaw, yawyaw.
        odometry: x, y, yaw of the first odometry sensor in the odom frame.
        command: Commanded vx, vy, wz of the base, at each change and at least 20 times per second.
        scans: Ticks at which the stack received a scan.
        plans: Plans in the order in which they were made.
        events: Events of the world, the scenario, and the stack, in order.
        objects: x, y, yaw of each movable object by name, at each change and at least once per second.
        end: Last tick of the run.
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
        """Return the true position (x, y) of the robot in m at a tick."""
        x, y, _ = self.truth.at(np.array([tick]))[0]
        return float(x), float(y)


@dataclass(frozen=True, eq=False)
class Samples:
    """Sampled signal with k values per sample: `ticks` (n,) in ascending order, and `values` (n, k)."""

    ticks: Ticks
    values: Array

    def __len__(self) -> int:
        return len(self.ticks)

    def at(self, ticks: Ticks) -> Array:
        """Return the values (m, k) of the newest sample at each of the `ticks` (m,).

        Ticks before the first sample get the values of the first sample.
        """
        return self.values[np.maximum(np.searchsorted(self.ticks, ticks, side="right") - 1, 0)]

    def select(self, selection: npt.NDArray[Any] | slice) -> Samples:
        """Return the samples of a selection: an index array, a mask, or a slice."""
        return Samples(self.ticks[selection], self.values[selection])
