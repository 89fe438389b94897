"""Motion models of nav2_amcl, which move particles by odometry and random noise.

Source: the odometry motion model of Probabilistic Robotics, section 5.4 and table 5.6, with the variances of nav2_amcl.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.stack.localizers.dead_reckoning import propagate_covariance
from simscen.stack.localizers.particles import empty_poses, wrap_headings

MIN_BEARING_DISTANCE_M = 0.01
"""Minimum length of a translation from which its direction is used."""


class MotionModel(Protocol):
    """Moves particles by odometry. `delta` is the measured motion, in the base frame before the motion."""

    def sample(self, poses: Array, delta: Pose2, rng: np.random.Generator) -> Array:
        """Return `poses` (n, 3), each moved by `delta` with its own random noise."""
        ...

    def propagate(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """Return the linearized covariance (3, 3) of a pose after `delta`. `yaw` is the heading before the motion."""
        ...


@dataclass(frozen=True)
class DifferentialMotionModel:
    """Model of robots that cannot move sideways: a rotation, a translation, and a second rotation.

    `alpha` are Nav2's parameters alpha1 … alpha4.
    """

    alpha: tuple[float, float, float, float]

    def sample(self, poses: Array, delta: Pose2, rng: np.random.Generator) -> Array:
        """Return the moved poses (n, 3)."""
        motion, variances = self._steps(delta)
        std = [math.sqrt(variance) for variance in variances]
        turn, drive, second_turn = rng.standard_normal((3, len(poses))) * np.array([std]).T + np.array([motion]).T
        heading = poses[:, 2] + turn
        moved = empty_poses(len(poses))
        moved[:, 0] = poses[:, 0] + drive * np.cos(heading)
        moved[:, 1] = poses[:, 1] + drive * np.sin(heading)
        moved[:, 2] = wrap_headings(heading + second_turn)
        return moved

    def propagate(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """Return the linearized covariance (3, 3) after the motion."""
        (turn, drive, _), (turn_var, drive_var, second_turn_var) = self._steps(delta)
        c, s = math.cos(yaw + turn), math.sin(yaw + turn)
        dx, dy, xy = drive * c, drive * s, (drive_var - drive**2 * turn_var) * c * s
        return propagate_covariance(covariance, dx, dy, (
            dy * dy * turn_var + c * c * drive_var, xy, -dy * turn_var,
            dx * dx * turn_var + s * s * drive_var, dx * turn_var,
            turn_var + second_turn_var,
        ))  # fmt: skip

    def _steps(self, delta: Pose2) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return (first rotation, translation, second rotation), and the variances of their noise in the same order."""
        drive = math.hypot(delta.x, delta.y)
        turn = math.atan2(delta.y, delta.x) if drive >= MIN_BEARING_DISTANCE_M else 0.0
        second_turn = wrap(delta.yaw - turn)
        turn2, drive2, second_turn2 = _fold_backward(turn) ** 2, drive * drive, _fold_backward(second_turn) ** 2
        a1, a2, a3, a4 = self.alpha
        return (turn, drive, second_turn), (
            a1 * turn2 + a2 * drive2, a3 * drive2 + a4 * (turn2 + second_turn2), a1 * second_turn2 + a2 * drive2,
        )  # fmt: skip


@dataclass(frozen=True)
class OmniMotionModel:
    """Model of holonomic robots, which drive, strafe, and turn at once.

    `alpha` are Nav2's parameters alpha1 … alpha5.
    """

    alpha: tuple[float, float, float, float, float]

    def sample(self, poses: Array, delta: Pose2, rng: np.random.Generator) -> Array:
        """Return the moved poses (n, 3)."""
        motion, std = (math.hypot(delta.x, delta.y), 0.0, delta.yaw), self._noise(delta)
        drive, strafe, turn = rng.standard_normal((3, len(poses))) * np.array([std]).T + np.array([motion]).T
        bearing = poses[:, 2] + math.atan2(delta.y, delta.x)
        c, s = np.cos(bearing), np.sin(bearing)
        moved = empty_poses(len(poses))
        moved[:, 0] = poses[:, 0] + drive * c + strafe * s
        moved[:, 1] = poses[:, 1] + drive * s - strafe * c
        moved[:, 2] = wrap_headings(poses[:, 2] + turn)
        return moved

    def propagate(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """Return the linearized covariance (3, 3) after the motion."""
        bearing = yaw + math.atan2(delta.y, delta.x)
        drive, c, s = math.hypot(delta.x, delta.y), math.cos(bearing), math.sin(bearing)
        drive_var, strafe_var, turn_var = (std**2 for std in self._noise(delta))
        return propagate_covariance(covariance, drive * c, drive * s, (
            c * c * drive_var + s * s * strafe_var, c * s * (drive_var - strafe_var), 0.0,
            s * s * drive_var + c * c * strafe_var, 0.0,
            turn_var,
        ))  # fmt: skip

    def _noise(self, delta: Pose2) -> tuple[float, float, float]:
        """Return the standard deviations (drive, strafe, turn) of the noise."""
        drive2, turn2 = delta.x**2 + delta.y**2, delta.yaw**2
        a1, a2, a3, a4, a5 = self.alpha
        drive_std, strafe_std = math.sqrt(a3 * drive2 + a4 * turn2), math.sqrt(a4 * turn2 + a5 * drive2)
        return drive_std, strafe_std, math.sqrt(a1 * turn2 + a2 * drive2)


def _fold_backward(angle: float) -> float:
    """Return the smaller of |angle| and π - |angle|, so that backward motion is as noisy as forward motion."""
    size = abs(angle)
    return min(size, math.pi - size)
