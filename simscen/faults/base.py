"""Base classes of faults: the specification in YAML (`Fault`), and what it does while it is active (`FaultEffect`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Protocol

from pydantic import BaseModel

from simscen.core.clock import Clock
from simscen.core.records.events import FAULT_TARGET_KINDS
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    import numpy as np

    from simscen.core.environment.occupancy_grid import OccupancyGrid
    from simscen.core.geometry import Array, Pose3
    from simscen.core.geometry.kinematics import Twist
    from simscen.core.messages.navigation import Belief
    from simscen.core.messages.sensor_data import Image, Reading, Scan


class SensorSimulator(Protocol):
    """Simulates what the lidar or camera of a fault would measure from another pose or without some objects."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Return the true distances (n,) in meters along the beams of the current scan; inf beyond twice its range.

        `error` is the true pose of the lidar in the frame of its nominal pose; beams that point down end at the floor.
        Beams pass through the objects named in `without`.
        """
        ...

    def image(self, error: Pose3) -> Image:
        """Return the current image if the true pose of the camera, in the frame of its nominal pose, is `error`."""
        ...


def _tick_zero() -> int:
    return 0


@dataclass(frozen=True, eq=False)
class FaultSetting:
    """Everything that a running fault may know besides its specification.

    separation:  distance between left and right wheels in meters (0 for a drive without sides)
    clock:       conversion between ticks and seconds
    now:         returns the current tick
    kind:        kind of the target, one of the fault's `affects`
    simulator:   simulates readings of the sensor under other conditions; None if the target is no sensor
    """

    separation: float = 0.0
    clock: Clock = field(default_factory=Clock)
    now: Callable[[], int] = _tick_zero
    kind: str = ""
    simulator: SensorSimulator | None = None

    def seconds_since(self, tick: int) -> float:
        """Return the simulated seconds between `tick` and now."""
        return self.clock.seconds(self.now() - tick)


@dataclass(frozen=True)
class FaultTarget:
    """Target of a fault (a sensor, cmd_vel, the wheels, the localizer, or the map), as it is known before the run.

    kind:  one of the fault's `affects`
    rate:  messages per second; 0 if unknown
    spec:  specification of the sensor, or of the drive for `wheels`; None for other targets
    """

    kind: str
    rate: float = 0.0
    spec: object = None


class FaultEffect:
    """What a fault changes from its start to its end. The default implementation changes nothing.

    *Given* the same readings and generator *then* the results are the same. An effect never modifies a reading; it
    returns another one.
    """

    changes_motion: ClassVar[bool] = False
    """Whether a fault on a sensor also changes the motion of the robot; then `command` is called at each beat."""

    def reading(self, reading: Reading) -> Reading | None:
        """Return the reading that the stack receives instead; None to drop or hold it back."""
        return reading

    def arriving_readings(self) -> Sequence[Reading]:
        """Remove and return the held readings that arrive at this beat, oldest first; called before `reading`."""
        return ()

    def command(self, command: Twist) -> Twist | None:
        """Return the command that the wheels follow instead; None to drop or hold it back (cmd_vel only)."""
        return command

    def arriving_command(self) -> Twist | None:
        """Remove the held commands that arrive at this beat. Return the newest, or None; called before `command`."""
        return None

    def belief(self, belief: Belief) -> Belief:
        """Return the belief that the navigator receives; called for each new belief and at each beat."""
        return belief

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the map that the stack receives; called before the stack starts."""
        return grid

    def end(self) -> FaultEffect | None:
        """Return what remains in effect after the fault has ended, or None."""
        return None


