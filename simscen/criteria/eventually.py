"""`eventually`: something comes true."""

from typing import ClassVar, Literal

from simscen.criteria.stretched import Stretched


class Eventually(Stretched):
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
