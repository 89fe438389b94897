"""Metrics that installed packages add to those that every run reports."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

from simscen.spec.choice import Choice

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace
    from simscen.core.records.verdict import Evidence


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
