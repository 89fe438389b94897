"""`travelled`: the robot has driven a distance."""

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import NonNegativeLength
from simscen.triggers.base import Condition


class Travelled(Value[NonNegativeLength], Condition):
    """True once the robot has truly driven this far since the start; being kidnapped is no drive.

    Example: `when: {travelled: 2.5 m}`
    """

    def holds(self, now: Situation) -> bool:
        """The driven distance has reached the length."""
        return now.travelled >= self.root
