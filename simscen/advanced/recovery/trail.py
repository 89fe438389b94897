"""The way that a robot came, from where it is backward: without the loops, at even steps, turns included."""

import math
from collections.abc import Sequence

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array

STEP = 0.01
"""Meters that the hull moves between two poses of a trail; turning in place moves it, too."""
AGAIN, LOOP = 0.12, 0.3
"""Meters of the hull within which it is where it has been, and by which it must have moved meanwhile: what lies between
was to and fro."""
ASIDE = 0.1
"""Share of its way that a base must have gone sideways to have strafed; one that slips does so, too, by less."""


class Trail:
    """Poses (n, 3) to go back by, the first one where the robot is, and how far (n,) the hull has moved until each.

    Where the way is not known any more it goes on straight backward.
    """

    def __init__(self, way: Sequence[Pose2], pose: Pose2, lever: float, length: float) -> None:
        """`lever`: meters from the base to the hull's far end; `length`: meters that the base needs at least."""
        self._lever = lever
        came = self._thinned(np.array([pose, *reversed(way)], dtype=np.float64))
        self.strafed = _strafed(came)
        """Whether the base moved sideways on its way."""
        back = self._without_loops(came)
        x, y, yaw = back[-1].tolist()
        end = (x - length * math.cos(yaw), y - length * math.sin(yaw), yaw)
        self.known = len(self._even(back))
        """How many of the poses it really came by."""
        self.poses = self._even(np.concatenate((back, [end])))
        self.along = np.concatenate(([0.0], np.cumsum(self.apart(self.poses[1:], self.poses[:-1]))))
        steps = np.hypot(np.diff(self.poses[:, 0]), np.diff(self.poses[:, 1]))
        self.driven = np.concatenate(([0.0], np.cumsum(steps)))
        """Meters (n,) that the base itself has gone until each."""

    def apart(self, poses: Array, others: Array) -> Array:
        """How far (…,) the hull moves from poses (…, 3) to others."""
        turned = np.abs(wrap_array(poses[..., 2] - others[..., 2]))
        return np.asarray(
            np.hypot(poses[..., 0] - others[..., 0], poses[..., 1] - others[..., 1]) + self._lever * turned
        )

    def _thinned(self, back: Array) -> Array:
        """The poses between which the hull moves by STEP at least."""
        kept = [0]
        for k in range(1, len(back)):
            if self.apart(back[k], back[kept[-1]]) >= STEP:
                kept.append(k)
        return back[kept]

    def _without_loops(self, back: Array) -> Array:
        """What leads from the first to the last pose without coming by a place, and a heading, twice."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        kept, k = [0], 0
        while k < len(back) - 1:
            near = (self.apart(back, back[k]) <= AGAIN) & (moved >= moved[k] + LOOP)
            k = int(near.nonzero()[0][-1]) if near.any() else k + 1
            kept.append(k)
        return back[kept]

    def _even(self, back: Array) -> Array:
        """The same way by even steps."""
        moved = np.concatenate(([0.0], np.cumsum(self.apart(back[1:], back[:-1]))))
        at = np.arange(0.0, moved[-1], STEP)
        back = np.column_stack((back[:, :2], np.unwrap(back[:, 2])))
        return np.column_stack([np.interp(at, moved, column) for column in back.T])


def _strafed(came: Array) -> bool:
    steps, yaw = np.diff(came[:, :2], axis=0), came[:-1, 2] + wrap_array(np.diff(came[:, 2])) / 2
    aside = np.abs(np.cos(yaw) * steps[:, 1] - np.sin(yaw) * steps[:, 0])
    return bool(aside.sum() > ASIDE * np.hypot(*steps.T).sum())
