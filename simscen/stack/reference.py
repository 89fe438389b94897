"""The reference stack: readings in; localise, map, navigate, smooth, guard; one command out."""

from functools import partial
from typing import Any

from simscen.advanced.prediction.motion_prediction import MotionPrediction
from simscen.advanced.turn_slip import TurnSlipObserver
from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.localization import Estimate
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Readings, Scan
from simscen.core.records.events import Event
from simscen.core.records.trace import Decision
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.commands import Commands
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.localizers.ground_truth import TRUTH
from simscen.stack.navigator import Navigator
from simscen.stack.odometry_history import OdometryHistory, believable
from simscen.stack.protocols import Controller, Localizer, NavigationFailure, Surroundings, tells_pose
from simscen.stack.publishing import NOTHING_NEW, Published, Publishing
from simscen.stack.standstill import Standstill
from simscen.stack.tasks import Task
from simscen.stack.zones import SpeedFilter

HERE = Pose2(0.0, 0.0)
"""Of the robot in its own frame."""
MOTION = frozenset((Odometry, Imu, Bump))
"""What tells how the robot moves and nothing else, or is not listened to."""


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
        commands: Commands,
        monitor: CollisionMonitor,
        prediction: MotionPrediction,
        odometry: OdometryHistory,
        control_period: int,
        localizer_latency: int = 0,
        fuses_odometry: bool = False,
        counters_turn_slip: bool = False,
    ) -> None:
        """`fuses_odometry`: what the localizer believes is the odom frame, and not what the wheels alone say.

        `counters_turn_slip`: what wheels and localizer do not agree on is taken off the command.
        """
        self._speed_filter = SpeedFilter(surroundings)
        self._localizer, self._costmaps, self._controller = localizer, costmaps, controller
        self._whereabouts = localizer if tells_pose(localizer) else None
        self._navigator, self._task, self._commands, self._monitor = navigator, task, commands, monitor
        self._prediction = prediction
        self._tick_rate, self._lidars = surroundings.tick_rate, frozenset(surroundings.lidars)
        self._control_period = control_period
        self._publishing = Publishing(
            surroundings.tick_rate, localizer, controller, "map" if fuses_odometry else "odom"
        )
        self._fuses_odometry = fuses_odometry
        self._turn_slip = TurnSlipObserver() if fuses_odometry and counters_turn_slip else None
        self._matched = LatencyQueue[Scan](localizer_latency)
        self._events: list[Event] = []
        self._moves = False
        self._tick = 0
        self._twist = STOP
        self._odometry, self._wheels = odometry, False
        self._zones: Zones | None = None
        self._standstill = Standstill(surroundings.tick_rate)
        self._nothing = Decision(STOP)
        self._kept: Readings = ()

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Localise at the estimate, then drive to the goals in order."""
        self._take(self._tick, ())
        self._localizer.reset(estimate)
        self._monitor.start(self._tick)
        self._navigator.stop()
        self._task.start(goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drive to this goal first; it takes the place of the current one."""
        self._events += self._task.preempt(tick, goal)
        self._navigator.stop()

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it."""
        self._events += self._task.cancel(tick)
        self._events += self._standstill.over(tick)
        self._navigator.stop()
        self._prediction.hold()
        self._commands.stop(tick)

    def set_zones(self, tick: int, zones: Zones) -> None:
        """These zones hold from the next update of the costmap on, and no others."""
        self._zones = zones

    @property
    def plan(self) -> Path | None:
        """The plan being followed."""
        plan = self._navigator.plans.plan
        return None if plan is None else plan.path

    @property
    def goal(self) -> Goal | None:
        """The goal being driven to; None when the task has ended."""
        return self._task.goal

    @property
    def components(self) -> tuple[tuple[str, Any, tuple[str, ...]], ...]:
        """What is worth measuring: a part's name, something of it, and the methods of that which take time."""
        return (
            ("localizer", self._localizer, ("on_odometry", "on_imu", "on_scan")),
            ("costmap", self._costmaps, ("update",)),
            ("costmap", self._costmaps.wide, ("refresh",)),
            ("costmap", self._costmaps.near, ("refresh",)),
            ("planner", self._navigator.plans.planner, ("plan",)),
            ("controller", self._controller, ("command", "set_path")),
            ("collision monitor", self._monitor, ("allow", "on_scan")),
            ("prediction", self._prediction, ("on_scan", "steer", "stand")),
        )

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Take the readings of this beat and say what to drive."""
        self._tick, belief = tick, None
        controls = tick % self._control_period == 0
        if not controls and self._can_wait(tick, readings):
            self._kept += readings
            return self._as_before(self._commands.sent)
        scanned = self._take(tick, readings)
        plan, local_plan, costmaps = self._step(tick) if controls else NOTHING_NEW
        if controls or self._commands.late:
            self._commands.step(tick, self._odometry.now)
        if scanned or (tick >= self._publishing.belief_due and (readings or controls)):
            belief = self._publishing.belief(tick)
        sent = self._commands.sent
        if self._turn_slip is not None:
            sent = self._turn_slip.countered(sent)
        if belief is None and plan is None and local_plan is None and not costmaps and not self._events:
            return self._as_before(sent)
        events, self._events = tuple(self._events), []
        return Decision(sent, belief, plan, local_plan, events, (), costmaps)

    def _can_wait(self, tick: int, readings: Readings) -> bool:
        """Whether nothing is due but to hear how the robot moves, and that can as well be heard with the next scan.

        Half of all beats are of that kind. What runs but once at each has left a processor's caches before the next.
        """
        if self._events or self._commands.late or self._fuses_odometry:
            return False
        if tick >= self._publishing.belief_due or tick >= self._matched.due:
            return False
        return MOTION.issuperset(map(type, readings))

    def _as_before(self, sent: Twist) -> Decision:
        """Nothing is new, but perhaps the command."""
        if sent is not self._nothing.command:
            self._nothing = Decision(sent)
        return self._nothing

    def _step(self, tick: int) -> Published:
        """What is done at the controller's rate."""
        pose = self._where()
        frames = Frames(pose, self._odometry.now if self._odometry.begun else pose)
        self._update_costmaps(tick, frames)
        if not self._prediction.calm or self._moves:
            self._foretell(tick, frames)
        self._control(tick, frames)
        plan = self._navigator.plans.plan
        return self._publishing.news(tick, frames, None if plan is None else plan.path, self._costmaps)

    def _where(self) -> Pose2:
        """Where the robot believes itself."""
        where = self._whereabouts
        return self._localizer.belief.pose if where is None else where.pose

    def _take(self, tick: int, readings: Readings) -> bool:
        """Hand the readings on, with those that waited; whether there was a scan among them."""
        scans: list[Scan] = []
        if self._kept:
            readings, self._kept = self._kept + readings, ()
        while tick >= self._matched.due:  # the localizer is done with these scans by now, and knows what they are worth
            self._localizer.on_scan(self._matched.take())
        for reading in readings:
            match reading:
                case Odometry():
                    self._localizer.on_odometry(reading)
                    self._dead_reckon(reading)
                case Imu():
                    self._localizer.on_imu(reading)
                    self._prediction.take(reading)
                case Scan():
                    scans.append(reading)
                case Image() if reading.field_of_view > 0.0:
                    self._costmaps.see(reading)
                case _:
                    pass
        for scan in scans:  # after all odometry of this beat, wherever that stands among the readings
            self._look(tick, scan)
        return bool(scans)

    def _look(self, tick: int, scan: Scan) -> None:
        """Hand a scan on."""
        if scan.sensor in self._lidars:  # echoes of a sonar show obstacles, but no walls to match
            self._matched.put(tick, scan)
            while tick >= self._matched.due:
                self._localizer.on_scan(self._matched.take())
        self._prediction.on_scan(scan)
        marking = self._prediction.marking(scan)
        self._monitor.on_scan(marking, self._odometry.held(scan.tick), tick)
        self._costmaps.see(marking)

    def _dead_reckon(self, reading: Odometry) -> None:
        """Remember the way the robot took; the truth only stands in for wheels where there are none."""
        if reading.sensor == TRUTH and self._wheels:
            return
        if reading.sensor != TRUTH and not self._wheels:
            self._wheels = True
            self._odometry.forget()
        pose = reading.pose
        if self._fuses_odometry:
            pose = self._where()
        if self._turn_slip is not None:
            self._turn_slip.learn(reading.pose, pose)
        if believable(reading.twist) and self._odometry.add(reading.tick, pose):
            self._twist = reading.twist
            self._prediction.take(reading)

    def _update_costmaps(self, tick: int, frames: Frames) -> None:
        """Feed the newest scan of each sensor, not older than a costmap's own period, and honour new zones."""
        if self._zones is not None and self._costmaps.due(tick):
            self._costmaps.set_zones(self._zones)
            self._speed_filter.set_zones(self._zones)
            self._zones = None
        if tick >= self._costmaps.next:
            self._costmaps.update(tick, frames, self._odometry)

    def _foretell(self, tick: int, frames: Frames) -> None:
        """Tell the collision monitor, the controller and the planner what moves, each in its frame."""
        around = self._prediction.seen_from(tick, HERE)
        self._moves = len(around) > 0
        self._monitor.on_moving(around)
        self._costmaps.near.moving = self._prediction.seen_from(tick, frames.odometry)
        self._costmaps.wide.moving = self._prediction.seen_from(tick, frames.pose)

    def _control(self, tick: int, frames: Frames) -> None:
        """See to the goals, and to the command that is wanted."""
        goal = self._task.goal
        if goal is None:
            self._events += self._task.next(tick)
            goal = self._task.goal
        if goal is not None and goal.via:
            goal = self._pass(tick, frames.pose)
        if goal is None:
            self._stand(tick, frames.pose)
            return
        if self._prediction.stands:
            self._prediction.settle()
        leg = (goal, *self._task.ahead) if goal.via else (goal,)
        if self._navigator.goal is not leg[-1]:
            self._navigator.pursue(leg[-1])
        self._navigator.via = leg[:-1]
        if goal.timeout is not None and tick - self._task.since > goal.timeout * self._tick_rate:
            self._give_up(tick, NavigationFailure(ErrorCode.NAVIGATE_TIMEOUT, f"{goal.timeout:g} s are over"))
        elif self._monitor.silent(tick):
            self._commands.stop(tick)
            self._events += self._standstill.held(tick, "collision_monitor", partial(self._monitor.silence, tick))
        elif not self._commands.busy(tick):
            self._navigate(tick, frames)
        elif self._commands.sent == STOP:
            self._waits(tick, "controller", self._commands.latency)
        elif self._standstill.holds:
            self._events += self._standstill.over(tick)

    def _navigate(self, tick: int, frames: Frames) -> None:
        """One step of the navigator, and what comes of it."""
        if self._speed_filter.used:
            self._controller.set_speed_limit(self._speed_filter.limit(frames.pose, self._controller.full_speed))
        held, periods = self._commands.held(tick), self._commands.periods(tick)
        step = self._navigator.step(tick, frames, self._twist, held, periods)
        self._events += step.events
        if step.failure is not None:
            self._give_up(tick, step.failure)
        elif step.reached:
            self._events += self._task.reached(tick)
            self._stop(tick)
        else:
            command, pose = step.command, frames.pose
            if not self._prediction.calm:
                view = self._costmaps.wide.view
                command = self._prediction.steer(tick, command, pose, self._twist, view, self.plan)
            self._commands.want(tick, command, periods)
            if waiting := self._navigator.plans.waiting:
                self._waits(tick, "planner", waiting)
            elif self._standstill.holds and self._commands.sent != STOP:
                self._events += self._standstill.over(tick)

    def _waits(self, tick: int, part: str, latency: int) -> None:
        """The robot stands until this part of its stack is done."""
        seconds = f"{latency / self._tick_rate:.3g} s"
        message = f"the {part} takes {seconds} (stack: latency: {part}), with nothing to follow meanwhile"
        self._events += self._standstill.held(tick, part, lambda: message)

    def _stand(self, tick: int, pose: Pose2) -> None:
        """Nowhere to go; but out of the way of what comes at the robot, and back."""
        command = self._prediction.stand(tick, pose, self._twist, self._costmaps.wide.view)
        if command == STOP or self._monitor.silent(tick):
            self._commands.stop(tick)
        elif not self._commands.busy(tick):
            self._commands.want(tick, command, self._commands.periods(tick))

    def _pass(self, tick: int, pose: Pose2) -> Goal | None:
        """Poses that the robot is near to are behind it; returns the goal that is not.

        Nav2's RemovePassedGoals: the way on is planned through the poses that remain.
        """
        while (goal := self._task.goal) is not None and goal.via:
            if pose.distance(goal.pose) > goal.xy_tolerance:
                break
            self._events += self._task.passed(tick)
            self._events += self._task.next(tick)
        return goal

    def _give_up(self, tick: int, failure: NavigationFailure) -> None:
        self._events += self._task.failed(tick, failure.code, str(failure))
        self._stop(tick)

    def _stop(self, tick: int) -> None:
        self._events += self._standstill.over(tick)
        self._navigator.stop()
        self._commands.stop(tick)
