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
    """Requirement on the trace of a run.

    *Given* the same trace and case *then* the findings are the same. Every checked bound yields a finding, so a
    criterion without findings has checked nothing.
    """

    @property
    def clearance_range(self) -> float:
        """Distance in m up to which the criterion needs the clearance; 0 if it does not use the clearance."""
        return 0.0

    @property
    def horizon(self) -> float:
        """Minimum simulated time in s for a decision."""
        return 0.0

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """Evidence in the log that the criterion needs; None for everything in a log of simscen."""
        return None

    @abstractmethod
    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound, in the order of the specification."""


class Measure(ABC):
    """Metric that a scenario requests for a run. Unlike a criterion, it has no bound and cannot fail a run.

    *Given* the same trace and case *then* the same number.
    """

    unit: ClassVar[str] = ""
    """SI unit of the number; "" for none."""

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """Evidence in the log that the metric needs; None for everything in a log of simscen."""
        return None

    @abstractmethod
    def measure(self, trace: Trace, case: Case) -> float | str:
        """Return the value, finite and in SI units, or the reason why this run has none."""


class AnyMeasure(Choice):
    """Metric of an installed package. The shipped metrics are reported for every run."""

    group: ClassVar[str] = "metric"

    @property
    def measure(self) -> Measure:
        """Selected metric."""
        measure = self.chosen
        assert isinstance(measure, Measure)
        return measure
