"""`clearance_below`: something is near the robot's hull."""

from simscen.core.stage import Situation
from simscen.spec.base import Value
from simscen.spec.quantities import PositiveLength
from simscen.triggers.base import Condition


class ClearanceBelow(Value[PositiveLength], Condition):
    """True while anything is nearer to the robot's hull than this (m).

    For what goes wrong where there is no room left: a scan that drops out in the doorway, a push beside the shelf.
    Walls, objects and other robots count; measured with each sample of the truth (`physics.truth_rate`).

    Example: `when: {clearance_below: 30 cm}`
    """

    def holds(self, now: Situation) -> bool:
        """The newest sample of the true clearance is below."""
        return now.clearance is not None and now.clearance < self.root
