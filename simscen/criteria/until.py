"""`until`: something holds until something else does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.verdict import Finding
from simscen.criteria import condition_words as words
from simscen.criteria import horizon
from simscen.criteria.condition import Condition, Release
from simscen.criteria.formula import judged, released
from simscen.criteria.temporal import Temporal, finding

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Until(Release, Temporal):
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
        return horizon.released(self.release, self)

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The moment of the best release, or of what broke the hold before it."""
        return [
            finding(
                trace,
                case,
                words.until(self.hold, self.release, self),
                self.compared(),
                lambda scene: released(
                    judged(self.hold, scene), judged(self.release, scene), scene.window(self), scene
                ),
            )
        ]
