"""What a criterion is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from simscen.core.verdict import Finding

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.evidence import Evidence
    from simscen.core.trace import Trace


class Criterion(ABC):
    """A question about a trace with a yes or no for an answer.

    *Given* the same trace and case *then* the same findings. It looks at nothing else, and every bound it checks
    yields a finding, so that a criterion without findings has checked nothing.
    """

    @property
    def clearance_range(self) -> float:
        """How far around the robot, in metres, it needs clearance to be searched; 0 where it does not look at it."""
        return 0.0

    @property
    def horizon(self) -> float:
        """Seconds of simulated time before which it cannot be known that it holds."""
        return 0.0

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """What a log must hold for it to be decided; None = everything that a log of simscen holds."""
        return None

    @abstractmethod
    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound, in the order of the specification."""
