"""Keeps out of the way of what moves, whoever drives: ways through time, compared with where things will be then.

As long as the way that the controller is on meets nothing, its command is left as it is. When something will come too
near, a few hundred ways are compared that the base can go from here: the controller's own way slower, and pairs of
velocities one after the other. The way that is least likely to be met costs least; among those that are safe, the one
that gets on. So the robot slows early, passes behind, and where it stands it steps aside: as a person would.
(Time-indexed rollouts as in Fox, Burgard, Thrun 1997 and, with moving things, Seder and Petrović 2007.)
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from simscen.advanced.prediction.rollouts import HORIZON, TIMES, Followed, Repertoire, Rollouts, arc
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.guards import Prediction
from simscen.stack.footprint import CoveringDiscs
from simscen.stack.moving_obstacles import MAX_UNCERTAINTY_M, MovingObstacles, Reals
from simscen.stack.protocols import CostmapView, RobotModel

ROOM = 0.25
"""Meters that the robot keeps off what moves, besides a standard deviation of where that will be."""
SOON = 1.2
"""Seconds in which what may happen counts e times less."""
SOONER: Array = np.exp(-TIMES / SOON)
NEAR, HIT, LASTING = 3.0, 10.0, 1.0
"""Cost of coming too near at the worst moment, of being hit, and of being too near all the time."""
WALL, WALL_ROOM = 8.0, 0.08
"""Cost of a way into something that stands, and meters kept off it."""
PROGRESS, BACKWARD, CHANGE, OWN = 1.0, 0.15, 0.08, 0.1
"""Gain of a way that goes ahead at full speed; cost of going backward, of another command than the last one, and of any
way but the controller's."""
CALM = 0.02
"""Risk below which the controller's way is left alone, …"""
CALMER = 0.01
"""… and below which it is given back to it."""
SLOWER = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Parts of the controller's speed that are tried on its own way."""
AT_ONCE, ROUNDING = 64, 1e-9
"""Ways that are looked at together, and what sums in another order may differ by."""
NEARLY_ROUND = 0.15
"""Meters between its inscribed and its circumscribed radius up to which a robot is taken for round."""


