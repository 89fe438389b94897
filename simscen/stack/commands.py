"""Pipeline from the controller's velocity to the velocity sent to the base: velocity smoother and collision monitor."""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.velocity_commands import VelocitySmoother as SmootherSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.kinematics import is_standstill
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.protocols import RobotModel


class VelocitySmoother:
    """Limits velocity and acceleration of commands, like nav2_velocity_smoother with OPEN_LOOP feedback."""

    def __init__(self, spec: SmootherSpec, robot: RobotModel, period: float) -> None:
        """Use the speed limits of `spec`, and the smaller of each acceleration limit of `spec` and `robot`.

        `period` is the controller period in s.
        """
        self._is_enabled = spec.enabled
        acceleration = min(spec.max_accel or robot.linear_acceleration, robot.linear_acceleration)
        deceleration = min(spec.max_decel or robot.linear_deceleration, robot.linear_deceleration)
        self._speed_up_step, self._slow_down_step = acceleration * period, deceleration * period
        self._turn_step = min(spec.max_angular_accel or robot.angular_acceleration, robot.angular_acceleration) * period
        self._max_speed, self._max_yaw_rate = spec.max_velocity or math.inf, spec.max_angular_velocity or math.inf
        self._has_limits = math.isfinite(min(self._max_speed, self._max_yaw_rate))
        self._is_steered = robot.turning_radius > 0.0
        self._last = Twist()

    def reset(self, twist: Twist) -> None:
        """Set the velocity from which the next command accelerates."""
        self._last = twist

    def smooth(self, command: Twist, periods: int = 1) -> Twist:
        """Return the velocity to send, `periods` controller periods after the previous velocity."""
        if not self._is_enabled:
            return command
        target_x, target_y, wz = self._limit_speed(command)
        last_x, last_y, last_wz = self._last
        vx = target_x if target_x == last_x else self._accelerate(last_x, target_x, periods)
        vy = target_y if target_y == last_y else self._accelerate(last_y, target_y, periods)
        if self._is_steered and target_x != 0.0:
            wz = vx * wz / target_x  # a car keeps its curvature while it accelerates (Nav2: scale_velocities)
        else:
            step = periods * self._turn_step
            wz = min(max(wz, last_wz - step), last_wz + step)
        self._last = Twist(vx, vy, wz)
        return self._last

    def _limit_speed(self, command: Twist) -> Twist:
        """Return the command within the speed limits; for a car, with the same curvature."""
        if not self._has_limits or (
            max(abs(command.vx), abs(command.vy)) <= self._max_speed and abs(command.wz) <= self._max_yaw_rate
        ):
            return command
        vx, vy = (min(max(speed, -self._max_speed), self._max_speed) for speed in (command.vx, command.vy))
        wz = min(max(command.wz, -self._max_yaw_rate), self._max_yaw_rate)
        if self._is_steered and command.vx != 0.0:
            scale = min(abs(vx / command.vx), abs(wz / command.wz) if command.wz else 1.0)
            return Twist(command.vx * scale, vy, command.wz * scale)
        return Twist(vx, vy, wz)

    def _accelerate(self, current: float, target: float, periods: int) -> float:
        """Return the speed along one axis after `periods`. A change of direction first stops at zero."""
        if current * target < 0.0:
            target = 0.0
        step = periods * (self._speed_up_step if abs(target) > abs(current) else self._slow_down_step)
        return min(max(target, current - step), current + step)


class CommandPipeline:
    """Passes commands through velocity smoother and collision monitor, with the latency of controller and monitor."""

    def __init__(
        self, smoother: VelocitySmoother, monitor: CollisionMonitor, period: int, latency: tuple[int, int]
    ) -> None:
        """`period` of the controller and `latency` of (controller, monitor) are in ticks."""
        self._smoother, self._monitor, self._period = smoother, monitor, period
        self._requested = LatencyQueue[tuple[Twist, int]](latency[0])
        """Commands that the controller computes, each with the number of periods since the previous command."""
        self._allowed = LatencyQueue[Twist](latency[1])
        """Commands that the monitor has limited."""
        self._immediate: tuple[Twist, int] | None = None
        """Like an element of `_requested`. Replaces the queues if there is no latency, because queues are slower."""
        self._last_request_tick = 0
        self._last_free_tick = 0
        """Latest tick at which the monitor did not hold the robot."""
        self.latency = latency[0]
        """Latency of the controller in ticks."""
        self.has_latency = any(latency)
        """Whether commands can become available between two controller periods."""
        self.sent = STOP
        """The velocity that is sent to the base now."""

    def is_busy(self, tick: int) -> bool:
        """Return whether the controller is still computing its last command."""
        return self.has_latency and self._requested.is_busy(tick)

    def elapsed_periods(self, tick: int) -> int:
        """Return the number of controller periods since the last command or stop, at least 1."""
        return max(1, (tick - self._last_request_tick) // self._period)

    def request(self, tick: int, command: Twist, periods: int) -> None:
        """Submit the controller's command of this tick, `periods` controller periods after the previous command."""
        self._last_request_tick = tick
        if self.has_latency:
            self._requested.put(tick, (command, periods))
        else:
            self._immediate = command, periods

    def stop(self, tick: int) -> None:
        """Stop at once and discard pending commands."""
        self._requested.clear()
        self._allowed.clear()
        self._immediate = None
        self._smoother.reset(STOP)
        self._last_request_tick = self._last_free_tick = tick
        self.sent = STOP

    def step(self, tick: int, odometry: Pose2) -> None:
        """Process the commands due at this tick, and update `sent`. `odometry` is the pose in the odom frame."""
        if self._immediate is not None:
            self.sent = self._filter(tick, *self._immediate, odometry)
            self._immediate = None
        while tick >= self._requested.due:
            self._allowed.put(tick, self._filter(tick, *self._requested.take(), odometry))
        while tick >= self._allowed.due:
            self.sent = self._allowed.take()

    def check_hold_timeout(self, tick: int) -> bool:
        """Return whether the monitor has kept the robot stopped for `hold_timeout`. If so, restart the timeout."""
        is_over = tick - self._last_free_tick >= self._monitor.hold_ticks
        if is_over:
            self._last_free_tick = tick
        return is_over

    def _filter(self, tick: int, command: Twist, periods: int, odometry: Pose2) -> Twist:
        """Return the command after smoother and monitor."""
        smoothed = self._smoother.smooth(command, periods)
        allowed = self._monitor.limit_command(smoothed, odometry)
        if allowed is not smoothed:
            self._smoother.reset(allowed)
        is_intended_standstill = command == STOP or (allowed is smoothed and is_standstill(command))
        if is_intended_standstill or not is_standstill(allowed):
            self._last_free_tick = tick
        return allowed
