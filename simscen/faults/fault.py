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

    @property
    def fault(self) -> Fault:
        """The fault that was chosen."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
