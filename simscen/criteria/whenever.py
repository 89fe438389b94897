"""`whenever … then`: each time that something holds, something else must follow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import BaseModel

from simscen.core.verdict import Finding
from simscen.criteria.findings import undecided
from simscen.criteria.stl import condition
from simscen.criteria.stl import description as words
from simscen.criteria.stl.condition import Condition, Windowed
from simscen.criteria.stl.criterion import TemporalCriterion, temporal_finding
from simscen.criteria.stl.robustness import EvaluationContext, Robustness, response_robustness, robustness
from simscen.spec.base import Spec

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Whenever(Windowed):
    """At every moment at which one condition held, another did, which may look ahead: `then: {eventually: …}`.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the answer was worst among those at which the premise held.
    When it fails: the premise held at some sample, and the answer did not.
    Why this: a robot that gets lost, blind or too near must do something about it, each time and in time.
    Source: the bounded response pattern of Dwyer, Avrunin and Corbett 1999; robust semantics of Donzé and Maler 2010.

    Inconclusive when the premise never held, for then nothing was tested (unless `required: false`), and when the
    window of an answer goes on after the end of the run.

    Example: `{whenever: {signal: scan_age, op: ">", value: 0.3 s}, then: {eventually: {signal: speed, op: "<", value: 1 cm/s, within: 1 s}}}`
    """  # noqa: E501 (an example stands on one line)

    required: bool = True
    """Must it hold at least once? With `false`, a run in which it never did passes."""


class Response(Spec, TemporalCriterion):
    """A premise with its answer, as they stand beside each other in a scenario."""

    premise: Whenever
    answer: Condition

    @classmethod
    def of(cls, premise: BaseModel | None, answer: BaseModel | None) -> Response:
        """Both halves are validated already."""
        assert isinstance(premise, Whenever) and isinstance(answer, Condition)
        return cls.model_construct(premise=premise, answer=answer)

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return [*self.premise.comparisons(), *self.answer.comparisons()]

    @property
    def horizon(self) -> float:
        """All of the stretch in which the premise counts."""
        return condition.window_horizon("always", self.answer, self.premise)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The worst answer; that the premise never held is no pass."""
        happened: list[bool] = []

        def judge_both(scene: EvaluationContext) -> Robustness:
            window, premise = scene.window(self.premise), robustness(self.premise, scene)
            end = None if window.last is None else window.last + 1
            happened.append(bool((premise.high[window.first : end] > 0).any()))
            return response_robustness(premise, robustness(self.answer, scene), window, scene)

        told = words.describe_response(self.premise, self.answer)
        found = temporal_finding(trace, case, told, self.compared(), judge_both)
        if happened == [False] and self.premise.required:
            never = f"`{words.describe(self.premise)}` never held, so nothing was tested"
            return [undecided("", never, told, ["`required: false` lets such a run pass"])]
        return [found]
