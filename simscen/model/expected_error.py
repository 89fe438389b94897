"""A failure that a scenario expects of a goal."""

from simscen.criteria.goal_outcomes import Code
from simscen.spec.base import Spec


class ExpectedError(Spec):
    """The robot is to fail at this goal with this code.

    Example: `expect: {error_code: GOAL_OCCUPIED}`
    """

    error_code: Code
    """One of Nav2's, by name or number."""
