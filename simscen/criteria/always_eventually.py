"""`always` and `eventually`: a condition at every moment, or at some moment, of a window."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from simscen.criteria.stl.condition import Condition, Windowed, window_horizon
from simscen.criteria.stl.criterion import TemporalCriterion
from simscen.criteria.stl.description import describe_windowed
from simscen.criteria.stl.robustness import EvaluationContext, windowed_robustness

if TYPE_CHECKING:
    from simscen.criteria.stl.robustness import Robustness


class WindowedCriterion(Windowed, TemporalCriterion):
    """A condition at every moment, or at some moment, of a window, as the `operator` says."""

    operator: ClassVar[Literal["always", "eventually"]]

    def compared(self) -> list[Condition]:
        """Return every comparison in the condition."""
        return list(self.comparisons())

    def formula(self) -> str:
        """Return the condition in words."""
        return describe_windowed(self.operator, self, self)

    @property
    def horizon(self) -> float:
        """Seconds of the run it needs: the whole window, or its first moment."""
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
