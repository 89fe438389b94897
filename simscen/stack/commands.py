"""Pipeline from the controller's velocity to the velocity sent to the base: velocity smoother and collision monitor."""

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.model.guards import VelocitySmoother as SmootherSpec
from simscen.stack.collision_monitor import CollisionMonitor
from simscen.stack.latency_queue import LatencyQueue
from simscen.stack.protocols import RobotModel

CRAWL_SPEED, CRAWL_YAW_RATE = 0.02, 0.1
"""m/s and rad/s below which the robot does not count as driving."""


class VelocitySmoother:
    """Limit velocity and acceleration of commands, like nav2_velocity_smoother in open loop.

    Slowing down uses the full deceleration of the robot.
    """

    def __init__(self, spec: SmootherSpec, robot: RobotModel, period: float) -> None:
        """Take the limits of the specification, at most those of the robot; `period` between commands in s."""
        self._enabled = spec.enabled
        acceleration = min(spec.max_accel or robot.linear_acceleration, robot.linear_acceleration)
        deceleration = min(spec.max_decel or robot.linear_deceleration, robot.linear_deceleration)
        self._speed_up_step, self._slow_down_step = acceleration * period, deceleration * period
        self._turn_step = min(spec.max_angular_accel or robot.angular_acceleration, robot.angular_acceleration) * period
        self._max_speed, self._max_yaw_rate = spec.max_velocity or math.inf, spec.max_angular_velocity or math.inf
        self._has_limits = math.isfinite(min(self._max_speed, self._max_yaw_rate))
        self._is_steered = robot.turning_radius > 0.0
        self._last = Twist()

    def reset(self, twist: Twist) -> None:
        """Set the current velocity of the base after another component changed the command."""
        self._last = twist

    def smooth(self, wanted: Twist, periods: int = 1) -> Twist:
        """Return the velocity to send now, `periods` periods after the previous one."""
        if not self._enabled:
            return wanted
        wanted_x, wanted_y, wz = self._limited(wanted)
        last_x, last_y, last_wz = self._last
        vx = wanted_x if wanted_x == last_x else self._accelerated(last_x, wanted_x, periods)
        vy = wanted_y if wanted_y == last_y else self._accelerated(last_y, wanted_y, periods)
        if self._is_steered and wanted_x != 0.0:
            wz = vx * wz / wanted_x  # like scale_velocities in Nav2: a car keeps its curvature while it accelerates
        else:
            step = periods * self._turn_step
            wz = min(max(wz, last_wz - step), last_wz + step)
        self._last = Twist(vx, vy, wz)
        return self._last

    def _limited(self, wanted: Twist) -> Twist:
        """Return the velocity within the speed limits; a steered base keeps its curvature."""
        if not self._has_limits or (
            max(abs(wanted.vx), abs(wanted.vy)) <= self._max_speed and abs(wanted.wz) <= self._max_yaw_rate
        ):
            return wanted
        vx, vy = (min(max(speed, -self._max_speed), self._max_speed) for speed in (wanted.vx, wanted.vy))
        wz = min(max(wanted.wz, -self._max_yaw_rate), self._max_yaw_rate)
        if self._is_steered and wanted.vx != 0.0:
            scale = min(abs(vx / wanted.vx), abs(wz / wanted.wz) if wanted.wz else 1.0)
            return Twist(wanted.vx * scale, vy, wanted.wz * scale)
        return Twist(vx, vy, wz)

    def _accelerated(self, current: float, wanted: float, periods: int) -> float:
        """Return the speed along one axis after `periods`; a change of direction stops at zero first."""
        if current * wanted < 0.0:
            wanted = 0.0
        step = periods * (self._speed_up_step if abs(wanted) > abs(current) else self._slow_down_step)
        return min(max(wanted, current - step), current + step)


class CommandPipeline:
    """Velocity smoother, then collision monitor. Results become available after the latency of their component."""

    def __init__(
        self, smoother: VelocitySmoother, monitor: CollisionMonitor, period: int, latency: tuple[int, int]
    ) -> None:
        """Combine the components. `period` of the controller, and `latency` of controller and monitor, in ticks."""
        self._smoother, self._monitor, self._period = smoother, monitor, period
        self._wanted, self._allowed = LatencyQueue[tuple[Twist, int]](latency[0]), LatencyQueue[Twist](latency[1])
        self._immediate: tuple[Twist, int] | None = None
        self._requested_at, self._free_at = 0, 0
        self.latency = latency[0]
        """Latency of the controller in ticks."""
        self.late = any(latency)
        """Whether commands can become available between two controller periods."""
        self.sent = STOP
        """The velocity that is sent to the base now."""

    def busy(self, tick: int) -> bool:
        """Return whether the controller is still computing its last command."""
        return self.late and self._wanted.busy(tick)

    def periods(self, tick: int) -> int:
        """Return the number of controller periods since the last command or stop, at least 1."""
        return max(1, (tick - self._requested_at) // self._period)

    def want(self, tick: int, wanted: Twist, periods: int) -> None:
        """Submit the controller's command of this tick, `periods` controller periods after the previous one."""
        self._requested_at = tick
        if self.late:
            self._wanted.put(tick, (wanted, periods))
        else:
            self._immediate = wanted, periods

    def stop(self, tick: int) -> None:
        """Stop at once and discard pending commands."""
        self._wanted.clear()
        self._allowed.clear()
        self._immediate = None
        self._smoother.reset(STOP)
        self._requested_at = self._free_at = tick
        self.sent = STOP

    def step(self, tick: int, odometry: Pose2) -> None:
        """Process the commands that are due at this tick, with the robot at a pose in the odom frame."""
        if self._immediate is not None:
            self.sent = self._filtered(tick, *self._immediate, odometry)
            self._immediate = None
        while tick >= self._wanted.due:
            self._allowed.put(tick, self._filtered(tick, *self._wanted.take(), odometry))
        while tick >= self._allowed.due:
            self.sent = self._allowed.take()

    def held(self, tick: int) -> bool:
        """Return whether the monitor has held the robot for `hold_timeout`, and restart that time if so."""
        held = tick - self._free_at >= self._monitor.hold_ticks
        if held:
            self._free_at = tick
        return held

    def _filtered(self, tick: int, wanted: Twist, periods: int, odometry: Pose2) -> Twist:
        """Return the command after smoother and monitor."""
        smooth = self._smoother.smooth(wanted, periods)
        allowed = self._monitor.allow(smooth, odometry)
        if allowed is not smooth:
            self._smoother.reset(allowed)
        crawls = abs(allowed.vx) + abs(allowed.vy) < CRAWL_SPEED and abs(allowed.wz) < CRAWL_YAW_RATE
        if not crawls or wanted == STOP:
            self._free_at = tick
        return allowed
