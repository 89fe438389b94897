"""The promises of a metric."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Any

from simscen.core.case import Case
from simscen.core.trace import Trace
from simscen.judge.sketch import sketch, sketch_case
from simscen.testing.contracts.component import heard
from simscen.testing.contracts.criterion import CASE, DRIVE, STANDS, TRACES
from simscen.testing.promise import Contract, demand, promise


@dataclass(frozen=True, eq=False)
class MetricContract(Contract):
    """Tried on the trace of a drive, of a robot that stands, and of a log that was cut off."""

    role = "metric"
    spec: Any
    subject: str = ""

    def measured(self, trace: Trace, case: Case, what: str) -> float | str:
        """What it says of a trace."""
        found: float | str = heard(f"measures {what}", self.spec.measure, trace, case)
        return found

    @promise
    def it_is_a_number_or_says_why_there_is_none(self) -> None:
        """Given any trace then it is a finite number, or a text that says why this run has none."""
        for what, words in TRACES.items():
            found: object = self.measured(sketch(words), sketch_case(CASE), what)
            number = isinstance(found, int | float) and not isinstance(found, bool) and math.isfinite(found)
            demand(number or (isinstance(found, str) and found), f"is {found!r} for {what}")

    @promise
    def the_same_trace_gives_the_same_number(self) -> None:
        """Given the same trace and case then the same number: no clock, no chance, nothing remembered."""
        first = self.measured(sketch(DRIVE), sketch_case(CASE), "a drive")
        self.measured(sketch(STANDS), sketch_case(CASE), "a robot that stands")
        again = self.measured(sketch(DRIVE), sketch_case(CASE), "a drive")
        demand(again == first, f"is {first} and then {again} for the same drive")

    @promise
    def a_trace_is_not_changed(self) -> None:
        """Given a trace then it is not changed: others look at it, too."""
        trace, case = sketch(DRIVE), sketch_case(CASE)
        before = copy.deepcopy((trace, case))
        self.measured(trace, case, "a drive")
        demand(repr((trace, case)) == repr(before), "the trace is not what it was")
