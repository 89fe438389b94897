"""`goals_reached`: the robot truly was where it was sent."""

from simscen.core.case import Case
from simscen.core.trace import Trace
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.spec.base import Spec


class GoalsReached(Spec, Criterion):
    """placeholder"""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """placeholder"""
        return []
