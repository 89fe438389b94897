"""The list of faults: a new one is one file and one line here."""

from typing import Annotated, ClassVar

from simscen.faults.base import Fault
from simscen.spec.choice import Choice
from simscen.spec.lazy import LazySpec


class AnyFault(Choice):
    """One thing that goes wrong."""

    group: ClassVar[str] = "fault"

    off: Annotated[Fault | None, LazySpec("simscen.faults.off", "Off")] = None
    dropout: Annotated[Fault | None, LazySpec("simscen.faults.dropout", "Dropout")] = None
    beam_dropout: Annotated[Fault | None, LazySpec("simscen.faults.beam_dropout", "BeamDropout")] = None
    noise: Annotated[Fault | None, LazySpec("simscen.faults.noise", "Noise")] = None
    bias: Annotated[Fault | None, LazySpec("simscen.faults.bias", "Bias")] = None
    slip: Annotated[Fault | None, LazySpec("simscen.faults.slip", "Slip")] = None
    glass: Annotated[Fault | None, LazySpec("simscen.faults.glass", "Glass")] = None
    extrinsic: Annotated[Fault | None, LazySpec("simscen.faults.extrinsic", "Extrinsic")] = None
    ghost: Annotated[Fault | None, LazySpec("simscen.faults.ghost", "Ghost")] = None
    rain: Annotated[Fault | None, LazySpec("simscen.faults.rain", "Rain")] = None
    dust: Annotated[Fault | None, LazySpec("simscen.faults.dust", "Dust")] = None
    sector: Annotated[Fault | None, LazySpec("simscen.faults.sector", "Sector")] = None
    range_limit: Annotated[Fault | None, LazySpec("simscen.faults.range_limit", "RangeLimit")] = None
    scale: Annotated[Fault | None, LazySpec("simscen.faults.scale", "Scale")] = None
    drift: Annotated[Fault | None, LazySpec("simscen.faults.drift", "Drift")] = None
    stuck: Annotated[Fault | None, LazySpec("simscen.faults.stuck", "Stuck")] = None
    garbage: Annotated[Fault | None, LazySpec("simscen.faults.garbage", "Garbage")] = None
    delay: Annotated[Fault | None, LazySpec("simscen.faults.delay", "Delay")] = None
    slow: Annotated[Fault | None, LazySpec("simscen.faults.slow", "Slow")] = None
    intermittent: Annotated[Fault | None, LazySpec("simscen.faults.intermittent", "Intermittent")] = None
    gain: Annotated[Fault | None, LazySpec("simscen.faults.gain", "Gain")] = None
    saturation: Annotated[Fault | None, LazySpec("simscen.faults.saturation", "Saturation")] = None
    low_battery: Annotated[Fault | None, LazySpec("simscen.faults.low_battery", "LowBattery")] = None
    jump: Annotated[Fault | None, LazySpec("simscen.faults.jump", "Jump")] = None
    shift: Annotated[Fault | None, LazySpec("simscen.faults.shift", "Shift")] = None
    outdated: Annotated[Fault | None, LazySpec("simscen.faults.outdated", "Outdated")] = None

    @property
    def fault(self) -> Fault:
        """The fault that was chosen."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
