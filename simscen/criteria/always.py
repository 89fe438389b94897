"""`always`: something holds at every moment."""

from typing import ClassVar, Literal

from simscen.criteria.stretched import Stretched


class Always(Stretched):
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
