"""What goals are called, how they are driven to and how they may end: all that a scenario says of them in words."""

import re
from typing import Literal

Mode = Literal["navigate_to_pose", "navigate_through_poses", "follow_waypoints"]
"""Nav2's actions that take goals: one after the other, passed in one drive, or as waypoints with a task at each."""

FAILED = "failed"
"""How a goal is to end at which the robot is to fail with whatever code."""


def loop_goal_name(name: str, loop: int) -> str:
    """What a goal of that name is called when the list of goals is driven for the `loop`-th time."""
    return name if loop == 1 else f"{name}#{loop}"


LOOP_NAME = re.compile(r"(.+)#[0-9]+")
"""The name of a goal in a further loop."""


def matches_goal_name(name: str, asked: str | None) -> bool:
    """Whether a goal is the one that is asked for: `shelf` is `shelf` in every loop, `shelf#2` that of the second."""
    if asked is None or name == asked:
        return True
    loop = LOOP_NAME.fullmatch(name)
    return loop is not None and loop[1] == asked
