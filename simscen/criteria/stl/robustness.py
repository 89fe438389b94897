"""Robustness of a condition at each sample of a run: the margin by which it is true; negative if it is false.

The robustness of a comparison is the distance of its signal from the limit; infinite for a yes-or-no signal.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.stl.condition import Condition
from simscen.criteria.stl.operators import SampleWindows

TIE_MARGIN = sys.float_info.min
"""Magnitude of the robustness if a signal equals its limit. The sign is positive for `>=` and `<=`."""

HOLD_VIOLATED, RESPONSE_DUE = "`hold` was false", "the response was due"
"""Texts in `Witness.notes`."""

Bound = Literal["low", "high"]
"""Lower or upper bound of the robustness."""


@dataclass(frozen=True)
class Witness:
    """Comparison that decides the robustness of a condition.

    `sample` is the index of the decisive sample. `value` is the value of the signal at this sample. `is_negated` is
    True below a `not` (False below two). `notes` are pairs of a text and the index of the sample that it describes.
    """

    comparison: Condition
    sample: int
    value: float
    is_negated: bool = False
    notes: tuple[tuple[str, int], ...] = ()

    def with_note(self, text: str, sample: int) -> Witness:
        """Return a copy with a note about a sample in front of the other notes."""
        return replace(self, notes=((text, sample), *self.notes))


@dataclass(frozen=True, eq=False)
class Robustness:
    """Lower and upper bound (n,) of the robustness of a condition at each sample.

    The bounds `low` and `high` differ where something is unknown, such as the time after the last sample. A condition
    is decided at a sample if `low` and `high` have the same sign, and certainly true if `low` is positive. `parts`
    contains the robustness of each operand. Each operator has a subclass.
    """

    low: Array
    high: Array
    parts: Sequence[Robustness]

    def bound(self, bound: Bound) -> Array:
        """Return the array of a bound."""
        return self.low if bound == "low" else self.high

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the comparison that decides a bound at a sample. The condition must be decided there."""
        raise NotImplementedError

    def untested_responses(self) -> Iterator[ResponseRobustness]:
        """Yield each `whenever` in the condition whose premise is required, but was never certainly true."""
        for part in self.parts:
            yield from part.untested_responses()

    def comparisons(self) -> Iterator[ComparisonRobustness]:
        """Yield the robustness of each comparison in the condition."""
        for part in self.parts:
            yield from part.comparisons()


@dataclass(frozen=True, eq=False)
class ComparisonRobustness(Robustness):
    """Robustness of a comparison. `values` (n,) are the values of its signal; nan where the signal is unknown."""

    comparison: Condition
    values: Array

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return this comparison."""
        return Witness(self.comparison, sample, float(self.values[sample]))

    def comparisons(self) -> Iterator[ComparisonRobustness]:
        """Yield this comparison."""
        yield self


@dataclass(frozen=True, eq=False)
class NegationRobustness(Robustness):
    """Robustness of `not`."""

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of the operand for the other bound, negated."""
        found = self.parts[0].witness(sample, "high" if bound == "low" else "low")
        return replace(found, is_negated=not found.is_negated)


@dataclass(frozen=True, eq=False)
class BooleanRobustness(Robustness):
    """Robustness of `all` or `any`."""

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of the first operand that has the robustness of the condition."""
        decides = next(part for part in self.parts if part.bound(bound)[sample] == self.bound(bound)[sample])
        return decides.witness(sample, bound)


@dataclass(frozen=True, eq=False)
class WindowRobustness(Robustness):
    """Robustness of `always` or `eventually`."""

    windows: SampleWindows

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of the operand at the first sample with the robustness of the condition."""
        (part,) = self.parts
        return part.witness(_first_equal(part.bound(bound), self.bound(bound)[sample], sample, self.windows), bound)


@dataclass(frozen=True, eq=False)
class UntilRobustness(Robustness):
    """Robustness of `until`. `parts` contains the robustness of `hold` and of `release`."""

    windows: SampleWindows

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of `release` at the best sample, or of `hold` if `hold` was less robust before it."""
        hold_part, release_part = self.parts
        end = int(self.windows.last[sample]) + 1
        first = int(self.windows.first[sample]) - sample
        hold, release = hold_part.bound(bound)[sample:end], release_part.bound(bound)[sample:end]
        before = np.concatenate(([math.inf], np.minimum.accumulate(hold)[:-1]))
        best = np.minimum(before, release)
        value = float(self.bound(bound)[sample])
        at = first + int(np.argmax(best[first:])) if first < len(best) else len(best)
        if at < len(best) and best[at] != value:  # a release after the run would be better, but `hold` was false before
            at = len(best)
        if at < len(best) and release[at] <= before[at]:
            decides = release_part.witness(sample + at, bound)
        else:
            decides = hold_part.witness(sample + int(np.argmin(hold[:at])), bound)
        false_samples = np.flatnonzero(np.signbit(hold))
        is_violated = np.signbit(value) and len(false_samples)
        return decides.with_note(HOLD_VIOLATED, sample + int(false_samples[0])) if is_violated else decides


@dataclass(frozen=True, eq=False)
class ResponseRobustness(Robustness):
    """Robustness of `whenever … then`: at all samples of a window, the premise is false or the response is true.

    `parts` contains the robustness of the premise and of the response. `implication` is the robustness of "the premise
    is false or the response is true". `premise_samples` is the range of samples at which the premise is checked. If
    `required`, the condition can pass only if the premise was certainly true at one of these samples.
    """

    implication: Robustness
    windows: SampleWindows
    premise_condition: Condition
    premise_samples: slice
    required: bool

    @property
    def was_tested(self) -> bool:
        """Whether the premise was certainly true at a sample."""
        return bool((self.parts[0].low[self.premise_samples] > 0).any())

    @property
    def may_be_tested(self) -> bool:
        """Whether the premise was true at a sample, or could have become true if the run had continued."""
        return bool((self.parts[0].high[self.premise_samples] > 0).any())

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of the worst response, with a note on the sample at which this response was due."""
        at = _first_equal(self.implication.bound(bound), self.bound(bound)[sample], sample, self.windows)
        return self.implication.witness(at, bound).with_note(RESPONSE_DUE, at)

    def untested_responses(self) -> Iterator[ResponseRobustness]:
        """Yield each `whenever`, including this one, whose premise is required, but was never certainly true."""
        if self.required and not self.was_tested:
            yield self
        yield from super().untested_responses()


def _first_equal(values: Array, value: float, sample: int, windows: SampleWindows) -> int:
    """Return the first sample in the window of `sample` at which `values` has the given value."""
    begin = int(windows.first[sample])
    return begin + int(np.argmax(values[begin:] == value))
