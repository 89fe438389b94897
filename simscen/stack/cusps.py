"""Cusps of a path: the poses at which it changes between forward and backward driving."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array


def forward_steps(poses: Array) -> npt.NDArray[np.bool_]:
    """Return for each step (n - 1,) between poses (n, 3) whether it points forward in the robot's heading."""
    steps = np.diff(poses[:, :2], axis=0)
    forward: npt.NDArray[np.bool_] = steps[:, 0] * np.cos(poses[:-1, 2]) + steps[:, 1] * np.sin(poses[:-1, 2]) >= -1e-9
    return forward


def changes(forward: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Return the indices of the poses between a forward and a backward step."""
    return np.flatnonzero(forward[1:] != forward[:-1]) + 1


def cusps(poses: Array) -> npt.NDArray[np.int64]:
    """Return the indices of the cusps among the poses (n, 3)."""
    return changes(forward_steps(poses))
