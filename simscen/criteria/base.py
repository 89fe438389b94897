"""Base classes of criteria and of the metrics of plug-ins, and the specification that selects such a metric."""

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
    """Requirement on the trace of a run. Subclasses are the specifications of the entries of `pass`.

    `trace` is what the run recorded, and `case` what the scenario defines: goals, regions, footprint, time limit.
    *Given* the same trace and case *then* the findings are the same. Each bound that is checked gives a finding, so
    that no findings mean that nothing was checked.
    """

    @property
    def clearance_range(self) -> float:
        """Distance in m around the robot up to which clearance must be measured; 0 if the criterion does not use it."""
        return 0.0

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return 0.0

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """Evidence without which the criterion cannot be judged. By default (None) all that simscen records."""
        return None

    @abstractmethod
    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound that is checked, in the order of the specification."""


class Measure(ABC):
    """Metric of a plug-in, which a scenario requests under `metrics`. It has no bound and cannot fail a run.

    `trace` and `case` are those of Criterion. *Given* the same trace and case *then* the result is the same.
    """

    unit: ClassVar[str] = ""
    """SI unit of the number; "" for none."""

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """Evidence without which the metric cannot be computed. By default (None) all that simscen records."""
        return None

    @abstractmethod
    def measure(self, trace: Trace, case: Case) -> float | str:
        """Return the value in SI units, which must be finite, or the reason why this run has no value."""


class AnyMeasure(Choice):
    """Metric of an installed plug-in, selected by its key. simscen's own metrics are reported for every run."""

    group: ClassVar[str] = "metric"

    @property
    def measure(self) -> Measure:
        """The metric that is selected."""
        measure = self.chosen
        assert isinstance(measure, Measure)
        return measure
