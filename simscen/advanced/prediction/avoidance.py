"""Avoidance of moving obstacles: compares trajectories of the robot with the predicted positions of the obstacles.

As long as the controller's trajectory is safe, its command stays. Otherwise, a few hundred trajectories are compared:
the controller's own at lower speeds, and sequences of two velocities. The cost is the risk of coming too close, and
among safe trajectories the lack of progress. The robot therefore slows down early, passes behind obstacles, and steps
aside when it stands. (Trajectory rollouts as in Fox, Burgard, Thrun 1997 and, with moving obstacles, Seder and Petrović
2007.)
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from simscen.advanced.prediction.rollouts import HORIZON, TIMES, FollowedPath, Rollouts, TrajectorySampler, arc
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.guards import Prediction
from simscen.stack.footprint import CoveringDiscs
from simscen.stack.moving_obstacles import MAX_UNCERTAINTY_M, MovingObstacles, Reals
from simscen.stack.protocols import CostmapView, RobotModel

ROOM = 0.25
"""Distance in m to keep from moving obstacles, in addition to a standard deviation of their position."""
SOON = 1.2
"""Time in s in which the weight of a predicted event decays by a factor of e."""
SOONER: Array = np.exp(-TIMES / SOON)
NEAR, HIT, LASTING = 3.0, 10.0, 1.0
"""Weights of the closest approach, of a collision, and of the mean nearness."""
WALL, WALL_ROOM = 8.0, 0.08
"""Weight of a collision with a static obstacle, and the distance in m to keep from it."""
PROGRESS, BACKWARD, CHANGE, OWN = 1.0, 0.15, 0.08, 0.1
"""Weights of progress, of driving backward, of a changed command, and of not using the controller's trajectory."""
CALM = 0.02
"""Risk below which the controller's command stays."""
CALMER = 0.01
"""Risk below which the controller gets back control after avoidance."""
SLOWER = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Factors on the controller's speed that are tried on its own trajectory."""
AT_ONCE, ROUNDING = 64, 1e-9
"""Number of trajectories that are evaluated together, and the tolerance for rounding of their costs."""
NEARLY_ROUND = 0.15
"""Maximum difference in m of circumscribed and inscribed radius for which a robot counts as round."""


