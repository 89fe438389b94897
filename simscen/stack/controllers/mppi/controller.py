"""Model predictive path integral control (Williams et al. 2017), as nav2_mppi_controller does it.

A thousand noisy versions of the last control sequence are rolled out, each is scored, and the new sequence is their
average weighted by exp(-score / temperature).
"""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.collision_checker import CollisionChecker
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.stack.controllers.mppi.control_sequence import (
    PAST_COMMANDS,
    apply_limits,
    sample_weights,
    shift_sequence,
    smooth_sequence,
)
from simscen.stack.controllers.mppi.critic_data import CriticData
from simscen.stack.controllers.mppi.critic_manager import CriticManager
from simscen.stack.controllers.mppi.rollouts import (
    VX,
    VY,
    WZ,
    Rollouts,
    apply_model_delay,
    axis_order,
    integrate_velocities,
    mppi_limits,
    predict_velocities,
)
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import LocalPlan, local_plan
from simscen.stack.controllers.velocity_limits import VelocityLimits
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

Floats = npt.NDArray[np.float32]
COMMAND_FREE_TIME_S = 0.5
"""Seconds that the command itself must be free of collisions for."""
MIN_PLAN_LENGTH_M, PLAN_MARGIN_M = 2.0, 1.0
"""Meters of plan that it looks at, at least, which is Nav2's prune_distance; and beyond what the rollouts
reach, for the critics that look at points further on."""
SPEED_STD_RATIO = 0.5
"""Standard deviation of the sampled speeds, of the greatest. What draws the speed up grows with its square, what holds
it back (gamma) with the speed: Nav2's 0.2 m/s comes to rest at about 0.5 m/s, whatever the limit."""


