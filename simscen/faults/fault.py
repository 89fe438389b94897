"""The list of faults: a new one is one file and one line here."""

from simscen.faults.base import Fault
from simscen.faults.beam_dropout import BeamDropout
from simscen.faults.bias import Bias
from simscen.faults.dropout import Dropout
from simscen.faults.noise import Noise
from simscen.faults.off import Off
from simscen.faults.slip import Slip
from simscen.spec.base import Choice


class AnyFault(Choice):
    """One thing that goes wrong."""

    off: Off | None = None
    dropout: Dropout | None = None
    beam_dropout: BeamDropout | None = None
    noise: Noise | None = None
    bias: Bias | None = None
    slip: Slip | None = None

    @property
    def fault(self) -> Fault:
        """The fault that was chosen."""
        fault = self.chosen
        assert isinstance(fault, Fault)
        return fault
