"""Registry of the fault types: maps each YAML key to the class that implements it."""

from typing import Annotated, ClassVar

from simscen.faults.base import Fault
from simscen.spec.choice import Choice
from simscen.spec.lazy_spec import LazySpec


class AnyFault(Choice):
    """One fault, chosen by its key."""

    group: ClassVar[str] = "fault"

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
        """The chosen fault."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
