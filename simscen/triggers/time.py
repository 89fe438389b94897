"""`time`: the clock has reached a moment."""

from typing import ClassVar

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import Duration
from simscen.triggers.base import Condition


class Time(Value[Duration], Condition):
    """True from this simulated time on.

    Example: `when: {time: 10 s}`
    """

    of_a_robot: ClassVar[bool] = False

    def holds(self, now: Situation) -> bool:
        """The clock, which counts whole ticks, has reached the tick nearest to the time."""
        return now.tick >= now.clock.ticks(self.root)