class MppiController(PathFollower):
    """Keeps a control sequence and improves it at each call."""

    def __init__(self, spec: MppiSpec, setting: Setting) -> None:
        robot = setting.robot
        super().__init__(spec.vx_max, robot)
        self._spec, self._footprint, self._rng = spec, setting.footprint, setting.rng
        self._base = mppi_limits(spec, robot, self._fastest)
        model = spec.motion_model or ("Omni" if self._base.high[1] > 0.0 else "DiffDrive")
        self._axes = 3 if model == "Omni" else 2
        deviations = (
            spec.vx_std or SPEED_STD_RATIO * self._fastest,
            spec.wz_std,
            spec.vy_std or SPEED_STD_RATIO * self._base.high[1],
        )
        self._std = np.array(deviations[: self._axes], np.float32)
        late = (spec.model_delay_vx, spec.model_delay_wz, spec.model_delay_vy)
        self._delays = tuple(math.floor(each / spec.model_dt + 0.5) for each in late[: self._axes])
        self._judgment = CriticManager(spec, omni=model == "Omni")
        self._period, self._shift = setting.control_period, setting.control_period / spec.model_dt
        self._goal_pose = GoalRotation(robot, spec.wz_max, robot.angular_acceleration, setting.control_period)
        self._free_way = CollisionChecker(setting.footprint)
        self._reach = max(MIN_PLAN_LENGTH_M, self._fastest * spec.time_steps * spec.model_dt + PLAN_MARGIN_M)
        self._forget()

    def _forget(self) -> None:
        """Begin with nothing, and with other noise: what was found leads nowhere."""
        axes, steps = self._axes, self._spec.time_steps
        self._sequence = np.zeros((axes, steps), np.float32)
        self._sent = np.zeros((axes, max(PAST_COMMANDS, *self._delays)), np.float32)
        self._draw()
        self._driven: Rollouts | None = None
        self._pose, self._from = Pose2(0.0, 0.0), Pose2(0.0, 0.0)

    def _draw(self) -> None:
        shape = (self._axes, self._spec.time_steps, self._spec.batch_size)
        self._noise = self._rng.standard_normal(shape, dtype=np.float32) * self._std[:, None, None]

    def begin(self) -> None:
        """Another goal; the control sequence is kept as a start."""
        self._goal_pose.reset()

    @property
    def _limits(self) -> VelocityLimits:
        return self._base.scaled(self._share)

    @property
    def local_plan(self) -> Path | None:
        """Trajectory of the control sequence."""
        return None if self._driven is None else Path(self._poses(self._driven))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity to drive now. Raises NO_VALID_CONTROL when all rollouts, or their average, collide."""
        track, self._pose = self._located(pose), pose
        if self._goal_pose.reached(pose, twist, goal, track.remaining()):
            self._forget()
            command = self._goal_pose.turn_to_goal(pose, goal, twist)
        else:
            plan = local_plan(track, self._reach)
            command = self._optimized(twist, lambda rolled: self._scene(rolled, plan, costmap, goal))
        free = self._free_way.seconds(costmap, pose, command, COMMAND_FREE_TIME_S)
        return self._free_way.within(command, free, COMMAND_FREE_TIME_S, COMMAND_FREE_TIME_S)

    def _scene(self, rolled: Rollouts, plan: LocalPlan, costmap: CostmapView, goal: Goal) -> CriticData:
        return CriticData(
            rolled, plan, self._pose, goal.pose.yaw, costmap, self._footprint, self._limits, self._spec.model_dt,
            goal.xy_tolerance,
        )  # fmt: skip

    def _optimized(self, twist: Twist, seen: Callable[[Rollouts], CriticData]) -> Twist:
        """Improve the sequence; what hits something is forgotten, and begun anew as often as is allowed."""
        for _ in range(1 + self._spec.retry_attempt_limit):
            now = self._velocity(twist)
            free = False
            for _ in range(self._spec.iteration_count):
                free = self._improve(now, seen)
            rolled = integrate_velocities(self._sequence[:, :, None], self._pose.yaw, self._spec.model_dt)
            if free and self._valid(seen(rolled)):
                self._driven, self._from = rolled, self._pose
                return self._next()
            self._forget()
        raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "all that the optimizer finds hits something")

    def _velocity(self, twist: Twist) -> Floats:
        """Return the velocity (axes,) when the command takes effect: between the measured and the last sent one."""
        sent, limits = self._sent[:, -1].astype(np.float64), self._limits
        if self._spec.open_loop:
            return self._sent[:, -1]
        measured = np.array((twist.vx, twist.wz, twist.vy))[: self._axes]
        change = (axis_order(limits.deceleration) * self._period, axis_order(limits.acceleration) * self._period)
        near = np.clip(sent, measured + change[0][: self._axes], measured + change[1][: self._axes])
        return near.astype(np.float32)

    def _improve(self, now: Floats, seen: Callable[[Rollouts], CriticData]) -> bool:
        """One iteration; whether any rollout hits nothing."""
        spec, limits, dt = self._spec, self._limits, self._spec.model_dt
        self._sequence[:, 0] = now
        if spec.regenerate_noises:
            self._draw()
        controls = self._sequence[:, :, None] + self._noise
        velocities = predict_velocities(now, controls, limits, dt)
        apply_model_delay(velocities, self._sent, self._delays)
        costs, all_hit = self._judgment.costs(seen(integrate_velocities(velocities, self._pose.yaw, dt)))
        deviations: list[float] = self._std.tolist()
        average = controls @ sample_weights(
            costs, self._sequence, self._noise, deviations, spec.gamma, spec.temperature
        )
        average = smooth_sequence(average, self._sent[:, -PAST_COMMANDS:], spec.sgf_order)
        self._sequence = apply_limits(average, now, limits, dt)
        return not all_hit

    def _valid(self, scene: CriticData) -> bool:
        """nav2_mppi_controller's DefaultOptimalTrajectoryValidator."""
        spec, rolled = self._spec.TrajectoryValidator, scene.rolled
        steps = min(round(spec.collision_lookahead_time / scene.dt), len(rolled.x))
        if steps == 0:
            return True
        whole = spec.consider_footprint is not False
        gap = scene.gap(scene.spots(rolled.x[:steps], rolled.y[:steps]), rolled.yaw[:steps], whole)
        return not scene.hit(gap, whole).any()

    def _next(self) -> Twist:
        """Return the command for the end of this control period, and shift the sequence by one period."""
        self._sequence = shift_sequence(self._sequence, self._shift)
        first = self._sequence[:, :1]
        self._sent = np.concatenate((self._sent[:, 1:], first), axis=1)
        vx, wz = float(first[VX, 0]), float(first[WZ, 0])
        return Twist(vx, float(first[VY, 0]) if self._axes > VY else 0.0, wz)

    def _poses(self, rolled: Rollouts) -> Array:
        columns = (rolled.x[:, 0] + self._from.x, rolled.y[:, 0] + self._from.y, rolled.yaw[:, 0])
        return np.column_stack(columns).astype(np.float64)
