"""`speed`: how fast the robot went."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field, model_validator

from simscen.core.verdict import Finding
from simscen.criteria import signals
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import at_most, undecided
from simscen.criteria.signal_values import inside as within
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAngularSpeed, PositiveSpeed
from simscen.spec.references import RegionName

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Speed(Spec, Criterion):
    """The robot never went too fast.

    What is measured: the largest true speed over ground, and the largest true turn rate, over the whole run, or while
        the robot's centre was in a region.
    When it fails: one is above its bound.
    Why this: limits in a controller's parameters are wishes; slopes, slip and overshoot decide.
    Source: ScenarioRunner's MaxVelocityTest.

    Inconclusive when the robot never was in the region: then nothing was tested.

    Example: `speed: {max: 0.5 m/s}`
    """

    max: PositiveSpeed | None = None
    """m/s over ground."""
    max_turn_rate: PositiveAngularSpeed | None = None
    """rad/s, either way."""
    in_: RegionName | None = Field(default=None, alias="in")
    """Only while the robot's centre is in this region, by name."""

    @model_validator(mode="after")
    def _some_bound(self) -> Speed:
        if self.max is None and self.max_turn_rate is None:
            raise ValueError("expected max or max_turn_rate")
        return self

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound."""
        wanted = [("speed", self.max, "m/s"), ("turn_rate", self.max_turn_rate, "rad/s")]
        return [self._fastest(trace, case, name, limit, unit) for name, limit, unit in wanted if limit is not None]

    def _fastest(self, trace: Trace, case: Case, name: str, limit: float, unit: str) -> Finding:
        what, told = name.replace("_", " "), f"≤ {limit:.2f} {unit}"
        signal = signals.speed(trace) if name == "speed" else signals.turn_rate(trace)
        if not len(signal):
            return undecided(what, "no velocity was recorded", told)
        inside = np.ones(len(signal), dtype=bool)
        if self.in_ is not None:
            if self.in_ not in case.regions:
                return undecided(what, f"the world has no region `{self.in_}`", told)
            where = signals.truth(trace).at(signal.ticks)[:, :2]
            inside = within(where, np.array(case.regions[self.in_], dtype=np.float64))
        if not inside.any():
            return undecided(what, f"the robot never was in `{self.in_}`", told)
        k = int(np.flatnonzero(inside)[np.argmax(signal.values[inside, 0])])
        context = "" if self.in_ is None else f"in {self.in_}"
        return at_most(what, float(signal.values[k, 0]), limit, unit, at=(trace, int(signal.ticks[k])), context=context)
