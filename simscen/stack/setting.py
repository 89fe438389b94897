"""Input of a stack component besides its specification: robot, map, random generator, and functions of the stack."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Mode
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import Streams
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import Localizer, RobotModel, Surroundings

UNKNOWN_POSE = Estimate(None)
"""Estimate of a pose that is not known."""


@dataclass(frozen=True, eq=False)
class Setting:
    """Second argument of the constructor of a component or a stack: `Class(specification, setting)`.

    Units are SI and rad. The base frame has x forward and y to the left (REP 103).

    surroundings:     robot model, map, keepout and speed zones, names of the lidars, tick rate
    name:             name of the random stream: "planner", "controller", "localizer", "behavior#1", …, "stack"
    streams:          random streams by name, derived from the seed of the run; use `rng` for your own stream
    control_period:   time in s between two calls of a controller, goal checker, or behavior
    resolution:       cell size in m of the costmaps that the component gets
    estimate:         initial pose estimate, for a localizer outside a run; in a run, `reset` or `start` passes the
                      estimate later
    stop_on_failure:  whether a failed goal ends the task (for a whole stack)
    mode:             Nav2 action that the task imitates (for a whole stack)
    clear_costmap:    clears both costmaps, as described in `Costmaps.clear` (for a behavior)
    clear_around:     like `clear_costmap`, but only the area of the local costmap (for a behavior)
    trail:            returns the poses of the last minute in the odom frame, the oldest first (for a behavior)
    limit_command:    returns the command that the collision monitor would send, given a command and the pose in the
                      odom frame
    wrap_localizer:   returns a wrapper of the localizer that the other components use, such as a wrapper that injects
                      faults (for the reference stack)
    """

    surroundings: Surroundings
    name: str
    streams: Streams
    control_period: float = 0.05
    resolution: float = 0.05
    estimate: Estimate = UNKNOWN_POSE
    stop_on_failure: bool = True
    mode: Mode = "navigate_to_pose"
    clear_costmap: Callable[[], None] = lambda: None
    clear_around: Callable[[], None] = lambda: None
    trail: Callable[[], Sequence[Pose2]] = tuple
    limit_command: Callable[[Twist, Pose2], Twist] = lambda command, _: command
    wrap_localizer: Callable[[Localizer], Localizer] = lambda localizer: localizer

    def named(self, name: str) -> "Setting":
        """Return a copy for another component, whose random stream has this name."""
        return replace(self, name=name)

    @property
    def robot(self) -> RobotModel:
        """The robot model."""
        return self.surroundings.robot

    @property
    def map(self) -> OccupancyGrid | None:
        """The map; None for mapless navigation."""
        return self.surroundings.map

    @property
    def clock(self) -> Clock:
        """The clock that converts ticks of readings to seconds."""
        return Clock(self.surroundings.tick_rate)

    @cached_property
    def rng(self) -> np.random.Generator:
        """The random generator of the component, independent of the generators of other components."""
        return self.streams.generator(self.name)

    @cached_property
    def footprint(self) -> Footprint:
        """Collision checker of the robot: `footprint.free(costmap, poses)` returns which poses (n, 3) are free."""
        return _footprint(self.robot, self.resolution)


_footprint = lru_cache(maxsize=16)(Footprint)
"""Return the Footprint of a robot and a resolution, cached for all components."""
