"""Model predictive path integral control (Williams et al. 2017), as in nav2_mppi_controller.

A control sequence is an array (axes, steps) of velocities. The axes are vx, wz, and for a holonomic base vy. Noisy
copies (samples) of the previous sequence are simulated and scored. The new sequence is their average, weighted by
exp(-cost / temperature).
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.collision_checker import CollisionChecker
from simscen.stack.controllers.mppi.critic_data import CriticData
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
from simscen.stack.controllers.path_follower import GoalRotation, PathFollower
from simscen.stack.controllers.path_handler import UpcomingPath, upcoming_path
from simscen.stack.kinematics import VelocityLimits
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

SMOOTHING_KERNELS = {
    1: np.full(9, 1.0 / 9.0, np.float32),
    2: np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], np.float32) / np.float32(231.0),
}
"""Savitzky-Golay filters of nine points by the order of their polynomial (Savitzky and Golay 1964)."""
MIN_SMOOTHED_STEPS = 21
"""Minimum length of a control sequence to be smoothed."""
PAST_COMMANDS = 4
"""Number of previous commands that a filter of nine points needs to smooth the first step."""


def sample_weights(
    costs: Array, sequence: Floats, noise: Floats, deviations: Sequence[float], gamma: float, temperature: float
) -> Floats:
    """Return the weights (n,) of samples with these costs (n,), proportional to exp(-cost / temperature).

    `noise` (axes, steps, n) was added to the sequence. `deviations` are the standard deviations of the noise by axis.
    Each cost includes the control cost: `gamma` times the product of sequence and noise, divided by the variance.
    """
    total = costs.copy()
    for axis, deviation in enumerate(deviations):
        if deviation > 0.0:
            total += gamma / deviation**2 * (sequence[axis] @ noise[axis])
    weights = np.exp((total.min() - total) / temperature)
    return np.asarray(weights / weights.sum(), np.float32)


def smooth_sequence(sequence: Floats, past: Floats, order: int) -> Floats:
    """Return the sequence, smoothed except for its last step. `past` (axes, 4) are the commands before the sequence.

    `order` is a key of SMOOTHING_KERNELS.
    """
    if sequence.shape[1] < MIN_SMOOTHED_STEPS:
        return sequence
    padded = np.concatenate((past, sequence, np.repeat(sequence[:, -1:], PAST_COMMANDS, axis=1)), axis=1)
    result: Floats = sequence.copy()
    for axis, row in enumerate(padded):
        result[axis, :-1] = np.convolve(row, SMOOTHING_KERNELS[order], mode="valid")[:-1]
    return result


def apply_limits(sequence: Floats, now: Floats, limits: VelocityLimits, dt: float) -> Floats:
    """Return the sequence within the velocity and acceleration limits. Its first step is the velocity `now` (axes,).

    Modifies `sequence`. `dt` is the time step in s.
    """
    low, high = in_sequence_order(limits.low).tolist(), in_sequence_order(limits.high).tolist()
    increase = (in_sequence_order(limits.acceleration) * dt).tolist()
    decrease = (in_sequence_order(limits.deceleration) * dt).tolist()
    _limit_curvature(sequence, limits)
    result = np.empty_like(sequence)
    for axis in range(len(sequence)):
        result[axis] = _limit_axis(
            sequence[axis].tolist(), float(now[axis]), (low[axis], high[axis]), (increase[axis], decrease[axis])
        )
    _limit_curvature(result, limits)
    return result


def _limit_axis(
    requested: list[float], now: float, bounds: tuple[float, float], changes: tuple[float, float]
) -> list[float]:
    """Return the velocities of one axis within `bounds` (low, high), with limited `changes` per step (up, down)."""
    (low, high), (up, down) = bounds, changes
    limited, last = [now], now
    for velocity in requested[1:]:
        target = low if velocity < low else min(velocity, high)
        lowest, highest = (last + down, last + up) if last >= 0.0 else (last - up, last - down)
        last = lowest if target < lowest else highest if target > highest else target
        limited.append(last)
    return limited


def _limit_curvature(sequence: Floats, limits: VelocityLimits) -> None:
    """Limit the turn rates of a car to its turning radius, in place."""
    if limits.turning_radius > 0.0:
        max_turn_rate = np.abs(sequence[VX]) / np.float32(limits.turning_radius)
        np.clip(sequence[WZ], -max_turn_rate, max_turn_rate, out=sequence[WZ])


def shift_sequence(sequence: Floats, steps: float) -> Floats:
    """Return the sequence, advanced by `steps` with linear interpolation. The last value is repeated."""
    index = np.arange(sequence.shape[1], dtype=np.float64)
    return np.stack([np.interp(index + steps, index, row) for row in sequence]).astype(np.float32)


PLAN_MARGIN_M = 1.0
"""Length of the plan for the critics, in addition to the distance that the robot can drive within the horizon."""
SPEED_STD_RATIO = 0.5
"""Default standard deviation of the sampled speeds, relative to the maximum speed."""


class MppiController(PathFollower):
    """Controller that optimizes a control sequence in each control period, starting from the previous one."""

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
        self._critics = CriticManager(spec, omni=model == "Omni")
        self._period, self._shift_steps = setting.control_period, setting.control_period / spec.model_dt
        self._goal_rotation = GoalRotation(
            robot, spec.wz_max, robot.angular_acceleration, setting.control_period, spec.goal_tolerance_ratio
        )
        self._collision_checker = CollisionChecker(setting.footprint, spec.min_slowed_speed)
        reach = self._full_speed * spec.time_steps * spec.model_dt
        self._plan_length = max(spec.prune_distance, reach + PLAN_MARGIN_M)
        self._pose, self._optimal_from = Pose2(0.0, 0.0), Pose2(0.0, 0.0)
        self._reset()

    def _reset(self) -> None:
        """Restart with a zero sequence and new noise."""
        axes, steps = self._axes, self._spec.time_steps
        self._sequence = np.zeros((axes, steps), np.float32)
        self._sent = np.zeros((axes, max(PAST_COMMANDS, *self._delay_steps)), np.float32)
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
        """The velocity limits under the current speed limit."""
        return self._full_limits.scaled(self._speed_ratio)

    @property
    def local_plan(self) -> Path | None:
        """Trajectory of the optimized control sequence; None before the first one and at the goal."""
        return None if self._optimal is None else Path(self._poses(self._optimal))

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command, slowed down if a collision is near.

        Raises NO_VALID_CONTROL if all samples or their average collide, or if the slowed-down command is too slow.
        """
        tracker, self._pose = self._locate(pose), pose
        if self._goal_rotation.is_position_reached(pose, twist, goal, tracker.remaining()):
            self._reset()
            command = self._goal_rotation.turn_to_goal(pose, goal, twist)
        else:
            plan = upcoming_path(tracker, self._plan_length)
            command = self._optimize(twist, lambda rollouts: self._critic_data(rollouts, plan, costmap, goal))
        required = self._spec.command_free_time
        free_time = self._collision_checker.free_time(costmap, pose, command, required)
        return self._collision_checker.slow_down(command, free_time, required, required)

    def _critic_data(self, rollouts: Rollouts, plan: UpcomingPath, costmap: CostmapView, goal: Goal) -> CriticData:
        """Return the input of the critics for these rollouts."""
        return CriticData(
            rollouts, plan, self._pose, goal.pose.yaw, costmap, self._footprint, self._limits, self._spec.model_dt,
            goal.xy_tolerance,
        )  # fmt: skip

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
                self._optimal, self._optimal_from = optimal, self._pose
                return self._next_command()
            self._reset()
        raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "every trajectory of the optimizer collides")

    def _initial_velocity(self, twist: Twist) -> Floats:
        """Return the velocity (axes,) at the start of the new sequence.

        With `open_loop`, it is the last command. Otherwise, it is the velocity nearest to the last command that the
        base can reach within one period from its measured velocity.
        """
        sent, limits = self._sent[:, -1].astype(np.float64), self._limits
        if self._spec.open_loop:
            return self._sent[:, -1]
        measured = np.array((twist.vx, twist.wz, twist.vy))[: self._axes]
        lowest = measured + (in_sequence_order(limits.deceleration) * self._period)[: self._axes]
        highest = measured + (in_sequence_order(limits.acceleration) * self._period)[: self._axes]
        reachable = np.clip(sent, lowest, highest)
        return reachable.astype(np.float32)

    def _iterate(self, velocity: Floats, critic_data: Callable[[Rollouts], CriticData]) -> bool:
        """Replace the sequence by the weighted average of its noisy copies. Return False if all copies collide."""
        spec, limits, dt = self._spec, self._limits, self._spec.model_dt
        self._sequence[:, 0] = velocity
        if spec.regenerate_noises:
            self._draw_noise()
        controls = self._sequence[:, :, None] + self._noise
        velocities = predict_velocities(velocity, controls, limits, dt)
        apply_model_delay(velocities, self._sent, self._delay_steps)
        costs, all_collide = self._critics.costs(critic_data(integrate_velocities(velocities, self._pose.yaw, dt)))
        deviations: list[float] = self._std.tolist()
        average = controls @ sample_weights(
            costs, self._sequence, self._noise, deviations, spec.gamma, spec.temperature
        )
        average = smooth_sequence(average, self._sent[:, -PAST_COMMANDS:], spec.sgf_order)
        self._sequence = apply_limits(average, velocity, limits, dt)
        return not all_collide

    def _is_valid(self, data: CriticData) -> bool:
        """Return whether the optimal trajectory does not collide (Nav2's DefaultOptimalTrajectoryValidator)."""
        spec, optimal = self._spec.TrajectoryValidator, data.rollouts
        steps = min(round(spec.collision_lookahead_time / data.dt), len(optimal.x))
        if steps == 0:
            return True
        consider_footprint = spec.consider_footprint is not False
        points = data.lookup(optimal.x[:steps], optimal.y[:steps])
        clearance = data.clearance(points, optimal.yaw[:steps], consider_footprint)
        return not data.collides(clearance, consider_footprint).any()

    def _next_command(self) -> Twist:
        """Shift the sequence by one control period, and return its first command."""
        self._sequence = shift_sequence(self._sequence, self._shift_steps)
        first = self._sequence[:, :1]
        self._sent = np.concatenate((self._sent[:, 1:], first), axis=1)
        vx, wz = float(first[VX, 0]), float(first[WZ, 0])
        return Twist(vx, float(first[VY, 0]) if self._axes > VY else 0.0, wz)

    def _poses(self, rollouts: Rollouts) -> Array:
        """Return the poses (steps, 3) of a single rollout in the odom frame."""
        start = self._optimal_from
        columns = (rollouts.x[:, 0] + start.x, rollouts.y[:, 0] + start.y, rollouts.yaw[:, 0])
        return np.column_stack(columns).astype(np.float64)
