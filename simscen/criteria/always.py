"""`always`: something holds at every moment."""

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


class Always(Windowed, Temporal):
    """A condition held at every moment of the run, or of a stretch of it.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the
        moment at which the condition as a whole was nearest to being broken.
    When it fails: it did not hold at some sample.
    Why this: the criteria that ship ask what most tests ask; this asks anything that has a signal.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, in discrete time.

    Inconclusive when the stretch goes on after the end of the run and the condition was not broken before.

    Example: `always: {signal: clearance, op: ">=", value: 10 cm}`
    """

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return list(self.comparisons())

    @property
    def horizon(self) -> float:
        """All of its stretch."""
        return horizon.in_time("always", self, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment at which it was nearest to being broken, or was broken worst."""
        told = words.in_time("always", self, self)
        return [
            finding(
                trace,
                case,
                told,
                self.compared(),
                lambda scene: in_time(judged(self, scene), scene.window(self), scene, "always"),
            )
        ]
