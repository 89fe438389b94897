"""Specification of the failure of a goal that a scenario expects."""

from simscen.criteria.goal_outcomes import Code
from simscen.spec.base import Spec


class ExpectedError(Spec):
    """Error code with which a goal is expected to fail.

    Example: `expect: {error_code: GOAL_OCCUPIED}`
    """

    error_code: Code
    """Error code of Nav2, by name or number."""
