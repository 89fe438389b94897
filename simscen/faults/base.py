"""Base classes of faults: the specification in YAML (`Fault`), and the effect of an active fault (`FaultEffect`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Protocol

from pydantic import BaseModel

from simscen.core.clock import Clock
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.records.disturbances import FAULT_TARGET_KINDS
from simscen.spec.base import LazySpec
from simscen.spec.choice import Choice

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    import numpy as np

    from simscen.core.environment.occupancy_grid import OccupancyGrid
    from simscen.core.geometry import Array, Pose3
    from simscen.core.messages.navigation import Belief
    from simscen.core.messages.sensor_data import Image, Reading, Scan


class SensorSimulator(Protocol):
    """Simulates measurements of a lidar or camera with another pose of the sensor, or without some objects."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Return the true distances (n,) in meters along the beams of a scan of the current tick.

        Distances above twice the maximum range of the scan are inf. Beams that point down end at the floor.

        error:    pose from which the lidar measures, in the frame of its nominal pose; None for the nominal pose
        without:  names of objects that the beams pass through
        """
        ...

    def image(self, error: Pose3) -> Image:
        """Return the current image of a camera at the pose `error`, in the frame of its nominal pose."""
        ...


@dataclass(frozen=True, eq=False)
class FaultSetting:
    """Target and run of an active fault: the second argument of `Fault.begin`.

    separation:  distance between left and right wheels in m; 0 for a drive without left and right wheels
    clock:       conversion between ticks (physics steps) and seconds
    now:         returns the current tick
    kind:        kind of the target; see `Fault.affects`
    simulator:   simulator of the target; None if the target is not a lidar or camera
    command:     command that the base executed when the fault began
    """

    separation: float = 0.0
    clock: Clock = field(default_factory=Clock)
    now: Callable[[], int] = lambda: 0
    kind: str = ""
    simulator: SensorSimulator | None = None
    command: Twist = STOP

    def seconds_since(self, tick: int) -> float:
        """Return the simulated seconds between `tick` and now."""
        return self.clock.seconds(self.now() - tick)


@dataclass(frozen=True)
class FaultTarget:
    """Target of a fault: a sensor, cmd_vel, the wheels, the localizer, or the map.

    kind:  kind of the target; see `Fault.affects`
    rate:  messages per second; 0 if unknown
    spec:  specification of a sensor, or for `wheels`, of the robot's drive; None for other targets
    """

    kind: str
    rate: float = 0.0
    spec: object = None


class FaultEffect:
    """Effect of an active fault on readings, commands, beliefs, and the map. This base class changes nothing.

    The methods must be deterministic for a given random generator, and must not modify their arguments.
    """

    changes_motion: ClassVar[bool] = False
    """Whether a fault of a sensor also changes the motion of the robot. If so, `command` is called as well."""

    def reading(self, reading: Reading) -> Reading | None:
        """Return the reading that the stack receives instead; None to drop or delay the reading.

        A fault with `measures_again` must not return None.
        """
        return reading

    def arriving_readings(self) -> Sequence[Reading]:
        """Remove and return the delayed readings that arrive now, oldest first. Called before `reading`."""
        return ()

    def command(self, command: Twist) -> Twist | None:
        """Return the command that the base executes instead; None to drop or delay the command (only on cmd_vel)."""
        return command

    def arriving_command(self) -> Twist | None:
        """Remove the delayed commands that arrive now, and return the newest one, or None. Called before `command`."""
        return None

    def belief(self, belief: Belief) -> Belief:
        """Return the belief (estimated pose) that the navigator receives instead."""
        return belief

    def map(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the map that the stack receives instead. Called once, before the stack starts."""
        return grid

    def end(self) -> FaultEffect | None:
        """End the fault. Return the effect that remains active afterwards, or None."""
        return None


class Fault(ABC):
    """Specification of a fault in a scenario."""

    affects: ClassVar[frozenset[str]]
    """Kinds of targets that the fault can be applied to: class names of readings ("Scan", "Odometry", …), "Command" for
    cmd_vel, "Wheels" for the wheels, "Belief" for the localizer, and "Map" for the map."""
    keys_by_kind: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Keys that apply to each kind of target. All keys apply to kinds that are not listed."""
    measures_again: ClassVar[bool] = False
    """Whether the fault simulates the measurement again. If so, the fault acts at the tick of the measurement: before
    the latency of the sensor and before all other faults."""
    neutral_values: ClassVar[Mapping[str, object]] = {}
    """Values of the keys with which the fault has no effect; {} if the fault always has an effect."""

    @classmethod
    def definition_problem(cls) -> str:
        """Return the reason why `affects` of this class is invalid, or ""."""
        affects: object = getattr(cls, "affects", None)
        is_valid = isinstance(affects, frozenset) and affects and affects <= set(FAULT_TARGET_KINDS)
        return "" if is_valid else f"its `affects` is not a set of {', '.join(FAULT_TARGET_KINDS)}"

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        """Return (key, reason) for the first key that does not suit the target; None if all keys do.

        The key "" stands for the whole fault. The default compares the keys in the scenario with `keys_by_kind`.
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
        """Start the fault and return its effect. `rng` is reserved for this fault."""


class AnyFault(Choice):
    """YAML entry of one fault: its name as the only key, with its specification as the value."""

    group: ClassVar[str] = "fault"
    """Registry group in which installed packages can add faults."""

    off: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Off")] = None
    dropout: Annotated[Fault | None, LazySpec("simscen.faults.message_loss", "Dropout")] = None
    beam_dropout: Annotated[Fault | None, LazySpec("simscen.faults.lidar_beams", "BeamDropout")] = None
    noise: Annotated[Fault | None, LazySpec("simscen.faults.noise", "Noise")] = None
    bias: Annotated[Fault | None, LazySpec("simscen.faults.systematic_errors", "Bias")] = None
    slip: Annotated[Fault | None, LazySpec("simscen.faults.actuation", "Slip")] = None
    glass: Annotated[Fault | None, LazySpec("simscen.faults.lidar_environment", "Glass")] = None
    extrinsic: Annotated[Fault | None, LazySpec("simscen.faults.extrinsic", "Extrinsic")] = None
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