class Fault(ABC):
    """Specification of a fault in a scenario; `affects` are the kinds of target that it can be applied to.

    Kinds are the class names of readings ("Scan", "Odometry", …), "Command" for cmd_vel, "Wheels" for wheels, "Belief"
    for the localizer, and "Map" for the map. If some keys only apply to some kinds, `keys_by_kind` maps each kind to
    its keys.
    """

    affects: ClassVar[frozenset[str]]
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    neutral_values: ClassVar[Mapping[str, object]] = {}
    """Values of the keys with which the fault has no effect; {} if it always has one."""

    @classmethod
    def definition_problem(cls) -> str:
        """Return why the class is not a valid fault specification, or ""."""
        affects: object = getattr(cls, "affects", None)
        is_valid = isinstance(affects, frozenset) and affects and affects <= set(FAULT_TARGET_KINDS)
        return "" if is_valid else f"its `affects` is not a set of {', '.join(FAULT_TARGET_KINDS)}"

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        """Return a key that does not apply to the target ("" for the whole fault) and the reason, or None.

        The default finds keys that were set but are not among the `keys_by_kind` of the target.
        """
        applicable = self.keys_by_kind.get(target.kind)
        if applicable is None:
            return None
        assert isinstance(self, BaseModel)
        given = [name for name in type(self).model_fields if name in self.model_fields_set]
        wrong = next((name for name in given if name not in applicable), None)
        only = f"only `{'`, `'.join(applicable)}` {'does' if len(applicable) == 1 else 'do'}"
        return None if wrong is None else (wrong, f"`{wrong}` does not apply there, {only}")

    @abstractmethod
    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        """Start the fault and return its effect. No other fault uses the generator `rng`."""


class AnyFault(Choice):
    """One fault, selected by its key."""

    group: ClassVar[str] = "fault"

    off: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Off")] = None
    dropout: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Dropout")] = None
    beam_dropout: Annotated[Fault | None, LazySpec("simscen.faults.lidar_beams", "BeamDropout")] = None
    noise: Annotated[Fault | None, LazySpec("simscen.faults.noise", "Noise")] = None
    bias: Annotated[Fault | None, LazySpec("simscen.faults.systematic_errors", "Bias")] = None
    slip: Annotated[Fault | None, LazySpec("simscen.faults.actuation", "Slip")] = None
    glass: Annotated[Fault | None, LazySpec("simscen.faults.lidar_environment", "Glass")] = None
    extrinsic: Annotated[Fault | None, LazySpec("simscen.faults.systematic_errors", "Extrinsic")] = None
    ghost: Annotated[Fault | None, LazySpec("simscen.faults.lidar_beams", "Ghost")] = None
    rain: Annotated[Fault | None, LazySpec("simscen.faults.lidar_environment", "Rain")] = None
    dust: Annotated[Fault | None, LazySpec("simscen.faults.lidar_environment", "Dust")] = None
    sector: Annotated[Fault | None, LazySpec("simscen.faults.lidar_beams", "Sector")] = None
    range_limit: Annotated[Fault | None, LazySpec("simscen.faults.lidar_beams", "RangeLimit")] = None
    scale: Annotated[Fault | None, LazySpec("simscen.faults.systematic_errors", "Scale")] = None
    drift: Annotated[Fault | None, LazySpec("simscen.faults.systematic_errors", "Drift")] = None
    stuck: Annotated[Fault | None, LazySpec("simscen.faults.corrupted_messages", "Stuck")] = None
    garbage: Annotated[Fault | None, LazySpec("simscen.faults.corrupted_messages", "Garbage")] = None
    delay: Annotated[Fault | None, LazySpec("simscen.faults.delay", "Delay")] = None
    slow: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Slow")] = None
    intermittent: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Intermittent")] = None
    gain: Annotated[Fault | None, LazySpec("simscen.faults.actuation", "Gain")] = None
    saturation: Annotated[Fault | None, LazySpec("simscen.faults.actuation", "Saturation")] = None
    low_battery: Annotated[Fault | None, LazySpec("simscen.faults.actuation", "LowBattery")] = None
    jump: Annotated[Fault | None, LazySpec("simscen.faults.localization_and_map", "Jump")] = None
    shift: Annotated[Fault | None, LazySpec("simscen.faults.localization_and_map", "Shift")] = None
    outdated: Annotated[Fault | None, LazySpec("simscen.faults.localization_and_map", "Outdated")] = None

    @property
    def fault(self) -> Fault:
        """Specification of the selected fault."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
