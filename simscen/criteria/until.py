"""`until`: a condition is true until another one is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.criteria.stl.condition import Condition, Release, until_horizon
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.stl.description import describe_until
from simscen.criteria.stl.robustness import EvaluationContext, until_robustness

if TYPE_CHECKING:
    from simscen.criteria.stl.robustness import Robustness


class Until(Release, TemporalCriterion):
    """A condition was true from the start until another one became true, and that happened in time.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the best
        release: the lesser of the margins of `release` there and of `hold` at every sample before it.
    When it fails: `release` was not true in the window, or `hold` was false before it was.
    Why this: order matters. Not to move before the map is there can be said neither with always nor with eventually.
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
        """Seconds until the first moment at which the release counts."""
        return until_horizon(self.release, self)

    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness, decided by the best release or by what broke `hold` before it."""
        return until_robustness(self.hold, self.release, self, context)
