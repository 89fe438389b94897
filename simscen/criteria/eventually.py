"""`eventually`: something comes true."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.verdict import Finding
from simscen.criteria import condition_words as words
from simscen.criteria import horizon
from simscen.criteria.condition import Condition, Windowed
from simscen.criteria.formula import in_time, judged
from simscen.criteria.temporal import Temporal, finding

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Eventually(Windowed, Temporal):
    """A condition held at some moment of the run, or of a stretch of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the condition as a whole held best, or came nearest to holding.
    When it fails: it held at no sample.
    Why this: that a robot got where it should, or that a disturbance was felt at all, is a matter of one moment.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, in discrete time.

    Inconclusive when the stretch goes on after the end of the run and the condition did not hold before.

    Example: `eventually: {signal: goal_distance, op: "<=", value: 0.25 m, within: 60 s}`
    """

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return list(self.comparisons())

    @property
    def horizon(self) -> float:
        """The first moment of its stretch."""
        return horizon.in_time("eventually", self, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment at which it held best, or came nearest to it."""
        told = words.in_time("eventually", self, self)
        return [
            finding(
                trace,
                case,
                told,
                self.compared(),
                lambda scene: in_time(judged(self, scene), scene.window(self), scene, "eventually"),
            )
        ]
