"""`whenever … then`: each time that one condition is true, another one must be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import BaseModel

from simscen.criteria.stl.condition import Condition, Windowed, window_horizon
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.stl.description import describe_response
from simscen.criteria.stl.robustness import EvaluationContext, response_robustness
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.criteria.stl.robustness import Robustness


class Whenever(Windowed):
    """At every moment at which one condition was true, another one was; it may look ahead: `then: {eventually: …}`.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        worst answer among the moments at which the premise was true.
    When it fails: the premise was true at some sample, and the answer was not.
    Why this: a robot that is lost, blind or too near must react, each time and in time.
    Source: the bounded response pattern of Dwyer, Avrunin and Corbett 1999; robust semantics of Donzé and Maler 2010.

    Inconclusive if the premise was never known to be true, because then nothing was tested (unless `required: false`),
    and if the window of an answer goes on after the end of the run.

    Example: `{whenever: {signal: scan_age, op: ">", value: 0.3 s}, then: {eventually: {signal: speed, op: "<", value: 1 cm/s, within: 1 s}}}`
    """  # noqa: E501 (an example stands on one line)

    required: bool = True
    """Whether the premise must be true at least once. With `false`, a run in which it never was passes."""


class Response(Spec, TemporalCriterion):
    """A premise with its answer, which are separate keys of a scenario."""

    premise: Whenever
    answer: Condition

    @classmethod
    def of(cls, premise: BaseModel | None, answer: BaseModel | None) -> Response:
        """Return the criterion of two parts that are validated already."""
        assert isinstance(premise, Whenever) and isinstance(answer, Condition)
        return cls.model_construct(premise=premise, answer=answer)

    def compared(self) -> list[Condition]:
        """Return every comparison in both conditions."""
        return [*self.premise.comparisons(), *self.answer.comparisons()]

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_response(self.premise, self.answer)

    @property
    def horizon(self) -> float:
        """Seconds until the window ends in which the premise counts, and the last answer is due."""
        return window_horizon("always", self.answer, self.premise)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness, decided by the worst answer; undecided if the premise never was true."""
        premise, required = self.premise, self.premise.required
        return response_robustness(premise, self.answer, premise, context, required=required)
