"""The promises of a metric."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Any

from simscen.core.records.verdict import Evidence
from simscen.testing.contracts.component import heard
from simscen.testing.contracts.criterion import CASE, DRIVE, STANDS, TRACES
from simscen.testing.promise import Contract, demand, promise
from simscen.testing.sketch import sketch, sketch_case


@dataclass(frozen=True, eq=False)
class MetricContract(Contract):
    """Tried on the trace of a drive, of a robot that stands, and of a log that was cut off."""

    role = "metric"
    spec: Any
    subject: str = ""

    def measured(self, words: dict[str, Any], what: str) -> float | str:
        """What it measures."""
        value: float | str = heard(f"measures {what}", self.spec.measure, sketch(words), sketch_case(CASE))
        return value

    @promise
    def it_is_a_number_or_says_why_there_is_none(self) -> None:
        """Given any trace then a finite number, or a text that says why there is none."""
        for what, words in TRACES.items():
            value = self.measured(words, what)
            if isinstance(value, str):
                demand(value, f"does not say why there is no number in {what}")
            else:
                number = isinstance(value, float | int) and not isinstance(value, bool) and math.isfinite(value)
                demand(number, f"measures {value!r} in {what}")

    @promise
    def the_same_trace_gives_the_same_number(self) -> None:
        """Given the same trace and case then the same number: no clock, no chance, nothing remembered."""
        first = self.measured(DRIVE, "a drive")
        self.measured(STANDS, "a robot that stands")
        demand(self.measured(DRIVE, "a drive") == first, "the same drive is measured otherwise")

    @promise
    def a_trace_is_not_changed(self) -> None:
        """Given a trace then it is not changed: criteria judge it, too."""
        trace, case = sketch(DRIVE), sketch_case(CASE)
        before = copy.deepcopy((trace, case))
        heard("measures a drive", self.spec.measure, trace, case)
        demand(repr((trace, case)) == repr(before), "the trace is not what it was")

    @promise
    def it_says_in_what_unit_and_of_what(self) -> None:
        """Given a metric then its unit is a text, and its evidence None or a set of what a log may hold."""
        demand(isinstance(self.spec.unit, str), f"has the unit {self.spec.unit!r}")
        evidence = heard("is asked for its evidence", getattr, self.spec, "evidence")
        fine = evidence is None or all(isinstance(each, Evidence) for each in evidence)
        demand(fine, f"needs {evidence!r}, which is no evidence")
