"""The criteria `always`, `eventually`, `until`, and `whenever … then`, which check conditions over time.

A condition compares signals, such as the clearance, with bounds. Its robustness is the margin by which it is true;
negative if it is false.
"""

from __future__ import annotations

from pydantic import BaseModel

from simscen.criteria.stl.condition import Condition, UntilOperands, Whenever, WindowedCondition
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.spec.base import Spec


class Always(WindowedCondition, TemporalCriterion):
    """A condition is true at all times of the run, or of a part of it (a window).

    What is measured: the distance of each signal from its bound, at each sample of the truth. The margin is the
        smallest distance in the window.
    When it fails: the condition was false at a sample.
    Why this: the other criteria cover the most frequent requirements. This criterion covers all requirements that
        signals can express.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the run ended before the end of the window, and the condition was never false until then.

    Example: `always: {signal: clearance, op: ">=", value: 10 cm}`
    """

    @property
    def condition(self) -> Condition:
        """The condition `always` with this operand."""
        return Condition.model_construct(always=self)


class Eventually(WindowedCondition, TemporalCriterion):
    """A condition is true at least once in the run, or in a part of it (a window).

    What is measured: the distance of each signal from its bound, at each sample of the truth. The margin is the largest
        distance in the window.
    When it fails: the condition was true at no sample.
    Why this: some requirements must be met only once, for example that a robot arrives or that a disturbance has an
        effect.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the run ended before the end of the window, and the condition was never true until then.

    Example: `eventually: {signal: goal_distance, op: "<=", value: 0.25 m, within: 60 s}`
    """

    @property
    def condition(self) -> Condition:
        """The condition `eventually` with this operand."""
        return Condition.model_construct(eventually=self)


class Until(UntilOperands, TemporalCriterion):
    """The condition `hold` is true until the condition `release` becomes true, which must happen within the window.

    What is measured: the distance of each signal from its bound, at each sample of the truth. For each sample in the
        window, take the smallest of the distance of `release` at this sample and the distances of `hold` before it. The
        margin is the largest of these minima.
    When it fails: `release` was not true in the window, or `hold` was false before `release` became true.
    Why this: only this criterion can require an order, for example that a robot does not move before it is localized.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the run ended before the end of the window, with `hold` always true and `release` always false.

    Example: `until: {hold: {signal: speed, op: "<=", value: 0.01 m/s}, release: {signal: localized}, within: 5 s}`
    """

    @property
    def condition(self) -> Condition:
        """The condition `until` with these operands."""
        return Condition.model_construct(until=self)


class Response(Spec, TemporalCriterion):
    """The criterion `whenever … then`, which has two keys in a scenario: `whenever` is `premise`, `then` `response`."""

    premise: Whenever
    response: Condition

    @classmethod
    def of(cls, premise: BaseModel | None, response: BaseModel | None) -> Response:
        """Return the criterion for a premise (a Whenever) and a response (a Condition)."""
        assert isinstance(premise, Whenever) and isinstance(response, Condition)
        return cls.model_construct(premise=premise, response=response)

    @property
    def condition(self) -> Condition:
        """The condition `whenever … then` with these operands."""
        return Condition.model_construct(whenever=self.premise, then=self.response)
