"""What `always` and `eventually` have in common: a condition over a stretch of the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

from simscen.core.verdict import Finding
from simscen.criteria import condition_words as words
from simscen.criteria import horizon
from simscen.criteria.condition import Condition, Windowed
from simscen.criteria.formula import in_time, judged
from simscen.criteria.temporal import Temporal, finding

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Stretched(Windowed, Temporal):
    """A condition at every moment of a stretch, or at some moment of it, as the `operator` says."""

    operator: ClassVar[Literal["always", "eventually"]]

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return list(self.comparisons())

    @property
    def horizon(self) -> float:
        """How much of the run it needs: all of its stretch, or the first moment of it."""
        return horizon.in_time(self.operator, self, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment that decides: where it was nearest to being broken, or where it held best."""
        told = words.in_time(self.operator, self, self)
        return [
            finding(
                trace,
                case,
                told,
                self.compared(),
                lambda scene: in_time(judged(self, scene), scene.window(self), scene, self.operator),
            )
        ]
