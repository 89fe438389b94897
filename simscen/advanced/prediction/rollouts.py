"""Trajectories of the robot for the next HORIZON_S, with sequences of two velocities or a constant command."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.protocols import RobotModel

STEP_S, HORIZON_S = 0.1, 3.0
"""Time step and duration of a trajectory."""
FIRST_DURATIONS_S = (0.5, 1.2)
"""Durations of the first velocity of a sequence."""
SPEED_RATIOS = (-0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
"""First speeds relative to full speed."""
TURN_RATIOS = (0.0, 0.1, 0.3, 0.6, 1.0)
"""First turn rates relative to the maximum, in both directions."""
SECOND_SPEED_RATIOS = (0.0, 0.5, 1.0)
"""Second speeds relative to full speed. The second turn rate is 0 or the opposite of the first one."""
MAX_TURN_RATE_RAD_S = 3.0
"""Maximum turn rate of sampled trajectories."""

TIMES: Array = np.arange(1, round(HORIZON_S / STEP_S) + 1, dtype=np.float64) * STEP_S
"""Times in s of the points of a trajectory."""


@dataclass(frozen=True, eq=False)
class Rollouts:
    """Trajectories: positions, headings, and forward speeds `vx` at TIMES, each (n, times).

    `commands` (n, 3) are the first commands (vx, vy, wz).
    """

    x: Array
    y: Array
    yaw: Array
    vx: Array
    commands: Array


class TrajectorySampler:
    """Sampler of trajectories with all sequences of two velocities, within the acceleration limits of the robot."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot and its full speed in m/s."""
        self._robot = robot
        max_turn = min(robot.max_angular, MAX_TURN_RATE_RAD_S)
        turns = [0.0, *(sign * ratio * max_turn for ratio in TURN_RATIOS[1:] for sign in (1.0, -1.0))]
        rows = []  # first speed, first turn rate, duration of both, second speed, second turn rate
        for ratio in SPEED_RATIOS:
            vx = ratio * full_speed if ratio >= 0 else max(ratio * full_speed, -robot.max_reverse)
            for wz in turns:
                for duration in FIRST_DURATIONS_S:
                    for second_ratio in SECOND_SPEED_RATIOS:
                        for second_wz in (0.0, -wz) if wz else (0.0,):
                            rows.append((vx, wz, duration, second_ratio * full_speed, second_wz))
        sequences = np.array(sorted(set(rows)))
        if robot.turning_radius > 0.0:
            is_possible = (np.abs(sequences[:, 0]) >= np.abs(sequences[:, 1]) * robot.turning_radius) & (
                np.abs(sequences[:, 3]) >= np.abs(sequences[:, 4]) * robot.turning_radius
            )
            sequences = sequences[is_possible]
        self.commands: Array = np.insert(sequences[:, :2], 1, 0.0, axis=1)
        """First command (n, 3: vx, vy, wz) of each trajectory. Sampled trajectories have no lateral motion."""
        self._speeds, self._speed_profile = np.unique(sequences[:, (0, 2, 3)], axis=0, return_inverse=True)
        self._turns, self._turn_profile = np.unique(sequences[:, (1, 2, 4)], axis=0, return_inverse=True)

    def sample(self, pose: Pose2, twist: Twist) -> "TrajectoryFan":
        """Return all trajectories that start at this pose and velocity."""
        robot, speeds, turns = self._robot, self._speeds, self._turns
        first, duration, second = (speeds[:, k : k + 1] for k in range(3))
        vx = _ramp(twist.vx, first, duration, second, robot.linear_acceleration, robot.linear_deceleration)
        first, duration, second = (turns[:, k : k + 1] for k in range(3))
        wz = _ramp(twist.wz, first, duration, second, robot.angular_acceleration, robot.angular_acceleration)
        yaw = pose.yaw + np.cumsum(wz, axis=1) * STEP_S
        middle = yaw - 0.5 * STEP_S * wz
        profiles = self._speed_profile, self._turn_profile
        return TrajectoryFan(pose, vx, yaw, np.cos(middle), np.sin(middle), *profiles, self.commands)


@dataclass(frozen=True, eq=False)
class TrajectoryFan:
    """Trajectories from one pose, as combinations of k speed profiles and m turn profiles.

    vx (k, times):                speeds of the speed profiles
    yaw (m, times):               headings of the turn profiles
    cosine, sine (m, times):      cosine and sine of the headings in the middle of each time step
    speed_profile, turn_profile:  indices (n,) of the profiles of each trajectory
    commands (n, 3):              first command (vx, vy, wz) of each trajectory
    """

    pose: Pose2
    vx: Array
    yaw: Array
    cosine: Array
    sine: Array
    speed_profile: npt.NDArray[np.intp]
    turn_profile: npt.NDArray[np.intp]
    commands: Array

    @property
    def ends(self) -> tuple[Array, Array]:
        """Final x and y (n,) of the trajectories."""
        speed, turn, (x, y, _) = self.speed_profile, self.turn_profile, self.pose
        dx, dy = self.vx @ self.cosine.T, self.vx @ self.sine.T
        return x + dx[speed, turn] * STEP_S, y + dy[speed, turn] * STEP_S

    def rollouts(self, indices: npt.NDArray[np.intp], steps: int = len(TIMES)) -> Rollouts:
        """Return the trajectories with these indices (k,), for the first `steps` time steps."""
        window, turn = np.s_[:, :steps], self.turn_profile[indices]
        vx = self.vx[window][self.speed_profile[indices]]
        x = self.pose.x + np.cumsum(vx * self.cosine[window][turn], axis=1) * STEP_S
        y = self.pose.y + np.cumsum(vx * self.sine[window][turn], axis=1) * STEP_S
        return Rollouts(x, y, self.yaw[window][turn], vx, self.commands[indices])


def _ramp(
    start: float, first: Array, duration: Array, second: Array, acceleration: float, deceleration: float
) -> Array:
    """Return velocities (n, times) that change from `start` to `first` (n, 1), and after `duration` in s to `second`.

    The rates of change are limited by `acceleration` and `deceleration`.
    """
    change = np.where(np.abs(first) >= abs(start), acceleration, deceleration) * np.minimum(TIMES, duration)
    before = start + np.clip(first - start, -change, change)
    change = np.where(np.abs(second) >= np.abs(before), acceleration, deceleration) * np.maximum(TIMES - duration, 0.0)
    ramped: Array = before + np.clip(second - before, -change, change)
    return ramped


def arc_rollouts(pose: Pose2, command: Twist, fractions: tuple[float, ...]) -> Rollouts:
    """Return the trajectories of a robot that follows no path: a constant command at `fractions` of its velocity."""
    scale = np.array(fractions)[:, None]
    vx, vy, wz = (scale * velocity + 0.0 * TIMES for velocity in command)
    yaw = pose.yaw + wz * TIMES
    middle = yaw - 0.5 * STEP_S * wz
    cosine, sine = np.cos(middle), np.sin(middle)
    x = pose.x + np.cumsum(vx * cosine - vy * sine, axis=1) * STEP_S
    y = pose.y + np.cumsum(vx * sine + vy * cosine, axis=1) * STEP_S
    return Rollouts(x, y, yaw, vx, scale * np.array(command))
