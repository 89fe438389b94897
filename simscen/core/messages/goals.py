"""Navigation goals, Nav2 actions that receive goals, and names of goals that are repeated in a loop."""

from __future__ import annotations

import re
from typing import Literal

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Pose2

Mode = Literal["navigate_to_pose", "navigate_through_poses", "follow_waypoints"]
"""Nav2 action that receives the goals: one goal at a time, all goals without stops, or all goals with stops."""
FAILED = "failed"
"""Value of the YAML key `expect`: the goal must fail, with any error code."""


@fast_dataclass()
class Goal:
    """Pose in the map frame that the robot must reach within the tolerances (m, rad).

    `timeout` is the maximum simulated time in s; None for no limit. If `via`, the robot passes the pose with any
    heading and without a stop, as in Nav2's NavigateThroughPoses. `wait` is the simulated time in s for which the robot
    stays at the goal, as in Nav2's WaitAtWaypoint.
    """

    name: str
    pose: Pose2
    xy_tolerance: float = 0.25
    yaw_tolerance: float = 0.25
    timeout: float | None = None
    via: bool = False
    wait: float = 0.0

    def at(self, pose: Pose2) -> Goal:
        """Return the same goal with another pose."""
        return Goal(self.name, pose, self.xy_tolerance, self.yaw_tolerance, self.timeout, self.via, self.wait)


def loop_goal_name(name: str, loop: int) -> str:
    """Return the name of a goal in a loop over the list of goals: `shelf` in loop 1, `shelf#2` in loop 2."""
    return name if loop == 1 else f"{name}#{loop}"


LOOP_GOAL_PATTERN = re.compile(r"(.+)#[0-9]+")
"""Pattern of the names that `loop_goal_name` returns for loops after the first."""


def goal_without_loop(name: str) -> str:
    """Return the name of a goal without the number of its loop: `shelf` for `shelf` and for `shelf#2`."""
    loop = LOOP_GOAL_PATTERN.fullmatch(name)
    return name if loop is None else loop[1]


def matches_goal_name(name: str, requested: str | None) -> bool:
    """Return whether `requested` selects the goal `name`.

    `shelf` selects the goal in every loop, `shelf#2` only in the second loop, and None selects all goals.
    """
    return requested is None or requested in (name, goal_without_loop(name))
