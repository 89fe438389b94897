"""Base classes of pass criteria and of metrics from plugins, and the choice of a metric by its key."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from simscen.core.records.verdict import Finding
from simscen.spec.choice import Choice

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


class Measure(ABC):
    """A number of a run that a scenario asks for. Unlike a criterion it has no bound: no run fails by it.

    *Given* the same trace and case *then* the same number. It looks at nothing else.
    """

    unit: ClassVar[str] = ""
    """Of the number, SI; "" = none."""

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """What a log must hold for it to be defined; None = everything that a log of simscen holds."""
        return None

    @abstractmethod
    def measure(self, trace: Trace, case: Case) -> float | str:
        """Return the value, finite and in SI units, or the reason why this run has none."""


class AnyMeasure(Choice):
    """A metric of an installed package; those that simscen ships are reported for every run."""

    group: ClassVar[str] = "metric"

    @property
    def measure(self) -> Measure:
        """The metric that was chosen."""
        measure = self.chosen
        assert isinstance(measure, Measure)
        return measure
