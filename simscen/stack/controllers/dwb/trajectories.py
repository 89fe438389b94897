"""Where the velocities that DWB tries lead: dwb_plugins' StandardTrajectoryGenerator."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.controllers.dwb.kinematics import Kinematics
from simscen.stack.controllers.sums import add_up


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Positions (steps, n) of trajectories that begin where the robot is, and headings (steps, m) of the few turns.

    `turn` (n,) says which of the headings are each trajectory's: most share theirs with others, and sines are dear.
    `passed` (steps, m) are the seconds till then.
    """

    x: Array
    y: Array
    yaw: Array
    turn: npt.NDArray[np.intp]
    passed: Array

    def __len__(self) -> int:
        return len(self.turn)

    @property
    def ends(self) -> Array:
        """The last poses (n, 3)."""
        return np.column_stack((self.x[-1], self.y[-1], self.yaw[-1, self.turn]))

    def poses(self, which: npt.NDArray[np.intp]) -> Array:
        """All poses (steps, k, 3) of k of them."""
        return np.stack((self.x[:, which], self.y[:, which], self.yaw[:, self.turn[which]]), axis=-1)


def trajectories(
    pose: Pose2, now: Twist, velocities: Array, kinematics: Kinematics, seconds: float, meters: float, radians: float
) -> Trajectories:
    """Of a base that changes to each of the velocities (n, 3).

    A trajectory has as many steps as it takes for none to be longer than `meters` or to turn by more than `radians`
    at its velocity; those with fewer than others stay at their end. Each step keeps the heading it begins with.
    """
    linear = np.hypot(velocities[:, 0], velocities[:, 1]) * seconds / meters
    counts = np.maximum(1.0, np.ceil(np.maximum(linear, np.abs(velocities[:, 2]) * seconds / radians)))
    _, one, turn = np.unique(velocities[:, 2] + 1j * counts, return_index=True, return_inverse=True)
    count, dt = counts[one], seconds / counts[one]
    number = np.arange(math.ceil(counts.max()) + 1)[:, None]
    moments, number = np.minimum(number, count) * dt, number[1:]
    after, lasts = moments[1:], np.where(number <= count, dt, 0.0)
    bounds = list(zip(now, kinematics.acceleration, kinematics.deceleration, strict=True))
    wz = _changing(velocities[one, 2], *bounds[2], after)
    yaw = _from(pose.yaw, wz * lasts)
    cosine, sine = (each.take(turn, axis=1) for each in (np.cos(yaw[:-1]) * lasts, np.sin(yaw[:-1]) * lasts))
    passed = after.take(turn, axis=1)
    vx = _changing(velocities[:, 0], *bounds[0], passed)
    dx, dy = vx * cosine, vx * sine
    if now.vy != 0.0 or velocities[:, 1].any():
        vy = _changing(velocities[:, 1], *bounds[1], passed)
        dx, dy = dx - vy * sine, dy + vy * cosine
    return Trajectories(_from(pose.x, dx), _from(pose.y, dy), yaw, turn, moments)


def _changing(target: Array, start: float, up: float, down: float, passed: Array) -> Array:
    """The velocities (steps, n) on the way from `start` to the targets (n,), after so many seconds."""
    velocities = passed * np.where(start < target, up, down)
    velocities += start
    np.maximum(velocities, np.minimum(start, target), out=velocities)
    return np.minimum(velocities, np.maximum(start, target), out=velocities)


def _from(start: float, steps: Array) -> Array:
    """Where steps (m, n) lead from a start: (m + 1, n)."""
    places = np.empty((len(steps) + 1, steps.shape[1]))
    places[0], places[1:] = 0.0, steps
    add_up(places[1:])
    places += start
    return places
