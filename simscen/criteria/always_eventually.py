"""What `always` and `eventually` have in common: a condition over a stretch of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from simscen.core.verdict import Finding
from simscen.criteria.stl import condition
from simscen.criteria.stl import description as words
from simscen.criteria.stl.condition import Condition, Windowed
from simscen.criteria.stl.criterion import TemporalCriterion, temporal_finding
from simscen.criteria.stl.robustness import robustness, windowed_robustness

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class WindowedCriterion(Windowed, TemporalCriterion):
    """A condition at every moment of a stretch, or at some moment of it, as the `operator` says."""

    operator: ClassVar[Literal["always", "eventually"]]

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return list(self.comparisons())

    @property
    def horizon(self) -> float:
        """How much of the run it needs: all of its stretch, or the first moment of it."""
        return condition.window_horizon(self.operator, self, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment that decides: where it was nearest to being broken, or where it held best."""
        told = words.describe_windowed(self.operator, self, self)
        return [
            temporal_finding(
                trace,
                case,
                told,
                self.compared(),
                lambda scene: windowed_robustness(robustness(self, scene), scene.window(self), scene, self.operator),
            )
        ]


# MERGED: `always`: something holds at every moment.
class Always(WindowedCriterion):
    """A condition held at every moment of the run, or of a stretch of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the condition as a whole was nearest to being broken.
    When it fails: it did not hold at some sample.
    Why this: the criteria that ship ask what most tests ask; this asks anything that has a signal.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, in discrete time.

    Inconclusive when the stretch goes on after the end of the run and the condition was not broken before.

    Example: `always: {signal: clearance, op: ">=", value: 10 cm}`
    """

    operator: ClassVar[Literal["always", "eventually"]] = "always"


# MERGED: `eventually`: something comes true.
class Eventually(WindowedCriterion):
    """A condition held at some moment of the run, or of a stretch of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the condition as a whole held best, or came nearest to holding.
    When it fails: it held at no sample.
    Why this: that a robot got where it should, or that a disturbance was felt at all, is a matter of one moment.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, in discrete time.

    Inconclusive when the stretch goes on after the end of the run and the condition did not hold before.

    Example: `eventually: {signal: goal_distance, op: "<=", value: 0.25 m, within: 60 s}`
    """

    operator: ClassVar[Literal["always", "eventually"]] = "eventually"
