"""Specifications of the navigation mode, of the expected outcome of a goal, and of waiting at a goal."""

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from simscen.core.messages.goals import FAILED, Mode
from simscen.spec.base import LazySpec, Spec, text_or_mapping
from simscen.spec.quantities import Duration, PositiveLength


class Navigation(Spec):
    """Navigation action for the goals, and number of loops.

    Example: `navigation: {mode: follow_waypoints, loops: 3}`
    """

    mode: Mode = "navigate_to_pose"
    """Navigation action. `navigate_to_pose`: one goal after the other, with a stop at each. `navigate_through_poses`:
    all goals on one plan, with a stop only at the last. `follow_waypoints`: all goals with a stop at each. The waypoint
    follower receives the whole list; if it stops after a failed goal, its error code is STOP_ON_MISSED_WAYPOINT."""
    loops: Annotated[int, Field(ge=1, le=1000)] = 1
    """Number of times that the list of goals is driven. In later loops, the goals are named `shelf#2`, `shelf#3`, … The
    name `shelf` refers to the goal in every loop."""
    radius: PositiveLength = 0.7
    """Distance (m) within which a pose of navigate_through_poses counts as passed, as in Nav2's RemovePassedGoals. The
    `xy_tolerance` of a goal takes precedence."""


Expectation = Annotated[
    Annotated[Literal["succeeded", "failed"], Tag("a text")]
    | Annotated[Spec, LazySpec("simscen.criteria.error_codes", "ExpectedError"), Tag("a mapping")],
    Discriminator(text_or_mapping),
]
"""Expected outcome of a goal."""


def expected_failure_name(expected: "Expectation") -> str:
    """Return the expected failure of a goal: "failed", or the name of an error code; "" if the goal should succeed."""
    code = getattr(expected, "error_code", None)
    if code is not None:
        return str(code.name)
    return FAILED if expected == "failed" else ""


class OnReached(Spec):
    """What the robot does at a goal before it continues.

    Example: `on_reached: {wait: 5 s}`
    """

    wait: Duration = 0.0
    """Simulated time to wait at the goal (Nav2's WaitAtWaypoint)."""
