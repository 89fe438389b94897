"""Interface of pass criteria."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from simscen.core.records.verdict import Finding

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace
    from simscen.core.records.verdict import Evidence


class Criterion(ABC):
    """A requirement on a run that its trace either meets or not.

    *Given* the same trace and case *then* the findings are the same: a criterion looks at nothing else. Every bound
    that it checks yields a finding, so a criterion without findings has checked nothing.
    """

    @property
    def clearance_range(self) -> float:
        """Distance around the robot, in meters, in which it needs the clearance; 0 if it does not use it."""
        return 0.0

    @property
    def horizon(self) -> float:
        """Seconds of simulated time before which it cannot be known to hold."""
        return 0.0

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """What a log must hold for it to be decided; None for everything that a log of simscen holds."""
        return None

    @abstractmethod
    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound, in the order of the specification."""
