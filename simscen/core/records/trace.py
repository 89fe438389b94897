"""Recorded run: a Moment for each beat while the run is simulated, and the Trace of the whole run for judging it.

The simulation passes each Moment to the MCAP recorder and to the TraceBuilder. Reading the log gives the same Trace, so
that a run can be judged again without simulating it.
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
    """True state of the robot: `pose` of its base in the world frame, `twist` in the base frame.

    `clearance` is the distance in m from the robot to the nearest obstacle, negative if they overlap, and cut off at
    `Case.clearance_range`. `objects` are the poses of movable objects in the world frame, by name.
    """

    pose: Pose3
    twist: Twist
    clearance: float
    objects: Mapping[str, Pose3] = MappingProxyType({})


class DeferredTruth(Protocol):
    """Sample of the ground truth that is computed only if it is needed."""

    def truth(self) -> Truth:
        """Return the ground truth."""
        ...


class LogLine(NamedTuple):
    """Log message of a stack for /rosout: `level` of severity as in rcl_interfaces, `name` of the logger, and text."""

    level: int
    name: str
    text: str


class CostGrid(NamedTuple):
    """Costmap as Nav2 publishes it: its `name`, "global" or "local", its frame, and the costs as 0 … 100 or -1."""

    name: str
    frame: str
    grid: OccupancyGrid


@fast_dataclass(eq=False)
class Decision:
    """Output of the stack for a beat: the velocity `command` for the base, and what the stack publishes.

    A belief or plan is None, and a tuple is empty, if nothing new is published. `lines` are log messages. `odometry` is
    the output of the odometry filter of the stack.
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

    `sample` is the sample of the ground truth; None on beats without one. `readings` are those that the stack received,
    with faults applied. `events` are those of the world and the scenario; `decision.events` are those of the stack. A
    trace contains both, in this order.
    """

    tick: int
    sample: Truth | DeferredTruth | None
    readings: Readings
    decision: Decision
    events: tuple[Event, ...] = ()

    @property
    def truth(self) -> Truth | None:
        """The true state of the robot; None on beats without a sample."""
        sample = self.sample
        return sample if sample is None or isinstance(sample, Truth) else sample.truth()


@dataclass(frozen=True, eq=False)
class Trace:
    """Recording of a whole run. The tick of a sample is the beat at which it arrived, even if it was measured earlier.

    Attributes:
        tick_rate: Ticks per second.
        truth: True x, y, yaw of the robot in the world frame (m, m, rad).
        velocity: True vx, vy, wz of the robot in the base frame (m/s, m/s, rad/s), at the ticks of `truth`.
        clearance: Distance from the hull to the nearest obstacle (m), at the ticks of `truth`.
        belief: Estimated x, y, yaw in the map frame, followed by the upper triangle of the covariance: xx, xy, xyaw,
            yy, yyaw, yawyaw.
        odometry: x, y, yaw in the odom frame, of the first odometry sensor.
        command: vx, vy, wz as sent to the wheels, at each change and at least 20 times per second.
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
    """Sampled signal: `ticks` (n,) in ascending order, and `values` (n, k), k values per sample."""

    ticks: Ticks
    values: Array

    def __len__(self) -> int:
        return len(self.ticks)

    def at(self, ticks: Ticks) -> Array:
        """Return the values (m, k) at each of the `ticks` (m,): those of the newest sample (sample and hold).

        Before the first sample, the values are those of the first sample.
        """
        return self.values[np.maximum(np.searchsorted(self.ticks, ticks, side="right") - 1, 0)]

    def select(self, chosen: npt.NDArray[Any] | slice) -> Samples:
        """Return the samples that an index array, a mask, or a slice selects."""
        return Samples(self.ticks[chosen], self.values[chosen])
