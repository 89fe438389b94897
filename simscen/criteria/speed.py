"""`speed`: how fast the robot went."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import model_validator

from simscen.core.verdict import Finding
from simscen.criteria import signals
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import at_most, undecided
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAngularSpeed, PositiveSpeed

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.samples import Samples
    from simscen.core.trace import Trace


class Speed(Spec, Criterion):
    """The robot never went too fast.

    What is measured: the largest true speed over ground, and the largest true turn rate, over the whole run.
    When it fails: one is above its bound.
    Why this: limits in a controller's parameters are wishes; slopes, slip and overshoot decide.
    Source: ScenarioRunner's MaxVelocityTest.

    Example: `speed: {max: 0.5 m/s}`
    """

    max: PositiveSpeed | None = None
    """m/s over ground."""
    max_turn_rate: PositiveAngularSpeed | None = None
    """rad/s, either way."""

    @model_validator(mode="after")
    def _some_bound(self) -> Speed:
        if self.max is None and self.max_turn_rate is None:
            raise ValueError("expected max or max_turn_rate")
        return self

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        findings = [] if self.max is None else [_fastest(trace, signals.speed(trace), "speed", self.max, "m/s")]
        if self.max_turn_rate is not None:
            findings.append(_fastest(trace, signals.turn_rate(trace), "turn rate", self.max_turn_rate, "rad/s"))
        return findings


def _fastest(trace: Trace, signal: Samples, what: str, limit: float, unit: str) -> Finding:
    if not len(signal):
        return undecided(what, "no velocity was recorded", f"≤ {limit:.2f} {unit}")
    k = int(np.argmax(signal.values[:, 0]))
    return at_most(what, float(signal.values[k, 0]), limit, unit, at=(trace, int(signal.ticks[k])))
