"""Base classes of criteria (Criterion) and of plug-in metrics (Measure), and the model of an entry of `metrics`."""

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
    """Requirement that a run must meet to pass. Subclasses are the specifications of the entries of `pass`.

    `judge` depends only on the trace (the recorded states, readings, and events of the run) and on the case (goals,
    regions, footprint, and time limit of the scenario).
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
        """Kinds of information that the log must contain; None if all kinds that simscen records are needed."""
        return None

    @abstractmethod
    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each bound that was checked. An empty list is an error."""


class Measure(ABC):
    """Metric of a plug-in, which a scenario requests under `metrics`. It has no bound and cannot fail a run.

    The value depends only on the trace and the case, as for a Criterion.
    """

    unit: ClassVar[str] = ""
    """SI unit of the value; "" for a value without a unit."""

    @property
    def evidence(self) -> frozenset[Evidence] | None:
        """Kinds of information that the log must contain; None if all kinds that simscen records are needed."""
        return None

    @abstractmethod
    def measure(self, trace: Trace, case: Case) -> float | str:
        """Return a finite value in SI units, or a text that states why the run has no value."""


class AnyMeasure(Choice):
    """Entry of `metrics`: a metric of an installed plug-in, selected by its key."""

    group: ClassVar[str] = "metric"

    @property
    def measure(self) -> Measure:
        """The selected metric."""
        measure = self.chosen
        assert isinstance(measure, Measure)
        return measure
