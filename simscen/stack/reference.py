"""The reference stack: readings in; localise, map, navigate, smooth, guard; one command out."""

from typing import Any

from simscen.core.belief import Estimate
from simscen.core.events import Event
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.core.sensing import Image, Imu, Odometry, Readings, Scan
from simscen.core.trace import Decision
from simscen.core.zones import Zones
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames
from simscen.stack.localizers.ground_truth import TRUTH
from simscen.stack.localizers.odometry_track import believable
from simscen.stack.navigator import Navigator
from simscen.stack.odometry_history import OdometryHistory
from simscen.stack.protocols import Controller, Localizer, NavigationFailure, Surroundings
from simscen.stack.publishing import Publishing
from simscen.stack.tasks import Task
from simscen.stack.velocity_smoother import VelocitySmoother
from simscen.stack.zones import SpeedFilter

CRAWL = 0.02
"""m/s and rad/s (times five): what is slower does not count as driving."""
HELD = 1.0
"""Seconds for which the collision monitor may hold the robot before that counts as a failure: the controller cannot see
what the monitor sees (an obstacle nearer than a cell), and would try the same until no progress is made."""


class ReferenceStack:
    """Nav2 in miniature. Decides at the controller's rate and repeats its command in between."""

    def __init__(
        self,
        surroundings: Surroundings,
        localizer: Localizer,
        costmaps: Costmaps,
        controller: Controller,
        navigator: Navigator,
        task: Task,
        smoother: VelocitySmoother,
        monitor: CollisionMonitor,
        control_period: int,
        journal: list[Event],
    ) -> None:
        self._speed_filter = SpeedFilter(surroundings)
        self._localizer, self._costmaps, self._controller = localizer, costmaps, controller
        self._navigator, self._task, self._smoother, self._monitor = navigator, task, smoother, monitor
        self._tick_rate, self._lidars = surroundings.tick_rate, frozenset(surroundings.lidars)
        self._control_period = control_period
        self._publishing = Publishing(surroundings.tick_rate, localizer, controller)
        self._journal = journal
        self._tick = 0
        self._twist, self._command = STOP, STOP
        self._odometry, self._wheels = OdometryHistory(), False
        self._zones: Zones | None = None
        self._free_at = 0
        self._nothing = Decision(STOP)

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Localise at the estimate, then drive to the goals in order."""
        self._localizer.reset(estimate)
        self._monitor.start(self._tick)
        self._navigator.stop()
        self._task.start(goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drive to this goal first; it takes the place of the current one."""
        self._task.preempt(tick, goal)
        self._navigator.stop()

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it."""
        self._task.cancel(tick)
        self._navigator.stop()
        self._command, self._nothing = STOP, Decision(STOP)

    def set_zones(self, tick: int, zones: Zones) -> None:
        """These zones hold from the next update of the costmap on, and no others."""
        self._zones = zones

    @property
    def plan(self) -> Path | None:
        """The plan being followed."""
        return self._navigator.plan.path if self._navigator.plan else None

    @property
    def goal(self) -> Goal | None:
        """The goal being driven to; None when the task has ended."""
        return self._task.goal

    @property
    def components(self) -> dict[str, tuple[Any, ...]]:
        """What is worth measuring: name → the component and its methods that take time."""
        return {
            "localizer": (self._localizer, "on_odometry", "on_imu", "on_scan"),
            "costmap": (self._costmaps, "update"),
            "planner": (self._navigator.planner, "plan"),
            "controller": (self._controller, "command", "set_path"),
            "collision monitor": (self._monitor, "allow", "on_scan"),
        }

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Take the readings of this beat and say what to drive."""
        self._tick = tick
        scanned = self._take(readings) if readings else False
        controls = tick % self._control_period == 0
        if not controls and not readings and not self._journal:
            return self._nothing
        local_plan = None
        if controls:
            self._update_costmaps(tick)
            self._command = self._control(tick)
            local_plan = self._publishing.local_plan(tick, self._navigator.plan is not None, self._frames)
        self._nothing = Decision(self._command)
        events, self._journal[:] = tuple(self._journal), []
        belief, plan = self._publishing.belief(tick, scanned), self._publishing.plan(self.plan)
        return Decision(self._command, belief, plan, local_plan, events)

    def _take(self, readings: Readings) -> bool:
        """Hand the readings on; whether there was a scan among them."""
        scans: list[Scan] = []
        for reading in readings:
            match reading:
                case Odometry():
                    self._localizer.on_odometry(reading)
                    self._dead_reckon(reading)
                case Imu():
                    self._localizer.on_imu(reading)
                case Scan():
                    if reading.sensor in self._lidars:  # echoes of a sonar show obstacles, but no walls to match
                        self._localizer.on_scan(reading)
                    scans.append(reading)
                case Image() if reading.field_of_view > 0.0:
                    self._costmaps.see(reading)
                case _:
                    pass
        for scan in scans:  # after all odometry of this beat, wherever that stands among the readings
            self._monitor.on_scan(scan, self._odometry.at(scan.tick))
            self._costmaps.see(scan)
        return bool(scans)

    def _dead_reckon(self, reading: Odometry) -> None:
        """Remember the way the robot took; the truth only stands in for wheels where there are none."""
        if reading.sensor == TRUTH and self._wheels:
            return
        if reading.sensor != TRUTH and not self._wheels:
            self._wheels, self._odometry = True, OdometryHistory()
        if believable(reading.pose) and believable(reading.twist):
            self._twist = reading.twist
            self._odometry.add(reading.tick, reading.pose)

    @property
    def _frames(self) -> Frames:
        """Where the robot is now; a robot without odometry has its map for odom frame."""
        pose = self._localizer.belief.pose
        return Frames(pose, self._odometry.now if self._odometry else pose)

    def _update_costmaps(self, tick: int) -> None:
        """Feed the newest scan of each sensor, not older than a costmap's own period, and honour new zones."""
        if self._zones is not None and self._costmaps.due(tick):
            self._costmaps.set_zones(self._zones)
            self._speed_filter.set_zones(self._zones)
            self._zones = None
        self._costmaps.update(tick, self._frames, self._odometry)

    def _control(self, tick: int) -> Twist:
        goal = self._task.next(tick)
        if goal is None:
            self._smoother.reset(STOP)
            self._free_at = tick
            return STOP
        goal = self._passed(tick, goal)
        last = (goal, *self._task.ahead)[-1]
        if self._navigator.goal is not last:
            self._navigator.pursue(last)
        self._navigator.via = tuple(each for each in (goal, *self._task.ahead) if each is not last)
        if goal.timeout is not None and tick - self._task.since > goal.timeout * self._tick_rate:
            return self._give_up(tick, NavigationFailure(ErrorCode.NAVIGATE_TIMEOUT, f"{goal.timeout:g} s are over"))
        if self._monitor.silent(tick):
            self._smoother.reset(STOP)
            self._free_at = tick
            return STOP
        frames = self._frames
        if self._speed_filter:
            self._controller.set_speed_limit(self._speed_filter.limit(frames.pose, self._controller.full_speed))
        try:
            wanted, reached = self._navigator.step(tick, frames, self._twist, self._held(tick))
        except NavigationFailure as failure:
            return self._give_up(tick, failure)
        if reached:
            self._task.reached(tick)
            self._navigator.stop()
            self._smoother.reset(STOP)
            return STOP
        return self._guarded(wanted)

    def _passed(self, tick: int, goal: Goal) -> Goal:
        """The goal that is next to be passed or reached, once those that the robot is near to are behind it.

        Nav2's RemovePassedGoals: the way on is planned through the poses that remain.
        """
        while goal.via and self._localizer.belief.pose.distance(goal.pose) <= goal.xy_tolerance:
            self._task.passed(tick)
            following = self._task.next(tick)
            assert following is not None, "what is passed is on the way to something"
            goal = following
        return goal

    def _held(self, tick: int) -> bool:
        """Whether the monitor has allowed nothing for HELD; once told, the waiting begins anew."""
        held = tick - self._free_at >= HELD * self._tick_rate
        if held:
            self._free_at = tick
        return held

    def _guarded(self, wanted: Twist) -> Twist:
        smooth = self._smoother.smooth(wanted)
        allowed = self._monitor.allow(smooth, self._odometry.now)
        if allowed is not smooth:
            self._smoother.reset(allowed)
        crawls = abs(allowed.vx) + abs(allowed.vy) < CRAWL and abs(allowed.wz) < 5 * CRAWL
        if not crawls or wanted == STOP:
            self._free_at = self._tick
        return allowed

    def _give_up(self, tick: int, failure: NavigationFailure) -> Twist:
        self._task.failed(tick, failure.code, str(failure))
        self._navigator.stop()
        self._smoother.reset(STOP)
        return STOP
