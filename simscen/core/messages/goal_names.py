"""Names of goals, navigation modes, and expected failures of goals."""

import re
from typing import Literal

Mode = Literal["navigate_to_pose", "navigate_through_poses", "follow_waypoints"]
"""Nav2's navigation actions: one goal after the other, all goals in one drive, or waypoints with a task at each."""

FAILED = "failed"
"""Expected end of a goal that fails with any error code."""


def loop_goal_name(name: str, loop: int) -> str:
    """Return the name of a goal in the given loop over the list of goals, counted from 1."""
    return name if loop == 1 else f"{name}#{loop}"


LOOP_NAME = re.compile(r"(.+)#[0-9]+")
"""Name of a goal in a loop after the first."""


def matches_goal_name(name: str, asked: str | None) -> bool:
    """Return whether a goal matches a name: `shelf` matches in every loop, `shelf#2` only in the second."""
    if asked is None or name == asked:
        return True
    loop = LOOP_NAME.fullmatch(name)
    return loop is not None and loop[1] == asked
