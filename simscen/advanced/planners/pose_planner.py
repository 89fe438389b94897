"""Planner over poses that is confined to near-shortest paths over a coarse grid."""

from collections.abc import Iterator

from simscen.advanced.planners.informed_set import InformedSet
from simscen.core.geometry import Pose2
from simscen.stack.planners.endpoints import Endpoints
from simscen.stack.planners.pose_planner import CLEARANCE_M, LESS_CLEARANCE_M, Attempt, PosePlanner
from simscen.stack.planners.pose_search import POSE_SPACING_M
from simscen.stack.planners.traversal_costs import TraversalCosts

ATTEMPTS = (
    (0.15, CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.15, LESS_CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, LESS_CLEARANCE_M, 0.1, POSE_SPACING_M),
    (0.3, 0.0, 0.2, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M),
    (2.0, 0.0, 0.4, POSE_SPACING_M / 10),
)
"""Slack of the informed set as a ratio, clearance in m, share of the iterations, and spacing of checks in m.

Cars need wider sets than discs because they swing out.
"""


class ConfinedPosePlanner(PosePlanner):
    """Plans over poses in the informed set: a tree cannot lose itself in a wrong room."""

    def _attempts(self, costs: TraversalCosts, ends: Endpoints, begin: Pose2, goal: Pose2) -> Iterator[Attempt]:
        """Yield the attempts in turn, in wider and wider informed sets."""
        informed = InformedSet(costs, (begin.x, begin.y), (goal.x, goal.y))
        for slack, clearance, share, spacing in ATTEMPTS:
            informed.narrow(slack)
            yield Attempt(informed.bounds(), informed.has, clearance, share, spacing)
