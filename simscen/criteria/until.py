"""`until`: something holds until something else does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.verdict import Finding
from simscen.criteria.stl import condition
from simscen.criteria.stl import description as words
from simscen.criteria.stl.condition import Condition, Release
from simscen.criteria.stl.criterion import TemporalCriterion, temporal_finding
from simscen.criteria.stl.robustness import robustness, until_robustness

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Until(Release, TemporalCriterion):
    """A condition held from the start until another one came true, and that came true in time.

    What is measured: how far each signal is from its bound at each sample of the truth; the margin is that of the best
        release: the lesser of how well it held and how well `hold` held at every sample before it.
    When it fails: `release` did not hold in the window, or `hold` was broken before it did.
    Why this: order matters: not to move before the map is there is neither always nor eventually.
    Source: signal temporal logic with the robust semantics of Donzé and Maler 2010, in discrete time.

    Inconclusive when the window goes on after the end of the run, with `hold` unbroken and nothing released.

    Example: `until: {hold: {signal: speed, op: "<=", value: 0.01 m/s}, release: {signal: localized}, within: 5 s}`
    """

    def compared(self) -> list[Condition]:
        """Every comparison in it."""
        return [*self.hold.comparisons(), *self.release.comparisons()]

    @property
    def horizon(self) -> float:
        """The first moment at which it may be released."""
        return condition.until_horizon(self.release, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment of the best release, or of what broke the hold before it."""
        return [
            temporal_finding(
                trace,
                case,
                words.describe_until(self.hold, self.release, self),
                self.compared(),
                lambda scene: until_robustness(
                    robustness(self.hold, scene), robustness(self.release, scene), scene.window(self), scene
                ),
            )
        ]
