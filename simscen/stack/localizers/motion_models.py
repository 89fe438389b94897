"""What odometry says about where each particle went.

The odometry motion model of Thrun, Burgard & Fox, Probabilistic Robotics, section 5.4 and table 5.6, with the
variances of nav2_amcl: alphas multiply *squared* motions, backward motion is as noisy as forward motion, and a
translation below 1 cm has no bearing.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap, wrap_array
from simscen.stack.localizers.planar_motion import swing

NO_BEARING = 0.01


class MotionModel(Protocol):
    """Moves particles; `delta` is the motion that odometry reports, in the base frame before it."""

    def sample(self, poses: Array, delta: Pose2, chance: np.random.Generator) -> Array:
        """New poses (n, 3): each of `poses` (n, 3) moved by its own noisy copy of `delta`."""
        ...

    def carry(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """The covariance (3, 3) after `delta`, to first order, of a pose that had `covariance` and heading `yaw`."""
        ...


@dataclass(frozen=True)
class Differential:
    """Turn, drive, turn (table 5.6), for robots that cannot move sideways. `alpha` are alpha1 … alpha4."""

    alpha: tuple[float, float, float, float]

    def sample(self, poses: Array, delta: Pose2, chance: np.random.Generator) -> Array:
        """New poses (n, 3)."""
        motion, std = self._steps(delta)
        turn, drive, turn_again = (chance.standard_normal((len(poses), 3)) * std + motion).T
        heading = poses[:, 2] + turn
        moved = np.empty_like(poses)
        moved[:, 0] = poses[:, 0] + drive * np.cos(heading)
        moved[:, 1] = poses[:, 1] + drive * np.sin(heading)
        moved[:, 2] = wrap_array(heading + turn_again)
        return moved

    def carry(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """The covariance (3, 3) to first order."""
        (turn, drive, _), (turn_std, drive_std, again_std) = self._steps(delta)
        c, s = math.cos(yaw + turn), math.sin(yaw + turn)
        dx, dy, turned, driven = drive * c, drive * s, turn_std**2, drive_std**2
        across = (driven - drive**2 * turned) * c * s
        noise = np.array([
            [dy**2 * turned + c**2 * driven, across, -dy * turned],
            [across, dx**2 * turned + s**2 * driven, dx * turned],
            [-dy * turned, dx * turned, turned + again_std**2],
        ])  # fmt: skip
        carried: Array = swing(covariance, dx, dy) + noise
        return carried

    def _steps(self, delta: Pose2) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The three steps of a motion and the standard deviations of their noise."""
        drive = math.hypot(delta.x, delta.y)
        turn = math.atan2(delta.y, delta.x) if drive >= NO_BEARING else 0.0
        again = wrap(delta.yaw - turn)
        turned, turned_again = _either_way(turn) ** 2, _either_way(again) ** 2
        a1, a2, a3, a4 = self.alpha
        return (turn, drive, again), (
            math.sqrt(a1 * turned + a2 * drive**2),
            math.sqrt(a3 * drive**2 + a4 * (turned + turned_again)),
            math.sqrt(a1 * turned_again + a2 * drive**2),
        )


@dataclass(frozen=True)
class Omni:
    """Drive, strafe and turn at once, for holonomic robots (nav2_amcl::OmniMotionModel). `alpha` are alpha1 … 5."""

    alpha: tuple[float, float, float, float, float]

    def sample(self, poses: Array, delta: Pose2, chance: np.random.Generator) -> Array:
        """New poses (n, 3)."""
        motion, std = (math.hypot(delta.x, delta.y), 0.0, delta.yaw), self._noise(delta)
        drive, strafe, turn = (chance.standard_normal((len(poses), 3)) * std + motion).T
        bearing = poses[:, 2] + math.atan2(delta.y, delta.x)
        c, s = np.cos(bearing), np.sin(bearing)
        moved = np.empty_like(poses)
        moved[:, 0] = poses[:, 0] + drive * c + strafe * s
        moved[:, 1] = poses[:, 1] + drive * s - strafe * c
        moved[:, 2] = wrap_array(poses[:, 2] + turn)
        return moved

    def carry(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """The covariance (3, 3) to first order."""
        bearing = yaw + math.atan2(delta.y, delta.x)
        drive, c, s = math.hypot(delta.x, delta.y), math.cos(bearing), math.sin(bearing)
        noise = np.array([[c, s, 0], [s, -c, 0], [0, 0, 1]]) * self._noise(delta)
        carried: Array = swing(covariance, drive * c, drive * s) + noise @ noise.T
        return carried

    def _noise(self, delta: Pose2) -> tuple[float, float, float]:
        """Standard deviations of driving, strafing and turning."""
        driven, turned = delta.x**2 + delta.y**2, delta.yaw**2
        a1, a2, a3, a4, a5 = self.alpha
        drive = math.sqrt(a3 * driven + a4 * turned)
        return drive, math.sqrt(a4 * turned + a5 * driven), math.sqrt(a1 * turned + a2 * driven)


def _either_way(angle: float) -> float:
    """The size of an angle when driving backward counts as driving forward."""
    return min(abs(angle), abs(wrap(angle - math.pi)))
