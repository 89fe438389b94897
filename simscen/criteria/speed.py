"""The criterion `speed`: bounds on the speed and the turn rate of the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field, model_validator

from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, undecided
from simscen.criteria.timeline import NEVER_ENABLED, enabled_spans
from simscen.criteria.trace_signals import ground_truth
from simscen.spec.base import Spec
from simscen.spec.places import RegionName, SpeedMask
from simscen.spec.quantities import Duration, NonNegativeSpeed, PositiveAngularSpeed, PositiveSpeed

if TYPE_CHECKING:
    from simscen.core.geometry import Array
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Ticks, Trace


class Speed(Spec, Criterion):
    """The robot never went too fast.

    What is measured: the largest true speed over ground and the largest true turn rate, over the whole run, or while
        the robot's center is in a region. With a mask of speed limits, also the difference between the true speed and
        the limit at the robot's true center. At each time, the highest limit within `grace` before and after this time
        counts.
    When it fails: the speed is above `max`, the turn rate is above `max_turn_rate`, or the speed is more than
        `tolerance` above the limit of the mask.
    Why this: on slopes, by slip, or by overshoot, a robot can exceed the limits that its controller is given.
    Source: ScenarioRunner's MaxVelocityTest.

    Inconclusive if the robot was never in the region, or if no stay in limited cells of the mask was longer than twice
    the `grace`. With `while_on`, also inconclusive if the zone was never on for longer than `grace`, or if the robot
    was not in the zone during this time.

    Example: `speed: {max: 0.5 m/s}`
    """

    max: PositiveSpeed | None = None
    """Maximum speed over ground in m/s."""
    max_turn_rate: PositiveAngularSpeed | None = None
    """Maximum absolute turn rate in rad/s."""
    in_: RegionName | None = Field(default=None, alias="in")
    """Check only while the robot's center is in the region with this name."""
    while_on: bool = False
    """Check only while the limit in the region is enabled by the action `speed_zone`; the check begins `grace` after
    the limit is enabled. Default: check the whole run."""
    mask: SpeedMask | None = None
    """Filter mask of speed limits: file, type, base and multiplier, as in `stack.speed_mask`.

    The stack receives the mask only if `stack.speed_mask` names it as well."""
    full_speed: PositiveSpeed | None = None
    """Speed that corresponds to 100 % in the mask."""
    tolerance: NonNegativeSpeed = 0.05
    """Maximum speed above a limit of the mask; only with `mask`."""
    grace: Duration = 1.0
    """Time that the robot may take to slow down after it enters cells of the mask with a lower limit, or after a zone
    is enabled. For the same time, the robot may already accelerate before it leaves such cells. Only with `mask` or
    `while_on`; `grace` does not apply when the robot enters the region `in`."""

    @model_validator(mode="after")
    def _check_keys(self) -> Speed:
        if self.max is None and self.max_turn_rate is None and self.mask is None:
            raise ValueError("expected max, max_turn_rate or mask")
        if self.while_on and (self.in_ is None or self.mask is not None):
            raise ValueError("while_on only applies to the zone of a region: give `in` and no mask")
        is_percent = self.mask is not None and self.mask.type == "percent"
        if is_percent and self.full_speed is None:
            raise ValueError("expected full_speed, to which the percentages of the mask refer (or `type: absolute`)")
        if not is_percent and self.full_speed is not None:
            raise ValueError("full_speed only applies to a mask of percentages")
        if self.mask is None and "tolerance" in self.model_fields_set:
            raise ValueError("tolerance only applies to a mask")
        if self.mask is None and not self.while_on and "grace" in self.model_fields_set:
            raise ValueError("grace only applies to a mask, or to a zone that is switched on (`while_on: true`)")
        return self

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        position = POSITION_EVIDENCE if self.in_ is not None or self.mask is not None else set()
        disturbances = {Evidence.DISTURBANCES} if self.while_on else set()
        return frozenset({Evidence.TRUTH, Evidence.VELOCITY, *position, *disturbances})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each given bound."""
        bounds = [("speed", self.max, "m/s"), ("turn_rate", self.max_turn_rate, "rad/s")]
        found = [
            self._judge_largest(trace, case, name, limit, unit) for name, limit, unit in bounds if limit is not None
        ]
        return found if self.mask is None else [*found, self._judge_mask(trace, case, self.mask)]

    def _judge_largest(self, trace: Trace, case: Case, name: str, limit: float, unit: str) -> Finding:
        """Return the finding for the largest value of the signal `name`, "speed" or "turn_rate"."""
        what, limit_text = name.replace("_", " "), f"≤ {limit:.2f} {unit}"
        signal = ground_truth.speed(trace) if name == "speed" else ground_truth.turn_rate(trace)
        if not len(signal):
            return undecided(what, "no velocity was recorded", limit_text)
        is_inside = self._is_inside(trace, case, signal)
        if is_inside is None:
            return undecided(what, f"the world has no region `{self.in_}`", limit_text)
        if self.while_on:
            spans = enabled_spans(trace, "speed", self.in_, self.grace)
            if not spans:
                return undecided(what, NEVER_ENABLED, limit_text)
            is_inside &= np.any([(first <= signal.ticks) & (signal.ticks <= last) for first, last in spans], axis=0)
        if not is_inside.any():
            because = f"the robot was never in `{self.in_}`{' while the zone was on' * self.while_on}"
            return undecided(what, because, limit_text)
        k = int(np.flatnonzero(is_inside)[np.argmax(signal.values[is_inside, 0])])
        context = "" if self.in_ is None else f"in {self.in_}"
        return at_most(what, float(signal.values[k, 0]), limit, unit, at=(trace, int(signal.ticks[k])), context=context)

    def _judge_mask(self, trace: Trace, case: Case, mask: SpeedMask) -> Finding:
        """Return the finding for the largest excess of the speed over the limits of a mask."""
        limit_text, signal = f"≤ the limits of {mask.file}", ground_truth.speed(trace)
        if not len(signal):
            return undecided("speed", "no velocity was recorded", limit_text)
        if mask.file not in case.masks:
            return undecided("speed", f"the log has no mask `{mask.file}`", limit_text)
        is_inside = self._is_inside(trace, case, signal)
        if is_inside is None:
            return undecided("speed", f"the world has no region `{self.in_}`", limit_text)
        limits = mask.speed_limits(case.masks[mask.file].grid)
        local_limits = limits.at_points(ground_truth.truth(trace).at(signal.ticks)[:, :2], self.full_speed or 0.0)
        highest = _sliding_maximum(local_limits, signal.ticks, round(self.grace * trace.tick_rate))
        is_limited = is_inside & np.isfinite(highest)
        if not is_limited.any():
            because = f"the robot was never in a limited part of the mask for longer than {2 * self.grace:g} s"
            return undecided("speed", because, limit_text)
        excess = np.where(is_limited, signal.values[:, 0] - highest, -np.inf)
        k = int(np.argmax(excess))
        value, limit = float(signal.values[k, 0]), float(highest[k]) + self.tolerance
        context = f"by {mask.file} (tolerance {self.tolerance:g} m/s)"
        return at_most("speed", value, limit, "m/s", at=(trace, int(signal.ticks[k])), context=context)

    def _is_inside(self, trace: Trace, case: Case, signal: Samples) -> ground_truth.Flags | None:
        """Return for each sample of `signal` whether the robot's center was in the region `in`; True without `in`.

        Return None if the world has no such region.
        """
        if self.in_ is None:
            return np.ones(len(signal), dtype=bool)
        if self.in_ not in case.regions:
            return None
        positions = ground_truth.truth(trace).at(signal.ticks)[:, :2]
        return points_in_polygon(case.regions[self.in_], positions)


def _sliding_maximum(values: Array, ticks: Ticks, reach: int) -> Array:
    """Return for each sample the largest value within `reach` ticks before and after."""
    first = np.searchsorted(ticks, ticks - reach, side="left")
    end = np.searchsorted(ticks, ticks + reach, side="right")
    padded = np.append(values, -np.inf)
    highest: Array = np.maximum.reduceat(padded, np.column_stack((first, end)).ravel())[::2]
    return highest
