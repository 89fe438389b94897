"""Temporal criteria: `always`, `eventually`, `until`, and `whenever … then`."""

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
    """A condition that must be true at every moment or at some moment of a window, depending on the `operator`."""

    operator: ClassVar[Literal["always", "eventually"]]

    def compared(self) -> list[Condition]:
        """Return every comparison in the condition."""
        return list(self.comparisons())

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_windowed(self.operator, self, self)

    @property
    def horizon(self) -> float:
        """Minimum simulated time in s for a decision: the whole window, or its first moment."""
        return window_horizon(self.operator, self, self)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness, decided by the worst moment of `always` or the best of `eventually`."""
        return windowed_robustness(self.operator, self, self, context)


class Always(WindowedCriterion):
    """A condition is true at every moment of the run, or of a window of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the whole condition was nearest to being false.
    When it fails: the condition was false at some sample.
    Why this: the other criteria cover most tests; this one covers anything that has a signal.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the window goes on after the end of the run and the condition was not false before.

    Example: `always: {signal: clearance, op: ">=", value: 10 cm}`
    """

    operator: ClassVar[Literal["always", "eventually"]] = "always"


class Eventually(WindowedCriterion):
    """A condition is true at some moment of the run, or of a window of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the whole condition held best, or was nearest to holding.
    When it fails: the condition was true at no sample.
    Why this: that a robot arrived, or that a disturbance had an effect at all, is decided by a single moment.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the window goes on after the end of the run and the condition was not true before.

    Example: `eventually: {signal: goal_distance, op: "<=", value: 0.25 m, within: 60 s}`
    """

    operator: ClassVar[Literal["always", "eventually"]] = "eventually"


class Until(Release, TemporalCriterion):
    """The condition `hold` was true until the condition `release` became true, which happened within the window.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the best
        release: the lesser of the margins of `release` there and of `hold` at every sample before it.
    When it fails: `release` was not true in the window, or `hold` was false before it was.
    Why this: order matters. Neither always nor eventually can require that a robot does not move before it has a map.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, over samples.

    Inconclusive if the window goes on after the end of the run, with `hold` true so far and no release.

    Example: `until: {hold: {signal: speed, op: "<=", value: 0.01 m/s}, release: {signal: localized}, within: 5 s}`
    """

    def compared(self) -> list[Condition]:
        """Return every comparison in both conditions."""
        return [*self.hold.comparisons(), *self.release.comparisons()]

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_until(self.hold, self.release, self)

    @property
    def horizon(self) -> float:
        """Minimum simulated time in s for a decision: the first moment at which the release counts."""
        return until_horizon(self.release, self)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness, decided by the best release or by what broke `hold` before it."""
        return until_robustness(self.hold, self.release, self, context)


class Whenever(Windowed):
    """Whenever one condition (`whenever`) is true, another one (`then`) is true too, or becomes true in time.

    What is measured: how far each signal is from its bound at each sample of the truth. The margin is the smallest one
        of the response (`then`) over all samples at which the premise (`whenever`) was true.
    When it fails: at some sample, the premise was true and the response was not.
    Why this: a robot that is lost, blind, or too near must react, each time and in time; for a response within some
        seconds, write `then: {eventually: {…, within: 2 s}}`.
    Source: the bounded response pattern of Dwyer, Avrunin and Corbett 1999; robust semantics of Donzé and Maler 2010.

    Inconclusive if the premise was never known to be true, because then nothing was tested (unless `required: false`),
    and if the window of a response goes on after the end of the run.

    Example: `{whenever: {signal: scan_age, op: ">", value: 0.3 s}, then: {eventually: {signal: speed, op: "<", value: 1 cm/s, within: 1 s}}}`
    """  # noqa: E501 (an example is on one line)

    required: bool = True
    """Whether the premise must be true at least once. With `false`, a run in which it never was passes."""


class Response(Spec, TemporalCriterion):
    """The premise `whenever` and the response `then`, which are separate keys of a scenario."""

    premise: Whenever
    response: Condition

    @classmethod
    def of(cls, premise: BaseModel | None, response: BaseModel | None) -> Response:
        """Return the criterion of two validated parts."""
        assert isinstance(premise, Whenever) and isinstance(response, Condition)
        return cls.model_construct(premise=premise, response=response)

    def compared(self) -> list[Condition]:
        """Return every comparison in both conditions."""
        return [*self.premise.comparisons(), *self.response.comparisons()]

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_response(self.premise, self.response)

    @property
    def horizon(self) -> float:
        """Minimum simulated time in s for a decision: until the last response to a premise in the window is due."""
        return window_horizon("always", self.response, self.premise)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness, decided by the worst response; undecided if the premise never was true."""
        premise, required = self.premise, self.premise.required
        return response_robustness(premise, self.response, premise, context, required=required)
