"""The criteria `always`, `eventually`, `until`, and `whenever … then`, which check conditions over time.

A condition compares signals, such as the clearance, with bounds. Its robustness is the margin by which it is true;
negative if it is false.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import BaseModel

from simscen.criteria.stl.condition import Condition, Release, Windowed, until_horizon, window_horizon
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.stl.description import describe_response, describe_until, describe_windowed
from simscen.criteria.stl.robustness import (
    EvaluationContext,
    response_robustness,
    until_robustness,
    windowed_robustness,
)
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.criteria.stl.robustness import Robustness


class WindowedCriterion(Windowed, TemporalCriterion):
    """Base class of `always` and `eventually`: a condition, and the window of time in which it is checked."""

    operator: ClassVar[Literal["always", "eventually"]]

    def all_comparisons(self) -> list[Condition]:
        """Return every comparison in the condition."""
        return list(self.comparisons())

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_windowed(self.operator, self, self)

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return window_horizon(self.operator, self, self)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the smallest robustness in the window for `always`, or the largest one for `eventually`."""
        return windowed_robustness(self.operator, self, self, context)


class Always(WindowedCriterion):
    """A condition is true at all times of the run, or of a part of it (a window).

    What is measured: the distance of each signal from its bound, at each sample of the truth. The margin is the
        smallest distance in the window.
    When it fails: the condition was false at a sample.
    Why this: the other criteria cover the most frequent requirements. This one covers all that signals can express.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the run ended before the end of the window, and the condition was never false until then.

    Example: `always: {signal: clearance, op: ">=", value: 10 cm}`
    """

    operator: ClassVar[Literal["always", "eventually"]] = "always"


class Eventually(WindowedCriterion):
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

    operator: ClassVar[Literal["always", "eventually"]] = "eventually"


class Until(Release, TemporalCriterion):
    """The condition `hold` is true until the condition `release` becomes true, which must happen within the window.

    What is measured: the distance of each signal from its bound, at each sample of the truth. For each
        sample, take the smallest of the distance of `release` at this sample and the distances of `hold` before it. The
        margin is the largest of these minima.
    When it fails: `release` was not true in the window, or `hold` was false before `release` became true.
    Why this: only this criterion can require an order, for example that a robot does not move before it is localized.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the run ended before the end of the window, with `hold` always true and `release` always false.

    Example: `until: {hold: {signal: speed, op: "<=", value: 0.01 m/s}, release: {signal: localized}, within: 5 s}`
    """

    def all_comparisons(self) -> list[Condition]:
        """Return every comparison in both conditions."""
        return [*self.hold.comparisons(), *self.release.comparisons()]

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_until(self.hold, self.release, self)

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return until_horizon(self.release, self)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness for the best sample at which `release` becomes true."""
        return until_robustness(self.hold, self.release, self, context)


class Whenever(Windowed):
    """Whenever one condition (the premise) is true, another condition (the response, `then`) is true as well.

    For a response within some seconds, write `then: {eventually: {…, within: 2 s}}`.

    What is measured: the distance of each signal from its bound, at each sample of the truth. The margin is the
        smallest margin of the response at all samples at which the premise was true.
    When it fails: at a sample, the premise was true and the response was false.
    Why this: a robot that is lost, blind, or too close to something must react in time, and each time.
    Source: the bounded response pattern of Dwyer, Avrunin and Corbett 1999; robust semantics of Donzé and Maler 2010.

    Inconclusive if the run ended before the time for a response was over. Also inconclusive if the premise was never
    true, because nothing was tested; `required: false` lets such a run pass.

    Example: `{whenever: {signal: scan_age, op: ">", value: 0.3 s}, then: {eventually: {signal: speed, op: "<", value: 1 cm/s, within: 1 s}}}`
    """  # noqa: E501 (an example is on one line)

    required: bool = True
    """Whether the premise must be true at least once. With `false`, a run in which it was never true passes."""


class Response(Spec, TemporalCriterion):
    """The criterion `whenever … then`, made of two keys of a scenario: the premise and the response."""

    premise: Whenever
    response: Condition

    @classmethod
    def of(cls, premise: BaseModel | None, response: BaseModel | None) -> Response:
        """Return the criterion for a premise (a Whenever) and a response (a Condition)."""
        assert isinstance(premise, Whenever) and isinstance(response, Condition)
        return cls.model_construct(premise=premise, response=response)

    def all_comparisons(self) -> list[Condition]:
        """Return every comparison in both conditions."""
        return [*self.premise.comparisons(), *self.response.comparisons()]

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_response(self.premise, self.response)

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return window_horizon("always", self.response, self.premise)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the smallest robustness of the response at the samples at which the premise was true."""
        premise, required = self.premise, self.premise.required
        return response_robustness(premise, self.response, premise, context, required=required)
