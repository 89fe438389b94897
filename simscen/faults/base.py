"""What a fault is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Protocol

from simscen.core.clock import Clock
from simscen.core.records.events import FAULT_TARGET_KINDS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    import numpy as np

    from simscen.core.environment.occupancy_grid import OccupancyGrid
    from simscen.core.geometry import Array, Pose3
    from simscen.core.geometry.kinematics import Twist
    from simscen.core.messages.navigation import Belief
    from simscen.core.messages.sensor_data import Image, Reading, Scan


@dataclass(frozen=True)
class Wheels:
    """What a fault may know of the drive: distance between left and right wheels in meters (0 = has none)."""

    separation: float = 0.0


class Sight(Protocol):
    """What a sensor would see now if it sat elsewhere, or if something were not there."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """True distances (n,) in meters along the beams of a scan of now; inf where nothing is within its range.

        `error` is where the lidar really is in the frame in which it is thought to be; beams that point down end at
        the floor. What is called as in `without` lets them through.
        """
        ...

    def image(self, error: Pose3) -> Image:
        """What a camera shows now that is off by `error`."""
        ...


def _start() -> int:
    return 0


@dataclass(frozen=True, eq=False)
class FaultSetting(Wheels):
    """All that a fault may know besides its specification.

    separation:  between left and right wheels in meters (0 = has none)
    clock:       what makes seconds of ticks
    now:         the tick of this beat
    kind:        what it affects: one of its `affects`
    sight:       what a lidar or camera would see otherwise; None on anything else
    """

    clock: Clock = field(default_factory=Clock)
    now: Callable[[], int] = _start
    kind: str = ""
    sight: Sight | None = None


@dataclass(frozen=True)
class Instance:
    """What a fault is written on, as far as it is known before a run.

    kind:  one of the fault's `affects`
    rate:  messages a second; 0 = unknown
    spec:  the specification of the sensor, or of the drive for wheels; None where there is none
    """

    kind: str
    rate: float = 0.0
    spec: object = None


class Disturbance:
    """A fault at work, from its start to its end. The default changes nothing.

    *Given* the same readings and generator *then* the same answers. It never changes a reading it was handed; it
    answers with another one.
    """

    drives: ClassVar[bool] = False
    """Whether a fault on a sensor changes what is driven, too: then its `command` is asked at each beat."""

    def reading(self, reading: Reading) -> Reading | None:
        """What the stack gets instead of `reading`; None = it never arrives, or later."""
        return reading

    def arriving(self) -> Sequence[Reading]:
        """Readings that it kept back and that arrive at this beat, oldest first; asked before those of this beat."""
        return ()

    def command(self, command: Twist) -> Twist | None:
        """What the wheels do instead of `command`; None = that message never arrives, or later (cmd_vel only)."""
        return command

    def arriving_command(self) -> Twist | None:
        """The newest command that it kept back and that arrives at this beat; None = none. Asked before `command`."""
        return None

    def belief(self, belief: Belief) -> Belief:
        """What the navigator is told instead of the localizer's belief; asked once for each new one and each beat."""
        return belief

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        """What the stack is given instead of its map, before it starts."""
        return grid

    def end(self) -> Disturbance | None:
        """What stays when the fault is over; None = nothing."""
        return None


class Fault(ABC):
    """A fault as specified in a scenario; `affects` are the kinds of instance it makes sense on.

    Kinds are the class names of core.sensing readings ("Scan", "Odometry", …), "Command" for cmd_vel, "Wheels" for
    wheels, "Belief" for the localizer and "Map" for the map. Of a fault with keys that mean something on some kinds
    only, `keys_of` names them: kind → keys.
    """

    affects: ClassVar[frozenset[str]]
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    idle: ClassVar[Mapping[str, object]] = {}
    """Values of its keys with which it changes nothing; {} = it always changes something."""

    @classmethod
    def broken_promise(cls) -> str:
        """Why it is no specification of a fault; "" for one that is."""
        affects: object = getattr(cls, "affects", None)
        fine = isinstance(affects, frozenset) and affects and affects <= set(FAULT_TARGET_KINDS)
        return "" if fine else f"its `affects` is no set of {', '.join(FAULT_TARGET_KINDS)}"

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A key ("" = the whole) that makes no sense on an instance of a kind that it affects, and why."""
        return None

    @abstractmethod
    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Start it. `chance` is the fault's own stream."""
