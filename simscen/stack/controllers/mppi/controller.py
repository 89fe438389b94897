"""Model predictive path integral control (Williams et al. 2017), as in nav2_mppi_controller.

Noisy copies (samples) of the previous control sequence are simulated and scored. The new sequence is their average,
weighted by exp(-cost / temperature).
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
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
from simscen.stack.controllers.mppi.critic_data import CriticData, considers_footprint
from simscen.stack.controllers.mppi.critics import CriticManager
from simscen.stack.controllers.mppi.rollouts import (
    VX,
    VY,
    WZ,
    Floats,
    Rollouts,
    apply_model_delay,
    in_sequence_order,
    integrate_velocities,
    mppi_limits,
    predict_velocities,
)
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import upcoming_path
from simscen.stack.kinematics import VelocityLimits
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

PLAN_MARGIN_M = 1.0
"""Length of the plan for the critics, in addition to the distance that the robot can drive within the horizon."""
SPEED_STD_RATIO = 0.5
"""Default standard deviation of the sampled speeds, relative to the maximum speed."""


class MppiController(PathFollower):
    """Controller that optimizes a control sequence in each control period, starting from the previous sequence."""

    def __init__(self, spec: MppiSpec, setting: Setting) -> None:
        robot = setting.robot
        super().__init__(spec, spec.vx_max, robot)
        self._spec, self._footprint, self._rng = spec, setting.footprint, setting.rng
        self._full_limits = mppi_limits(spec, robot, self._full_speed)
        model = spec.motion_model or ("Omni" if self._full_limits.high[1] > 0.0 else "DiffDrive")
        self._axes = 3 if model == "Omni" else 2
        deviations = (
            spec.vx_std or SPEED_STD_RATIO * self._full_speed,
            spec.wz_std,
            spec.vy_std or SPEED_STD_RATIO * self._full_limits.high[1],
        )
        self._std = np.array(deviations[: self._axes], np.float32)
        delays = (spec.model_delay_vx, spec.model_delay_wz, spec.model_delay_vy)
        self._delay_steps = tuple(math.floor(delay / spec.model_dt + 0.5) for delay in delays[: self._axes])
        self._critics = CriticManager(spec, is_omni=model == "Omni")
        self._period, self._shift_steps = setting.control_period, setting.control_period / spec.model_dt
        self._goal_rotation = GoalRotation(
            robot, spec.wz_max, robot.angular_acceleration, setting.control_period, spec.goal_tolerance_ratio
        )
        self._collision_checker = CollisionChecker(setting.footprint, spec.min_slowed_speed)
        reach = self._full_speed * spec.time_steps * spec.model_dt
        self._plan_length = max(spec.prune_distance, reach + PLAN_MARGIN_M)
        self._pose, self._optimal_start = Pose2(0.0, 0.0), Pose2(0.0, 0.0)
        """Current pose of the robot, and pose at which the trajectory `_optimal` starts."""
        self._reset()

    def _reset(self) -> None:
        """Restart with a zero sequence and new noise."""
        axes, steps = self._axes, self._spec.time_steps
        self._sequence = np.zeros((axes, steps), np.float32)
        self._sent_commands = np.zeros((axes, max(PAST_COMMANDS, *self._delay_steps)), np.float32)
        """Last commands, the latest one at the end."""
        self._draw_noise()
        self._optimal: Rollouts | None = None

    def _draw_noise(self) -> None:
        """Draw the noise (axes, steps, samples)."""
        shape = (self._axes, self._spec.time_steps, self._spec.batch_size)
        self._noise = self._rng.standard_normal(shape, dtype=np.float32) * self._std[:, None, None]

    def reset_for_goal(self) -> None:
        """Reset the goal rotation for another goal. The control sequence stays unchanged."""
        self._goal_rotation.reset()

    @property
    def _limits(self) -> VelocityLimits:
        """Velocity limits with the current speed limit."""
        return self._full_limits.scaled(self._speed_ratio)

    @property
    def local_plan(self) -> Path | None:
        """Trajectory of the optimized control sequence; None before the first sequence and at the goal."""
        if self._optimal is None:
            return None
        optimal, start = self._optimal, self._optimal_start
        columns = (optimal.x[:, 0] + start.x, optimal.y[:, 0] + start.y, optimal.yaw[:, 0])
        return Path(np.column_stack(columns).astype(np.float64))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command, slowed down if a collision is near.

        Raises NO_VALID_CONTROL if all samples collide, if the optimized trajectory collides, or if the slowed-down
        command is too slow.
        """
        tracker, self._pose = self._locate(pose), pose
        if self._goal_rotation.is_position_reached(pose, twist, goal, tracker.remaining()):
            self._reset()
            command = self._goal_rotation.turn_to_goal(pose, goal, twist)
        else:
            critic_data = partial(
                CriticData, plan=upcoming_path(tracker, self._plan_length), pose=pose, goal_yaw=goal.pose.yaw,
                costmap=costmap, footprint=self._footprint, limits=self._limits, dt=self._spec.model_dt,
                tolerance=goal.xy_tolerance,
            )  # fmt: skip
            command = self._optimize(twist, critic_data)
        horizon = self._spec.command_free_time
        free_time = self._collision_checker.free_time(costmap, pose, command, horizon)
        return self._collision_checker.slow_down(command, free_time, horizon, horizon)

    def _optimize(self, twist: Twist, critic_data: Callable[[Rollouts], CriticData]) -> Twist:
        """Optimize the sequence, and return its first command. If the result collides, reset the sequence and retry.

        `critic_data` returns the input of the critics for rollouts.
        """
        for _ in range(1 + self._spec.retry_attempt_limit):
            velocity = self._initial_velocity(twist)
            is_free = False
            for _ in range(self._spec.iteration_count):
                is_free = self._iterate(velocity, critic_data)
            optimal = integrate_velocities(self._sequence[:, :, None], self._pose.yaw, self._spec.model_dt)
            if is_free and self._is_valid(critic_data(optimal)):
                self._optimal, self._optimal_start = optimal, self._pose
                return self._next_command()
            self._reset()
        raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "every trajectory of the optimizer collides")

    def _initial_velocity(self, twist: Twist) -> Floats:
        """Return the velocity (axes,) at the start of the new sequence.

        With `open_loop`, this is the last command. Otherwise, this is the velocity nearest to the last command that the
        base can reach within one period from the measured velocity.
        """
        last_command: Floats = self._sent_commands[:, -1]
        if self._spec.open_loop:
            return last_command
        measured, limits = np.array((twist.vx, twist.wz, twist.vy)), self._limits
        lowest = measured + in_sequence_order(limits.deceleration) * self._period
        highest = measured + in_sequence_order(limits.acceleration) * self._period
        reachable = np.clip(last_command.astype(np.float64), lowest[: self._axes], highest[: self._axes])
        return reachable.astype(np.float32)

    def _iterate(self, velocity: Floats, critic_data: Callable[[Rollouts], CriticData]) -> bool:
        """Replace the sequence by the weighted average of its noisy copies. Return False if all copies collide."""
        spec, limits, dt = self._spec, self._limits, self._spec.model_dt
        self._sequence[:, 0] = velocity
        if spec.regenerate_noises:
            self._draw_noise()
        controls = self._sequence[:, :, None] + self._noise
        velocities = predict_velocities(velocity, controls, limits, dt)
        apply_model_delay(velocities, self._sent_commands, self._delay_steps)
        costs, all_collide = self._critics.costs(critic_data(integrate_velocities(velocities, self._pose.yaw, dt)))
        deviations: list[float] = self._std.tolist()
        average = controls @ sample_weights(
            costs, self._sequence, self._noise, deviations, spec.gamma, spec.temperature
        )
        average = smooth_sequence(average, self._sent_commands[:, -PAST_COMMANDS:], spec.sgf_order)
        self._sequence = apply_limits(average, velocity, limits, dt)
        return not all_collide

    def _is_valid(self, data: CriticData) -> bool:
        """Return whether the optimal trajectory does not collide (Nav2's DefaultOptimalTrajectoryValidator)."""
        spec, optimal = self._spec.TrajectoryValidator, data.rollouts
        steps = min(round(spec.collision_lookahead_time / data.dt), len(optimal.x))
        if steps == 0:
            return True
        consider_footprint = considers_footprint(spec)
        points = data.lookup(optimal.x[:steps], optimal.y[:steps])
        clearance = data.clearance(points, optimal.yaw[:steps], consider_footprint)
        return not data.collides(clearance, consider_footprint).any()

    def _next_command(self) -> Twist:
        """Shift the sequence by one control period, and return its first command."""
        self._sequence = shift_sequence(self._sequence, self._shift_steps)
        first = self._sequence[:, :1]
        self._sent_commands = np.concatenate((self._sent_commands[:, 1:], first), axis=1)
        vx, wz = float(first[VX, 0]), float(first[WZ, 0])
        return Twist(vx, float(first[VY, 0]) if self._axes > VY else 0.0, wz)
