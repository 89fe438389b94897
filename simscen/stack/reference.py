"""The reference stack, Nav2 in miniature: passes readings to its components, and returns velocity commands."""

from functools import partial
from typing import TYPE_CHECKING, Any

from simscen.core.environment.costmap_filters import Zones
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Estimate, Path
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Readings, Scan, imu_in_base_frame, level_scan
from simscen.core.records.events import Event
from simscen.core.records.trace import Decision
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.commands import CommandPipeline
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.costmap.speed_filter import SpeedFilter
from simscen.stack.frames import Frames
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.localizers.ground_truth import TRUTH
from simscen.stack.navigator import Navigator
from simscen.stack.odometry_history import OdometryHistory, is_plausible
from simscen.stack.protocols import Controller, Localizer, NavigationFailure, SupportsPose, Surroundings
from simscen.stack.publishing import NO_UPDATES, Publisher, StandstillReporter, Updates
from simscen.stack.tasks import Task

if TYPE_CHECKING:
    from simscen.stack.localizers.odometry_filter import OdometryFilter

MOTION_READINGS = frozenset((Odometry, Imu, Bump))
"""Types of readings that only measure motion. Their processing can wait until the next scan or controller period."""


class ReferenceStack:
    """Localizer, costmaps, navigator, controller, velocity smoother, and collision monitor of one robot.

    The stack computes a command in each controller period, and repeats the command in between. The methods `_on_…` and
    `_adjust_…` are extension points for subclasses. In this class, most of these methods do nothing, or return their
    argument.
    """

    def __init__(
        self,
        surroundings: Surroundings,
        localizer: Localizer,
        costmaps: Costmaps,
        controller: Controller,
        navigator: Navigator,
        task: Task,
        commands: CommandPipeline,
        monitor: CollisionMonitor,
        odometry: OdometryHistory,
        control_period: int,
        localizer_latency: int = 0,
        fuses_odometry: bool = False,
        odometry_filter: "OdometryFilter | None" = None,
    ) -> None:
        """Take the components. `control_period` and `localizer_latency` are in ticks.

        `fuses_odometry`: the localizer (an EKF) provides the pose in the odom frame, instead of the wheel odometry.
        `odometry_filter`: filter of the wheel odometry; None to use unfiltered wheel odometry.
        """
        self._speed_filter = SpeedFilter(surroundings)
        self._localizer, self._costmaps, self._controller = localizer, costmaps, controller
        self._pose_localizer = localizer if isinstance(localizer, SupportsPose) else None
        self._navigator, self._task, self._commands, self._monitor = navigator, task, commands, monitor
        self._tick_rate, self._lidars = surroundings.tick_rate, frozenset(surroundings.lidars)
        self._control_period = control_period
        self._publishing = Publisher(surroundings.tick_rate, localizer, controller, "map" if fuses_odometry else "odom")
        self._fuses_odometry, self._odometry_filter = fuses_odometry, odometry_filter
        self._filtered_readings: list[Odometry] = []
        """Filtered odometry for the log since the last decision."""
        self._localizer_scans = LatencyQueue[Scan](localizer_latency)
        self._events: list[Event] = []
        self._tick = 0
        self._twist = STOP
        """Latest measured velocity."""
        self._odometry, self._wheel_sensor, self._imu_sensor = odometry, "", ""
        """Odometry history, and the names of the wheel odometry and the IMU that are used ("" before a reading)."""
        self._zones: Zones | None = None
        """Zones for the next update of the global costmap; None without a change."""
        self._standstill = StandstillReporter(surroundings.tick_rate)
        self._last_decision = Decision(STOP)
        self._pending: Readings = ()
        """Readings that will be processed later (see `_can_wait`)."""

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Initialize the localizer with the estimate, and drive to the goals in order."""
        self._process_readings(self._tick, ())
        self._localizer.reset(estimate)
        self._monitor.start(self._tick)
        self._events += self._navigator.stop(self._tick)
        self._task.start(goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal and the rest of its action."""
        self._events += self._task.preempt(tick, goal)
        self._events += self._navigator.stop(tick)

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it."""
        self._events += self._task.cancel(tick)
        self._events += self._standstill.report_release(tick)
        self._events += self._navigator.stop(tick)
        self._commands.stop(tick)

    def set_zones(self, tick: int, zones: Zones) -> None:
        """Replace all keepout and speed zones at the next costmap update."""
        self._zones = zones

    @property
    def plan(self) -> Path | None:
        """The plan being followed; None without a plan."""
        plan = self._navigator.plans.plan
        return None if plan is None else plan.path

    @property
    def goal(self) -> Goal | None:
        """The current goal; None when the task has ended."""
        return self._task.goal

    @property
    def components(self) -> tuple[tuple[str, Any, tuple[str, ...]], ...]:
        """Components that benchmarks measure, each with its name, object, and names of time-consuming methods."""
        filters = () if self._odometry_filter is None else (("odometry filter", self._odometry_filter, ("fuse",)),)
        return (
            *filters,
            ("localizer", self._localizer, ("on_odometry", "on_imu", "on_scan")),
            ("costmap", self._costmaps, ("update",)),
            ("costmap", self._costmaps.global_costmap, ("refresh",)),
            ("costmap", self._costmaps.local_costmap, ("refresh",)),
            ("planner", self._navigator.plans.planner, ("plan",)),
            ("controller", self._controller, ("command", "set_path")),
            ("collision monitor", self._monitor, ("limit_command", "on_scan")),
        )

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Process the readings of this tick, and return the command and other output."""
        self._tick, belief = tick, None
        is_control_tick = tick % self._control_period == 0
        if not is_control_tick and self._can_wait(tick, readings):
            self._pending += readings
            return self._repeated_decision(self._commands.sent)
        has_scan = self._process_readings(tick, readings)
        plan, local_plan, costmaps = self._control_step(tick) if is_control_tick else NO_UPDATES
        if is_control_tick or self._commands.has_latency:
            self._commands.step(tick, self._odometry.latest_pose)
        if has_scan or (tick >= self._publishing.belief_due and (readings or is_control_tick)):
            belief = self._publishing.belief(tick)
        sent = self._adjust_sent_command(self._commands.sent)
        filtered = self._filtered_readings
        if belief is None and plan is None and local_plan is None and not (costmaps or self._events or filtered):
            return self._repeated_decision(sent)
        events, self._events, self._filtered_readings = tuple(self._events), [], []
        return Decision(sent, belief, plan, local_plan, events, (), costmaps, tuple(filtered))

    # Extension points -------------------------------------------------------------------------------------------------

    def _on_motion(self, reading: Odometry | Imu) -> None:
        """Process an odometry or IMU reading with plausible values."""

    def _on_odometry_step(self, wheels: Pose2, fused: Pose2) -> None:
        """Process the poses of an odometry reading: `wheels`, unfiltered, and `fused`, the pose in the odom frame."""

    def _on_lidar_scan(self, tick: int, scan: Scan) -> Scan:
        """Process a scan. Return the scan to pass to costmaps and collision monitor."""
        return scan

    def _on_costmaps_updated(self, tick: int, frames: Frames) -> None:
        """Run after the costmap update of a controller period."""

    def _on_drive(self) -> None:
        """Run before the navigator in each controller period with a goal."""

    def _adjust_controller_command(self, tick: int, frames: Frames, command: Twist) -> Twist:
        """Return the command to pass to the velocity smoother. `command` comes from the navigator."""
        return command

    def _adjust_sent_command(self, command: Twist) -> Twist:
        """Return the command to send to the base. `command` comes from the collision monitor."""
        return command

    def _on_idle(self, tick: int, pose: Pose2) -> None:
        """Stop the robot. Runs in each controller period without a goal."""
        self._commands.stop(tick)

    # Readings ---------------------------------------------------------------------------------------------------------

    def _can_wait(self, tick: int, readings: Readings) -> bool:
        """Return whether the readings can be processed later, at the next scan or controller period."""
        if self._events or self._commands.has_latency or self._fuses_odometry:
            return False
        if tick >= self._publishing.belief_due or tick >= self._localizer_scans.due:
            return False
        return MOTION_READINGS.issuperset(map(type, readings))

    def _repeated_decision(self, sent: Twist) -> Decision:
        """Return a decision with only the command: the same object as long as the command is the same."""
        if sent is not self._last_decision.command:
            self._last_decision = Decision(sent)
        return self._last_decision

    def _process_readings(self, tick: int, readings: Readings) -> bool:
        """Pass the pending and the new readings to the components. Return whether there was a scan."""
        scans: list[Scan] = []
        if self._pending:
            readings, self._pending = self._pending + readings, ()
        while tick >= self._localizer_scans.due:
            self._localizer.on_scan(self._localizer_scans.take())
        for reading in readings:
            match reading:
                case Odometry():
                    self._process_odometry(reading)
                case Imu():
                    self._process_imu(reading)
                case Scan():
                    scans.append(level_scan(reading))
                case Image() if reading.field_of_view > 0.0:
                    self._costmaps.add_reading(reading)
                case _:
                    pass
        for scan in scans:  # after all odometry of this beat, regardless of the order of the readings
            self._process_scan(tick, scan)
        return bool(scans)

    def _process_scan(self, tick: int, scan: Scan) -> None:
        """Pass a scan to the localizer, if the lidar is one of `lidars`, and to collision monitor and costmaps."""
        if scan.sensor in self._lidars:  # sonars show obstacles, but the localizer cannot match them
            self._localizer_scans.put(tick, scan)
            while tick >= self._localizer_scans.due:
                self._localizer.on_scan(self._localizer_scans.take())
        processed = self._on_lidar_scan(tick, scan)
        self._monitor.on_scan(processed, self._odometry.latest_until(scan.tick), tick)
        self._costmaps.add_reading(processed)

    def _process_imu(self, reading: Imu) -> None:
        """Pass a reading to the odometry filter and the localizer. Readings of a second IMU are ignored."""
        self._imu_sensor = self._imu_sensor or reading.sensor
        if reading.sensor != self._imu_sensor:
            return
        imu = imu_in_base_frame(reading)
        if self._odometry_filter is not None:
            self._odometry_filter.on_imu(imu)
        self._localizer.on_imu(imu)
        self._on_motion(imu)

    def _process_odometry(self, reading: Odometry) -> None:
        """Filter an odometry reading, pass it to the localizer, and add the pose to the odometry history."""
        if reading.sensor == TRUTH:
            self._localizer.on_odometry(reading)
            if not self._wheel_sensor:  # without wheel odometry, the true pose is the odometry, too
                self._record_motion(reading, reading.pose, reading.twist)
            return
        if not self._wheel_sensor:
            self._wheel_sensor = reading.sensor
            self._odometry.clear()
        odometry = self._filtered_odometry(reading)
        if odometry is None:
            return
        self._localizer.on_odometry(odometry)
        pose = self._believed_pose() if self._fuses_odometry else odometry.pose
        self._record_motion(reading, pose, odometry.twist)

    def _record_motion(self, reading: Odometry, pose: Pose2, twist: Twist) -> None:
        """Add the pose in the odom frame to the odometry history, and store the velocity, if both are plausible."""
        self._on_odometry_step(reading.pose, pose)
        if is_plausible(twist) and self._odometry.add(reading.tick, pose):
            self._twist = twist
            self._on_motion(reading)

    def _filtered_odometry(self, reading: Odometry) -> Odometry | None:
        """Return the filtered odometry; None if there is no new estimate. Without a filter, return the reading.

        Readings of a second odometry sensor are ignored, because the poses of two sensors drift apart.
        """
        if reading.sensor != self._wheel_sensor:
            return None
        if self._odometry_filter is None:
            return reading
        odometry = self._odometry_filter.fuse(reading)
        if odometry is not None:
            self._filtered_readings.append(odometry)
        return odometry

    def _believed_pose(self) -> Pose2:
        """Return the localizer's estimate of the pose in the map frame."""
        localizer = self._pose_localizer
        return self._localizer.belief.pose if localizer is None else localizer.pose

    # Control ----------------------------------------------------------------------------------------------------------

    def _control_step(self, tick: int) -> Updates:
        """Run one controller period. Return plans and costmaps to publish."""
        pose = self._believed_pose()
        frames = Frames(pose, self._odometry.latest_pose if self._odometry.has_pose else pose)
        self._update_costmaps(tick, frames)
        self._on_costmaps_updated(tick, frames)
        self._control(tick, frames)
        plan = self._navigator.plans.plan
        return self._publishing.updates(tick, frames, None if plan is None else plan.path, self._costmaps)

    def _update_costmaps(self, tick: int, frames: Frames) -> None:
        """Apply changed zones, and update the costmaps that are due."""
        if self._zones is not None and self._costmaps.is_global_due(tick):
            self._costmaps.set_zones(self._zones)
            self._speed_filter.set_zones(self._zones)
            self._zones = None
        if tick >= self._costmaps.next_update_tick:
            self._costmaps.update(tick, frames, self._odometry)

    def _control(self, tick: int, frames: Frames) -> None:
        """Select the goal and determine the command of this controller period."""
        goal = self._task.goal
        if goal is None:
            self._events += self._task.accept_next(tick)
            goal = self._task.goal
        if goal is not None and goal.via:
            goal = self._remove_passed_goals(tick, frames.pose)
        if goal is None:
            self._on_idle(tick, frames.pose)
            return
        self._on_drive()
        leg = (goal, *self._task.remaining_in_action) if goal.via else (goal,)
        if self._navigator.goal is not leg[-1]:
            self._navigator.pursue(leg[-1])
        self._navigator.via = leg[:-1]
        if goal.timeout is not None and tick - self._task.since > goal.timeout * self._tick_rate:
            self._fail_goal(tick, NavigationFailure(ErrorCode.NAVIGATE_TIMEOUT, f"not reached in {goal.timeout:g} s"))
        elif self._monitor.is_silent(tick):
            self._commands.stop(tick)
            self._events += self._standstill.report_hold(
                tick, "collision_monitor", partial(self._monitor.silence_reason, tick)
            )
        elif not self._commands.is_busy(tick):
            self._navigate(tick, frames)
        elif self._commands.sent == STOP:
            self._report_waiting(tick, "controller", self._commands.latency)
        elif self._standstill.holder:
            self._events += self._standstill.report_release(tick)

    def _navigate(self, tick: int, frames: Frames) -> None:
        """Run one step of the navigator, and submit its command or end the goal."""
        if self._speed_filter.is_used:
            self._controller.set_speed_limit(self._speed_filter.limit(frames.pose, self._controller.full_speed))
        is_held, periods = self._commands.check_hold_timeout(tick), self._commands.elapsed_periods(tick)
        step = self._navigator.step(tick, frames, self._twist, is_held, periods)
        self._events += step.events
        if step.failure is not None:
            self._fail_goal(tick, step.failure)
        elif step.reached:
            self._events += self._task.record_reached(tick)
            self._stop(tick)
        else:
            self._commands.request(tick, self._adjust_controller_command(tick, frames, step.command), periods)
            if wait_ticks := self._navigator.plans.wait_ticks:
                self._report_waiting(tick, "planner", wait_ticks)
            elif self._standstill.holder and self._commands.sent != STOP:
                self._events += self._standstill.report_release(tick)

    def _report_waiting(self, tick: int, component: str, latency: int) -> None:
        """Report that the robot stands still until a component has finished its computation."""
        seconds = f"{latency / self._tick_rate:.3g} s"
        message = f"the {component} takes {seconds} (stack: latency: {component}); the robot waits for it"
        self._events += self._standstill.report_hold(tick, component, lambda: message)

    def _remove_passed_goals(self, tick: int, pose: Pose2) -> Goal | None:
        """Record intermediate goals close to the robot as passed (Nav2's RemovePassedGoals). Return the next goal."""
        while (goal := self._task.goal) is not None and goal.via:
            if pose.distance(goal.pose) > goal.xy_tolerance:
                break
            self._events += self._task.record_passed(tick)
            self._events += self._task.accept_next(tick)
        return goal

    def _fail_goal(self, tick: int, failure: NavigationFailure) -> None:
        """End the current goal as failed, and stop the robot."""
        self._events += self._task.record_failed(tick, failure.code, str(failure))
        self._stop(tick)

    def _stop(self, tick: int) -> None:
        """Stop the robot, and end the navigation to the current goal."""
        self._events += self._standstill.report_release(tick)
        self._events += self._navigator.stop(tick)
        self._commands.stop(tick)