class Avoidance:
    """Replaces commands that lead too close to moving obstacles."""

    def __init__(self, spec: Prediction, robot: RobotModel, full_speed: float) -> None:
        """Take the parameters, the robot, and the full speed of its controller in m/s."""
        self._spec, self._robot = spec, robot
        self._speed = max(full_speed, 0.3)
        round_enough = robot.circumscribed_radius - robot.inscribed_radius < NEARLY_ROUND
        self._discs = CoveringDiscs(replace(robot, radius=robot.circumscribed_radius) if round_enough else robot)
        self._last: Twist | None = None

    @cached_property
    def _repertoire(self) -> TrajectorySampler:
        """Candidate velocities; built on first use because most runs do not need them."""
        return TrajectorySampler(self._robot, self._speed)

    def rest(self) -> None:
        """Reset, because nothing moves."""
        self._last = None

    def steer(
        self,
        wanted: Twist,
        pose: Pose2,
        twist: Twist,
        moving: MovingObstacles,
        costmap: CostmapView,
        path: FollowedPath | None,
        home: Pose2 | None = None,
    ) -> Twist:
        """Return the command to send instead of `wanted`; the same object if that is safe.

        All arguments are in one frame. `path` is the path that the robot follows; without one, it stays at `home`.
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

    def _clear(
        self, wanted: Twist, pose: Pose2, twist: Twist, moving: MovingObstacles, path: FollowedPath | None
    ) -> bool:
        """Return True if a quick check shows that the controller's trajectory comes close to nothing."""
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
        path: FollowedPath | None,
        home: Pose2 | None,
    ) -> Twist:
        """Return the first command of the trajectory with the lowest cost; the first one of several.

        The risk is only computed for trajectories that can be the best by their other costs, in order of these.
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
        """Return the costs (n,) of trajectories, with `least` m kept from walls; `other` is added to all."""
        cost = self._risk(ways, moving)
        progress = self._progress(ways.x[:, -1], ways.y[:, -1], pose, goal)
        cost += self._walls(ways, costmap, least) - PROGRESS * progress
        cost += BACKWARD * self._backward(ways.vx)
        cost += other
        cost += self._change(ways.commands)
        return cost

    def _own(
        self, wanted: Twist, pose: Pose2, twist: Twist, path: FollowedPath | None, parts: tuple[float, ...]
    ) -> Rollouts:
        """Return the controller's own trajectory at fractions of its speed."""
        if path is None or len(path) < 2 or wanted.vx == 0.0:
            return arc(pose, wanted, parts if wanted != STOP else (1.0,))
        return path.driven(pose, twist, wanted, parts, self._robot, not self._discs.centered)

    def _risk(self, ways: Rollouts, moving: MovingObstacles) -> Array:
        """Return the costs (n,) of trajectories for their nearness to moving obstacles."""
        worst, hit = self._discs.nearness(moving, ways.x, ways.y, ways.yaw, TIMES, ROOM)
        near = np.minimum(np.maximum(worst, 0.0), 2.0) ** 2 * SOONER
        risk: Array = NEAR * near.max(axis=1) + LASTING * near.mean(axis=1) + HIT * (hit * SOONER).max(axis=1)
        return risk

    def _walls(self, ways: Rollouts, costmap: CostmapView, least: float) -> Array:
        """Return the costs (n,) of trajectories for static obstacles that are closer than `least` m."""
        touched = (self._room(ways, costmap, np.s_[:, 1::2]) < least) * np.exp(-TIMES[1::2] / (2 * SOON))
        cost: Array = WALL * touched.max(axis=1)
        return cost

    def _room(self, ways: Rollouts, costmap: CostmapView, some: tuple[slice, int | slice]) -> Reals:
        """Return the distances in m of trajectories from static obstacles at some of their times."""
        return np.asarray(self._discs.clearance(costmap, ways.x[some], ways.y[some], ways.yaw[some]))

    def _goal(self, pose: Pose2, path: FollowedPath | None, home: Pose2 | None) -> tuple[float, float]:
        """Return the position that the robot should approach."""
        if path is not None:
            return path.ahead(pose, self._speed * HORIZON)
        return (pose.x, pose.y) if home is None else (home.x, home.y)

    def _progress(self, x: Array, y: Array, pose: Pose2, goal: tuple[float, float]) -> Array:
        """Return the progress (n,) of trajectories that end at x and y (n,), relative to full speed."""
        before = math.hypot(goal[0] - pose.x, goal[1] - pose.y)
        gain: Array = (before - np.hypot(x - goal[0], y - goal[1])) / (self._speed * HORIZON)
        return gain

    def _backward(self, vx: Array) -> Array:
        """Return the mean backward speed (n,) of trajectories with speeds (n, times), relative to full speed."""
        return np.asarray(np.maximum(-vx / self._speed, 0.0).mean(axis=1))

    def _change(self, commands: Array) -> Array:
        """Return the costs (n,) of commands (n, 2) for differing from the previous command."""
        if self._last is None:
            return np.zeros(len(commands))
        change = np.abs(commands[:, 0] - self._last.vx) / self._speed
        return np.asarray(CHANGE * (change + np.abs(commands[:, 1] - self._last.wz) / 3.0))


THERE, TURNED = 0.08, 0.15
"""Distance in m and angle in rad within which the robot is at its stand position."""
LEFT = 0.15
"""Distance in m from which the robot returns."""
PART, GAIN = 0.3, 1.0
"""Maximum speed of returning relative to full speed, and gain in 1/s of the speed on the distance."""
TURN = 1.0
"""Maximum turn rate in rad/s of returning."""
FACING = 0.4
"""Angle in rad to the line back above which the robot turns before it drives."""


class StandPosition:
    """Pose to which a standing robot returns after it has stepped aside: in a straight line, then by turning."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot and its full speed in m/s."""
        self._speed, self._turn = PART * full_speed, min(TURN, robot.max_angular)
        self._reverses, self._turns = robot.max_reverse > 0.0, robot.turning_radius == 0.0
        self._home: Pose2 | None = None
        self._away = False

    def leave(self) -> None:
        """Forget the pose, because the robot drives."""
        self._home, self._away = None, False

    def home(self, pose: Pose2, moving: bool) -> Pose2 | None:
        """Return the stand position, which is set when the first obstacle moves nearby; None before."""
        if self._home is None and moving:
            self._home = pose
        return self._home

    def back(self, pose: Pose2) -> Twist:
        """Return the command to return; STOP at the stand position, and for a robot that cannot turn in place."""
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
