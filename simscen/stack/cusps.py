"""Where a path changes between forward and backward."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array


def forward_steps(poses: Array) -> npt.NDArray[np.bool_]:
    """Whether each of the steps (n - 1,) between poses (n, 3) goes the way the robot looks."""
    steps = np.diff(poses[:, :2], axis=0)
    forward: npt.NDArray[np.bool_] = steps[:, 0] * np.cos(poses[:-1, 2]) + steps[:, 1] * np.sin(poses[:-1, 2]) >= -1e-9
    return forward


def changes(forward: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """The indices of the poses between two steps of which one goes forward and one backward."""
    return np.flatnonzero(forward[1:] != forward[:-1]) + 1


def cusps(poses: Array) -> npt.NDArray[np.int64]:
    """The indices of the poses (n, 3) at which the direction changes."""
    return changes(forward_steps(poses))
