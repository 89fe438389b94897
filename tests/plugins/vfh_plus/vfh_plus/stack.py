"""The stack: converts the readings of each beat to a velocity command."""

import math

import numpy as np

from simscen.plugin import (
    STOP,
    Array,
    Belief,
    Decision,
    ErrorCode,
    Estimate,
    Event,
    EventKind,
    Goal,
    Odometry,
    Path,
    Pose2,
    Readings,
    Scan,
    Setting,
    Task,
    Twist,
    wrap,
)  # fmt: skip
from vfh_plus.histogram import Histogram
from vfh_plus.memory import Memory
from vfh_plus.spec import VfhPlus
from vfh_plus.wavefront import EDGE, Terrain, inside

DEFAULT_SPEED = 0.4
AHEAD = 0.8
"""Meters: how far ahead on its way it aims."""
LOOK_AGAIN = 0.5
"""Seconds between two looks at whether the way is still free."""


class VfhPlusStack:
    """Dead reckoning from the initial pose, without corrections by the map."""

    def __init__(self, spec: VfhPlus, setting: Setting) -> None:
        self._spec, self._robot, self._surroundings = spec, setting.robot, setting.surroundings
        clock = setting.clock
        self._period, self._clock = clock.ticks(setting.control_period), clock
        self._radius = setting.robot.circumscribed_radius + spec.safety
        self._top = min(spec.top_speed or DEFAULT_SPEED, setting.robot.max_linear)
        self._forbidden = np.concatenate([np.empty((0, 2)), *map(inside, self._surroundings.keepout)])
        self._events: list[Event] = []
        self._task = Task(setting.stop_on_failure, clock=clock, mode=setting.mode)
        self._memory = Memory(clock.ticks(spec.memory), 2.0 * spec.active_radius)
        self._restart(Estimate(None))

    def _restart(self, estimate: Estimate) -> None:
        self._pose = self._start = estimate.pose or Pose2(0.0, 0.0, 0.0)
        self._std, self._driven = estimate.std, 0.0
        self._map_from_odom: Pose2 | None = None
        self._command, self._told = STOP, -1
        self._begin(None)

    def _begin(self, goal: Goal | None) -> None:
        self._aim, self._way, self._turning = goal, None, False
        self._histogram, self._looked, self._progress = Histogram(), -(10**9), (math.inf, 0)
        self.plan: Path | None = None

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Localize at the estimate, then drive to the goals in order."""
        self._restart(estimate)
        self._task.start(goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drive to this goal first."""
        self._events += self._task.preempt(tick, goal)

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it."""
        self._events += self._task.cancel(tick)
        self._command = STOP

    @property
    def goal(self) -> Goal | None:
        """The goal being driven to."""
        return self._task.goal

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Take the readings of this beat and say what to drive."""
        for reading in readings:
            if isinstance(reading, Odometry):
                self._reckon(reading)
        for reading in readings:
            if isinstance(reading, Scan):
                self._memory.add(reading, self._pose)
        plan = self.plan
        if tick % self._period == 0:
            self._command = self._control(tick)
        events, self._events = tuple(self._events), []
        news = self.plan if self.plan is not plan else None
        return Decision(self._command, self._belief(tick), news, None, events)

    def _reckon(self, odometry: Odometry) -> None:
        if not all(map(math.isfinite, odometry.pose)):
            return
        if self._map_from_odom is None:
            self._map_from_odom = self._start.compose(odometry.pose.inverse())
        pose = self._map_from_odom.compose(odometry.pose)
        self._driven += self._pose.distance(pose)
        self._pose = pose

    def _belief(self, tick: int) -> Belief | None:
        """Ten times a second; the covariance grows with the way."""
        if tick - self._told < self._clock.rate // 10 and self._told >= 0:
            return None
        self._told = tick
        spread = [std + 0.02 * self._driven for std in self._std]
        return Belief(self._pose, np.diag(np.square(spread)), self._map_from_odom or self._start, updated=tick)

    def _control(self, tick: int) -> Twist:
        self._events += self._task.accept_next(tick)
        goal = self._task.goal
        if goal is None:
            self._begin(None)
            return STOP
        if goal is not self._aim:
            self._begin(goal)
        if goal.timeout is not None and tick - self._task.since > self._clock.ticks(goal.timeout):
            return self._fail(tick, ErrorCode.NAVIGATE_TIMEOUT, f"{goal.timeout:g} s are over")
        away = self._pose.distance(goal.pose)
        self._turning = away < (goal.xy_tolerance if self._turning else 0.4 * goal.xy_tolerance)
        if self._turning:
            return self._turn(tick, goal)
        obstacles = self._memory.obstacles(tick)
        if not self._on_its_way(tick, goal, obstacles):
            return self._fail(tick, ErrorCode.NO_VALID_PATH, "there is no way on the map")
        if self._stuck(tick, goal):
            return self._fail(tick, ErrorCode.FAILED_TO_MAKE_PROGRESS, "the robot made no progress")
        return self._steer(goal, obstacles)

    def _turn(self, tick: int, goal: Goal) -> Twist:
        off = wrap(goal.pose.yaw - self._pose.yaw)
        if abs(off) > 0.4 * goal.yaw_tolerance:
            return Twist(0.0, 0.0, math.copysign(min(max(1.5 * abs(off), 0.2), 1.0, self._robot.max_angular), off))
        self._events += self._task.record_reached(tick)
        self._begin(None)
        return STOP

    def _fail(self, tick: int, code: ErrorCode, why: str) -> Twist:
        self._events += self._task.record_failed(tick, code, why)
        self._begin(None)
        return STOP

    def _on_its_way(self, tick: int, goal: Goal, obstacles: Array) -> bool:
        """See to it that there is a way that nothing seen blocks; whether there is one."""
        grid = self._surroundings.map
        if grid is None or tick - self._looked < self._clock.ticks(LOOK_AGAIN):
            return True
        self._looked = tick
        if self._way is not None and not _blocked(self._ahead(), obstacles, self._radius - EDGE):
            return True
        reason = "goal" if self._way is None else "blocked"
        for seen in (obstacles, np.empty((0, 2))):
            terrain = Terrain(grid, seen, self._radius, self._forbidden)
            way = terrain.way(self._pose[:2], goal.pose[:2])
            if way is not None:
                self._follow(tick, goal, way, reason)
                return True
        return False

    def _follow(self, tick: int, goal: Goal, way: Array, reason: str) -> None:
        self._way, self._progress = way, (math.inf, tick)
        turns = np.arctan2(*np.diff(way, axis=0).T[::-1])
        self.plan = Path(np.column_stack((way, np.append(turns, goal.pose.yaw))), tick)
        made = {"reason": reason, "length": round(self.plan.length(), 6)}
        self._events.append(Event(tick, EventKind.PLAN_MADE, "", made))

    def _ahead(self) -> Array:
        """What is left of the way."""
        if self._way is None:
            return np.empty((0, 2))
        nearest = int(np.hypot(self._way[:, 0] - self._pose.x, self._way[:, 1] - self._pose.y).argmin())
        return self._way[nearest:]

    def _stuck(self, tick: int, goal: Goal) -> bool:
        """Whether it has come no nearer for too long: by points of its way, or by decimeters where there is no map."""
        left = len(self._ahead()) if self._way is not None else round(10 * self._pose.distance(goal.pose))
        best, since = self._progress
        if left < best:
            self._progress = (left, tick)
            return False
        return tick - since > self._clock.ticks(self._spec.patience)

    def _steer(self, goal: Goal, obstacles: Array) -> Twist:
        """Towards what is AHEAD on the way, around what is in the way."""
        target = self._target(goal)
        reach = min(self._spec.active_radius, self._pose.distance(target) + self._radius)
        relative = obstacles - np.array([self._pose.x, self._pose.y])
        wanted = math.atan2(target.y - self._pose.y, target.x - self._pose.x)
        direction = self._histogram.direction(relative, self._radius, reach, wanted, self._pose.yaw)
        fastest = min(1.2, self._robot.max_angular)
        if direction is None:
            return Twist(0.0, 0.0, math.copysign(0.4, wrap(wanted - self._pose.yaw)))
        off = wrap(direction - self._pose.yaw)
        turn = max(-fastest, min(fastest, 2.0 * off))
        if abs(off) > 0.8:
            return Twist(0.0, 0.0, turn)
        slow = min(self._top, 0.1 + 0.8 * self._pose.distance(goal.pose))
        return Twist(min(slow * math.cos(off) ** 2, self._brake(obstacles)), 0.0, turn)

    def _target(self, goal: Goal) -> Pose2:
        way = self._ahead()
        if len(way) < 2:
            return goal.pose
        along = np.cumsum(np.hypot(*np.diff(way, axis=0).T))
        x, y = way[1 + min(int(np.searchsorted(along, AHEAD)), len(way) - 2)].tolist()
        return Pose2(x, y)

    def _brake(self, obstacles: Array) -> float:
        """The speed in m/s from which it still stops before what is straight ahead."""
        if not len(obstacles):
            return self._top
        ahead = self._pose.inverse().apply(obstacles)
        hull = self._radius - self._spec.safety
        inside = ahead[(np.abs(ahead[:, 1]) < hull) & (ahead[:, 0] > 0.0)]
        if not len(inside):
            return self._top
        gap = float((inside[:, 0] - np.sqrt(np.maximum(hull**2 - inside[:, 1] ** 2, 0.0))).min()) - 0.03
        return math.sqrt(self._robot.linear_deceleration * gap) * 0.5 if gap > 0 else 0.0


def _blocked(way: Array, obstacles: Array, radius: float) -> bool:
    """Whether anything lies within `radius` of the next meters of a way."""
    if not len(way) or not len(obstacles):
        return False
    soon = way[: round(3.0 / EDGE)]
    apart = np.hypot(soon[:, None, 0] - obstacles[:, 0], soon[:, None, 1] - obstacles[:, 1])
    return bool((apart < radius).any())
