"""How far off a pose may be: by how the poses of the last metres scatter about the way that the robot saw itself go."""

import math
from collections import deque

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.localizers.planar_motion import swing
from simscen.stack.localizers.scan_memory import METRES_A_RAD

COUNTED = 36
"""Corrections whose poses are opinions of where the robot is now: some 9 m of driving."""
FEWEST = 8
"""Opinions from which on they say how much they usually scatter."""
FORGOTTEN = 0.99
"""How much of what they said before counts still, after each correction."""
BEFORE = 5.0
"""Corrections that the particles' own covariance counts for before anything has scattered."""
WHEELS = 0.05, 0.05
"""Standard deviations of odometry before it was compared with steps that were seen: m and rad for each metre."""
COMPARED = 1.0
"""m²: squares of steps that these count for."""
LEAST = np.diag(np.square((1e-3, 1e-3, 1e-3)))
"""m, m, rad: nothing is known better, so that no covariance is singular."""


class Scatter:
    """Widens the covariance of particles, which take each scan for news and each beam for independent.

    What stands elsewhere than the map shows it, and cells that are half a cell off, pull scan after scan the same way
    for as long as they are in sight: the particles agree, and are wrong together. Scans that are matched with each
    other know nothing of the map, and over some metres err less than that. So each of the last COUNTED poses, carried
    on to the present by how the robot saw itself move, is an opinion of where it is, and their mean squared difference
    from the pose that is told is about what that is off by. They hang together, and are few: alone they would tell a
    covariance badly. So what is told is the mean of theirs and of the particles' own, times how much more the opinions
    usually scatter than that says (geometric mean since the start, the latest hundred corrections above all).
    Between corrections it grows as odometry has been seen to err.
    """

    def __init__(self) -> None:
        self._poses: deque[tuple[complex, float]] = deque(maxlen=COUNTED)
        self._bases: deque[tuple[complex, float]] = deque(maxlen=COUNTED)
        self._weights: deque[float] = deque(maxlen=COUNTED)
        self._logarithms, self._counts = 0.0, 0.0
        self._off, self._turned, self._squares = WHEELS[0] ** 2 * COMPARED, WHEELS[1] ** 2 * COMPARED, COMPARED

    def compare(self, seen: Pose2, odometry: Pose2) -> None:
        """Take in what the scans show of a step of which odometry says something else."""
        x, y, yaw = odometry.between(seen)
        self._off = FORGOTTEN * self._off + (x * x + y * y) / 2
        self._turned = FORGOTTEN * self._turned + yaw * yaw
        self._squares = FORGOTTEN * self._squares + _way(odometry) ** 2

    def carry(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """The covariance (3, 3) after `delta` of odometry, which errs as it did, of a pose with heading `yaw`."""
        c, s, share = math.cos(yaw), math.sin(yaw), _way(delta) ** 2 / self._squares
        aside = self._off * share
        noise = aside, 0.0, 0.0, aside, 0.0, self._turned * share
        return swing(covariance, c * delta.x - s * delta.y, s * delta.x + c * delta.y, noise)

    def widened(self, pose: Pose2, covariance: Array, base: Pose2) -> Array:
        """The covariance (3, 3) of `pose` after a correction, where the particles say `covariance`.

        `base` is where the robot is in a frame that drifts slowly: what its scans say without the map.
        """
        self._poses.append((complex(pose.x, pose.y), pose.yaw))
        self._bases.append((complex(base.x, base.y), base.yaw))
        own = covariance + LEAST
        self._weights.append(float(own[0, 0] + own[1, 1]) ** -0.5)
        scattered = self._scattered() + LEAST
        if len(self._poses) >= FEWEST:
            more = float(np.trace(np.linalg.solve(own, scattered))) / len(own)
            self._logarithms = FORGOTTEN * self._logarithms + math.log(more)
            self._counts = FORGOTTEN * self._counts + 1.0
        usually = math.exp(self._logarithms / (self._counts + BEFORE))
        widened: Array = (usually * own + scattered) / 2
        return widened

    def _scattered(self) -> Array:
        """The mean squared difference (3, 3) of the opinions from the newest pose, as if they were COUNTED.

        Each weighs as much as its particles were sure of it (1/m), for the first metres from a place that was told
        say little. Fewer do not reach as far back, and so do not scatter as much, about in proportion.
        """
        (poses, headings), (bases, base_headings) = (
            [np.array(values) for values in zip(*held, strict=True)] for held in (self._poses, self._bases)
        )
        turned = headings - base_headings
        places = poses + np.exp(1j * turned) * (bases[-1] - bases) - poses[-1]
        off = np.stack((places.real, places.imag, wrap_array(turned - turned[-1])))
        shares = np.array(self._weights)
        shares /= shares.sum()
        scattered: Array = (off * shares) @ off.T * (COUNTED * float(shares @ shares))
        return scattered


def _way(step: Pose2) -> float:
    """Metres, turns included."""
    return math.hypot(step.x, step.y) + METRES_A_RAD * abs(step.yaw)
