"""What a component of a stack is installed in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goal_names import Mode
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import Streams
from simscen.stack.footprint import Footprint
from simscen.stack.protocols import Localizer, RobotModel, Surroundings

UNKNOWN_POSE = Estimate(None)


@dataclass(frozen=True, eq=False)
class Setting:
    """All that a component, or a whole stack, may know besides its specification. `Class(specification, setting)`.

    SI units, angles in rad; the map frame is that of `map`, the base frame has x forward and y to the left.

    surroundings:     the robot's datasheet, its map, what it must not enter, its lidars by name, ticks a second
    name:             its random stream: "planner", "controller", "localizer", "behavior.spin", …, "stack"
    streams:          random streams by name, derived from the run's seed; `chance` is the one it should use
    control_period:   seconds between two calls of a controller, a goal checker or a behavior
    resolution:       meters, the edge of a cell of the costmaps that it is shown
    estimate:         where the robot is said to be when it is switched on; `reset` or `start` says it again
    stop_on_failure:  whether a goal that fails ends the task (for a whole stack)
    mode:             Nav2's action that takes the goals; what it means stands in the goals, as `via` and `wait`
    clear_costmap:    forgets live obstacles that are not seen any more (for a behavior)
    clear_around:     the same, as far from the robot as the local costmap reaches
    way:              the poses that the robot came by in the last minute, the oldest first, in the odom frame (for a
                      behavior)
    allowed:          what the collision monitor would make of a command at a pose in the odom frame (for a behavior)
    heard:            what stands between the localizer and all who ask it; here, nothing (for the reference stack)
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
    way: Callable[[], Sequence[Pose2]] = tuple
    allowed: Callable[[Twist, Pose2], Twist] = lambda command, _: command
    heard: Callable[[Localizer], Localizer] = lambda localizer: localizer

    def named(self, name: str) -> "Setting":
        """The same for another component, which has a random stream of its own."""
        return replace(self, name=name)

    @property
    def robot(self) -> RobotModel:
        """The robot's datasheet."""
        return self.surroundings.robot

    @property
    def map(self) -> OccupancyGrid | None:
        """The robot's map; None where it drives without one."""
        return self.surroundings.map

    @property
    def clock(self) -> Clock:
        """What makes seconds of the ticks that readings carry."""
        return Clock(self.surroundings.tick_rate)

    @cached_property
    def chance(self) -> np.random.Generator:
        """Its own random generator. Nobody else draws from it, so that it changes nobody else's numbers."""
        return self.streams.generator(self.name)

    @cached_property
    def footprint(self) -> Footprint:
        """Says whether the robot's hull fits at poses (n, 3) on a costmap: `footprint.free(costmap, poses)`."""
        return _footprint(self.robot, self.resolution)


_footprint = lru_cache(maxsize=16)(Footprint)
"""One for all who ask for it: it takes a millisecond to make, and nobody changes it."""