class Avoidance:
    """Changes a command when something that moves will be in its way."""

    def __init__(self, spec: Prediction, robot: RobotModel, full_speed: float) -> None:
        self._spec, self._robot = spec, robot
        self._speed = max(full_speed, 0.3)
        round_enough = robot.circumscribed_radius - robot.inscribed_radius < NEARLY_ROUND
        self._discs = CoveringDiscs(replace(robot, radius=robot.circumscribed_radius) if round_enough else robot)
        self._last: Twist | None = None

    @cached_property
    def _repertoire(self) -> Repertoire:
        """Takes a millisecond to make, and most robots never have to get out of anybody's way."""
        return Repertoire(self._robot, self._speed)

    def rest(self) -> None:
        """Nothing moves."""
        self._last = None

    def steer(
        self,
        wanted: Twist,
        pose: Pose2,
        twist: Twist,
        moving: MovingObstacles,
        costmap: CostmapView,
        path: Followed | None,
        home: Pose2 | None = None,
    ) -> Twist:
        """The command to give for the one that is wanted; the same object where nothing is in its way.

        All in one frame. `path` is what is followed; a robot that follows none belongs at `home`.
        """
        near = moving.near(pose.x, pose.y, self._robot.circumscribed_radius + MAX_UNCERTAINTY_M, self._speed, HORIZON)
        if not near.things:
            self._last = None
            return wanted
        if self._clear(wanted, pose, twist, near, path):
            self._last = None
            return wanted
        as_wanted = self._own(wanted, pose, twist, path, SLOWER[:1])
        if self._risk(as_wanted, near)[0] <= (CALM if self._last is None else CALMER):
            self._last = None
            return wanted
        self._last = self._best(self._own(wanted, pose, twist, path, SLOWER), pose, twist, near, costmap, path, home)
        return self._last

    def _clear(self, wanted: Twist, pose: Pose2, twist: Twist, moving: MovingObstacles, path: Followed | None) -> bool:
        """Whether the controller's own way is told at once to come near nothing: most that is in sight stays off."""
        if path is None or len(path) < 2 or wanted.vx == 0.0:
            return False
        place, speed, off = path.course(pose, twist, wanted, self._robot)
        return moving.surely_off(place, speed, self._discs.reach + off, ROOM, HORIZON)

    def _best(
        self,
        own: Rollouts,
        pose: Pose2,
        twist: Twist,
        moving: MovingObstacles,
        costmap: CostmapView,
        path: Followed | None,
        home: Pose2 | None,
    ) -> Twist:
        """The command that begins the way which costs least; the first of several that cost the same.

        Risks are worked out for the ways that could be it by what they cost besides, the cheapest first.
        """
        fan, goal = self._repertoire.roll(pose, twist), self._goal(pose, path, home)
        everything = np.arange(len(fan.commands))
        soon = np.s_[:, 1]
        room = max(self._room(each, costmap, soon).max() for each in (own, fan.ways(everything, 2)))
        least = min(WALL_ROOM, float(room))
        cost = self._cost(own, pose, goal, moving, costmap, least, 0.0)
        number = int(cost.argmin())
        best, command = (float(cost[number]), -1), own.commands[number]
        free = OWN + self._change(fan.commands) - PROGRESS * self._progress(*fan.ends, pose, goal)
        free += BACKWARD * self._backward(fan.vx)[fan.speed]
        order = free.argsort(kind="stable")
        for first in range(0, len(order), AT_ONCE):
            which = order[first : first + AT_ONCE]
            if free[which[0]] > best[0] + ROUNDING:
                break
            cost = self._cost(fan.ways(which), pose, goal, moving, costmap, least, OWN)
            found = float(cost.min())
            number = int(which[cost == found].min())
            if (found, number) < best:
                best, command = (found, number), fan.commands[number]
        return Twist(float(command[0]), 0.0, float(command[1]))

    def _cost(
        self,
        ways: Rollouts,
        pose: Pose2,
        goal: tuple[float, float],
        moving: MovingObstacles,
        costmap: CostmapView,
        least: float,
        other: float,
    ) -> Array:
        """What each way (n,) costs; `least` meters are kept off walls, `other` is added to all."""
        cost = self._risk(ways, moving)
        progress = self._progress(ways.x[:, -1], ways.y[:, -1], pose, goal)
        cost += self._walls(ways, costmap, least) - PROGRESS * progress
        cost += BACKWARD * self._backward(ways.vx)
        cost += other
        cost += self._change(ways.commands)
        return cost

    def _own(
        self, wanted: Twist, pose: Pose2, twist: Twist, path: Followed | None, parts: tuple[float, ...]
    ) -> Rollouts:
        """The controller's own way, at these parts of its speed."""
        if path is None or len(path) < 2 or wanted.vx == 0.0:
            return arc(pose, wanted, parts if wanted != STOP else (1.0,))
        return path.driven(pose, twist, wanted, parts, self._robot, not self._discs.centered)

    def _risk(self, ways: Rollouts, moving: MovingObstacles) -> Array:
        """What each way (n,) costs for what it comes near to."""
        worst, hit = self._discs.nearness(moving, ways.x, ways.y, ways.yaw, TIMES, ROOM)
        near = np.minimum(np.maximum(worst, 0.0), 2.0) ** 2 * SOONER
        risk: Array = NEAR * near.max(axis=1) + LASTING * near.mean(axis=1) + HIT * (hit * SOONER).max(axis=1)
        return risk

    def _walls(self, ways: Rollouts, costmap: CostmapView, least: float) -> Array:
        """What each way (n,) costs for what stands in it, nearer than `least` meters."""
        touched = (self._room(ways, costmap, np.s_[:, 1::2]) < least) * np.exp(-TIMES[1::2] / (2 * SOON))
        cost: Array = WALL * touched.max(axis=1)
        return cost

    def _room(self, ways: Rollouts, costmap: CostmapView, some: tuple[slice, int | slice]) -> Reals:
        """Meters from ways to what stands, of some of their moments."""
        return np.asarray(self._discs.clearance(costmap, ways.x[some], ways.y[some], ways.yaw[some]))

    def _goal(self, pose: Pose2, path: Followed | None, home: Pose2 | None) -> tuple[float, float]:
        """Where it is to get."""
        if path is not None:
            return path.ahead(pose, self._speed * HORIZON)
        return (pose.x, pose.y) if home is None else (home.x, home.y)

    def _progress(self, x: Array, y: Array, pose: Pose2, goal: tuple[float, float]) -> Array:
        """How far (n,) ways get that end at x and y (n,), as a part of what full speed would do."""
        before = math.hypot(goal[0] - pose.x, goal[1] - pose.y)
        gain: Array = (before - np.hypot(x - goal[0], y - goal[1])) / (self._speed * HORIZON)
        return gain

    def _backward(self, vx: Array) -> Array:
        """How much speeds (n, moments) go backward, as a part of full speed."""
        return np.asarray(np.maximum(-vx / self._speed, 0.0).mean(axis=1))

    def _change(self, commands: Array) -> Array:
        """What commands (n, 2) cost for being others than the last one."""
        if self._last is None:
            return np.zeros(len(commands))
        change = np.abs(commands[:, 0] - self._last.vx) / self._speed
        return np.asarray(CHANGE * (change + np.abs(commands[:, 1] - self._last.wz) / 3.0))


