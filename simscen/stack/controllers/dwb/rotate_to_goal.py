"""Turning to the goal's heading, once the robot is there: dwb_critics' RotateToGoalCritic."""

import math

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.kinematics import Twist
from simscen.stack.controllers.dwb.map_grid import Mask


class RotateToGoal:
    """Demands that the robot slows down at the goal, then that it only turns; scores by how far off its heading is."""

    def __init__(self, stopped: float, slowing: float) -> None:
        self._stopped, self._slowing = stopped, slowing
        self.reset()

    def reset(self) -> None:
        """A new path."""
        self._rotating = False

    def scores(self, now: Twist, goal_yaw: float, velocities: Array, end_yaws: Array) -> tuple[Array, Mask]:
        """Scores (n,) at the goal and which velocities (n, 3) are legal there; end_yaws (n,) are where they lead."""
        speed = math.hypot(now.vx, now.vy)
        self._rotating |= speed <= self._stopped
        square = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        off = np.abs((end_yaws - goal_yaw + np.pi) % (2.0 * np.pi) - np.pi)
        if self._rotating:
            return off, np.asarray(square == 0.0)
        return np.asarray(square * self._slowing + off), np.asarray(square < speed**2)
