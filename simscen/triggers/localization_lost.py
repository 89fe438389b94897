"""`localization_lost`: the robot does not know where it is."""

import math

from simscen.core.geometry import wrap
from simscen.core.messages.navigation import Belief
from simscen.core.stage import Situation
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAngle, PositiveLength
from simscen.triggers.base import Condition


class LocalizationLost(Spec, Condition):
    """True while the robot is lost: its belief is off by more than a planner can bear, or it says so itself.

    For what follows a kidnapping or a slip: stairs, a person, a new order while the robot drives by a wrong map in its
    head. `localization_error` looks at the position alone. Without any belief nothing is known to be lost.

    Example: `when: {localization_lost: {tolerance: 0.5 m, yaw_tolerance: 30 deg}, for: 1 s}`
    """

    tolerance: PositiveLength = 0.5
    """How far the believed position may be off (m)."""
    yaw_tolerance: PositiveAngle = 0.5236
    """How far the believed heading may be off (rad); 30° unless said otherwise."""
    std: PositiveLength | None = None
    """Lost, too, while the belief's own standard deviation of the position is larger than this (m), be it right or
    not; default: whatever it says of itself."""

    def holds(self, now: Situation) -> bool:
        """There is a belief, and it is off or unsure."""
        belief = now.belief
        if belief is None:
            return False
        off = now.robot.distance(belief.pose) > self.tolerance
        turned = abs(wrap(now.robot.yaw - belief.pose.yaw)) > self.yaw_tolerance
        return off or turned or (self.std is not None and _spread(belief) > self.std)


def _spread(belief: Belief) -> float:
    """Standard deviation of the position where it is least sure: the root of the larger eigenvalue of x and y."""
    xx, xy, yy = (float(belief.covariance[at]) for at in ((0, 0), (0, 1), (1, 1)))
    return math.sqrt(max(0.0, (xx + yy) / 2 + math.hypot((xx - yy) / 2, xy)))
