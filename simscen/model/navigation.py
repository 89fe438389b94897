"""How a robot is sent to its goals, with the names of Nav2's actions, and what a scenario expects of each."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from simscen.core.messages.goal_names import FAILED, Mode
from simscen.spec.base import Spec
from simscen.spec.lazy_spec import LazySpec
from simscen.spec.quantities import Duration, PositiveLength


class Navigation(Spec):
    """Which action takes the goals, and how often they are driven to.

    Example: `navigation: {mode: follow_waypoints, loops: 3}`
    """

    mode: Mode = "navigate_to_pose"
    """`navigate_to_pose`: one goal after the other, each reached at a stop. `navigate_through_poses`: one drive through
    all of them, on one plan, with a stop at the last alone. `follow_waypoints`: as navigate_to_pose, by the waypoint
    follower: it knows the whole list, and what fails it is STOP_ON_MISSED_WAYPOINT."""
    loops: Annotated[int, Field(ge=1, le=1000)] = 1
    """How often the list of goals is driven. From the second time on a goal is called `shelf#2`, `shelf#3`, …; its bare
    name means it in every loop."""
    radius: PositiveLength = 0.7
    """How near the robot has to come to a pose that it drives through (m): the radius of Nav2's RemovePassedGoals. A
    goal's own `xy_tolerance` takes its place."""


def _text_or_mapping(value: Any) -> str:
    return "text" if isinstance(value, str) else "mapping"


Expectation = Annotated[
    Annotated[Literal["succeeded", "failed"], Tag("text")]
    | Annotated[Spec, LazySpec("simscen.model.expected_error", "ExpectedError"), Tag("mapping")],
    Discriminator(_text_or_mapping),
]


def failure_of(expected: "Expectation") -> str:
    """How the robot is to fail: "failed", or the name of a code; "" where it is to arrive."""
    code = getattr(expected, "error_code", None)
    if code is not None:
        return str(code.name)
    return FAILED if expected == "failed" else ""


class OnReached(Spec):
    """What the robot does where it has arrived, before it goes on.

    Example: `on_reached: {wait: 5 s}`
    """

    wait: Duration = 0.0
    """Simulated seconds to stay (Nav2's WaitAtWaypoint)."""