THERE, TURNED = 0.08, 0.15
"""Meters and rad within which the robot stands where it belongs."""
LEFT = 0.15
"""Meters from there at which it sets out to come back."""
PART, GAIN = 0.3, 1.0
"""Of full speed at most on the way back, and m/s for each meter that is left."""
TURN = 1.0
"""rad/s at most on the way back."""
FACING = 0.4
"""rad off its line beyond which it turns before it drives."""


class StandPosition:
    """Remembers the pose; the way back is straight, forward or backward, and last the heading is turned to."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        self._speed, self._turn = PART * full_speed, min(TURN, robot.max_angular)
        self._reverses, self._turns = robot.max_reverse > 0.0, robot.turning_radius == 0.0
        self._home: Pose2 | None = None
        self._away = False

    def leave(self) -> None:
        """It drives again."""
        self._home, self._away = None, False

    def home(self, pose: Pose2, moving: bool) -> Pose2 | None:
        """Where it belongs, once something moves around it; None while it need not care."""
        if self._home is None and moving:
            self._home = pose
        return self._home

    def back(self, pose: Pose2) -> Twist:
        """The command on the way back; STOP where it belongs, or when it cannot turn to its line."""
        home = self._home
        if home is None or not self._turns:
            return STOP
        distance = home.distance(pose)
        self._away = distance > (THERE if self._away else LEFT)
        if not self._away:
            turn = wrap(home.yaw - pose.yaw)
            return Twist(0.0, 0.0, self._turned(turn)) if abs(turn) > TURNED else STOP
        bearing = wrap(math.atan2(home.y - pose.y, home.x - pose.x) - pose.yaw)
        sign = -1.0 if abs(bearing) > math.pi / 2 and self._reverses else 1.0
        off = wrap(bearing + math.pi) if sign < 0 else bearing
        speed = min(self._speed, GAIN * distance) if abs(off) < FACING else 0.0
        return Twist(sign * speed, 0.0, self._turned(off))

    def _turned(self, angle: float) -> float:
        return math.copysign(min(self._turn, 2.0 * abs(angle)), angle)
