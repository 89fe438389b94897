"""The list of faults: a new one is one file and one line here."""

from typing import Annotated, ClassVar

from simscen.faults.base import Fault
from simscen.spec.choice import Choice
from simscen.spec.ondemand import OnDemand


class AnyFault(Choice):
    """One thing that goes wrong."""

    group: ClassVar[str] = "fault"

    off: Annotated[Fault | None, OnDemand("simscen.faults.off", "Off")] = None
    dropout: Annotated[Fault | None, OnDemand("simscen.faults.dropout", "Dropout")] = None
    beam_dropout: Annotated[Fault | None, OnDemand("simscen.faults.beam_dropout", "BeamDropout")] = None
    noise: Annotated[Fault | None, OnDemand("simscen.faults.noise", "Noise")] = None
    bias: Annotated[Fault | None, OnDemand("simscen.faults.bias", "Bias")] = None
    slip: Annotated[Fault | None, OnDemand("simscen.faults.slip", "Slip")] = None
    glass: Annotated[Fault | None, OnDemand("simscen.faults.glass", "Glass")] = None
    extrinsic: Annotated[Fault | None, OnDemand("simscen.faults.extrinsic", "Extrinsic")] = None
    ghost: Annotated[Fault | None, OnDemand("simscen.faults.ghost", "Ghost")] = None
    rain: Annotated[Fault | None, OnDemand("simscen.faults.rain", "Rain")] = None
    dust: Annotated[Fault | None, OnDemand("simscen.faults.dust", "Dust")] = None
    sector: Annotated[Fault | None, OnDemand("simscen.faults.sector", "Sector")] = None
    range_limit: Annotated[Fault | None, OnDemand("simscen.faults.range_limit", "RangeLimit")] = None
    scale: Annotated[Fault | None, OnDemand("simscen.faults.scale", "Scale")] = None
    drift: Annotated[Fault | None, OnDemand("simscen.faults.drift", "Drift")] = None
    stuck: Annotated[Fault | None, OnDemand("simscen.faults.stuck", "Stuck")] = None
    garbage: Annotated[Fault | None, OnDemand("simscen.faults.garbage", "Garbage")] = None
    delay: Annotated[Fault | None, OnDemand("simscen.faults.delay", "Delay")] = None
    slow: Annotated[Fault | None, OnDemand("simscen.faults.slow", "Slow")] = None
    intermittent: Annotated[Fault | None, OnDemand("simscen.faults.intermittent", "Intermittent")] = None
    gain: Annotated[Fault | None, OnDemand("simscen.faults.gain", "Gain")] = None
    saturation: Annotated[Fault | None, OnDemand("simscen.faults.saturation", "Saturation")] = None
    low_battery: Annotated[Fault | None, OnDemand("simscen.faults.low_battery", "LowBattery")] = None
    jump: Annotated[Fault | None, OnDemand("simscen.faults.jump", "Jump")] = None
    shift: Annotated[Fault | None, OnDemand("simscen.faults.shift", "Shift")] = None
    outdated: Annotated[Fault | None, OnDemand("simscen.faults.outdated", "Outdated")] = None

    @property
    def fault(self) -> Fault:
        """The fault that was chosen."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
