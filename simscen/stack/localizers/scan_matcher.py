"""How far a robot went between two scans, from what it saw: odometry is the guess, and what the scans leave open.

Iterated closest points with a point-to-line metric (Censi, An ICP variant using a point-to-line metric, ICRA 2008),
against the scans of the last metres; the guess counts as a measurement too, so that along a corridor, which looks the
same everywhere, odometry has its way (Gauss and Newton with a prior).
"""

import cmath
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.sensing import Scan
from simscen.stack.localizers.beams import Plane
from simscen.stack.localizers.particles import columns, wrapped
from simscen.stack.localizers.surfaces import Surface, surfaces_of

FRAMES = 4
"""Scans that a new one is matched with."""
REFERENCE, MATCHED = 120, 90
"""Beams kept of each of those, and of the new one."""
GATES, ITERATIONS = (0.5, 0.35, 0.25, 0.15, 0.1), 6
"""m: what is further from its nearest neighbour counts for nothing, in one iteration after the other; and the most."""
SETTLED, STILL = (0.02, 0.01), (0.002, 0.001)
"""m, rad: after an iteration that moved the scan less the last gate comes next; after one that moved it less, none."""
SIGMA = 0.03
"""m: the standard deviation of points from surfaces, correlations included."""
ALIKE = 0.7
"""The cosine between two normals that may be of one surface, at least."""
LEAST = 12
"""Points that must be matched for an answer."""
DOUBT = (0.15, 0.02, 0.15, 0.03)
"""Standard deviations of the guess: of each metre driven, and m; of each rad turned, and rad."""
COARSEST = 0.04
"""rad between two beams: of a lidar whose beams are further apart nobody can tell which points are of one surface."""
AGREES = (0.03, 0.1, 0.03, 0.1)
"""m, and of each metre; rad, and of each rad: within this the match and odometry say the same."""
INFLATED, FLOOR = 0.5, np.diag(np.square((0.004, 0.003, 0.0015)))
"""Of the covariance that the match itself gives, and what is added (m, m, rad): neighbouring frames share the errors of
their surfaces."""


class _Reference:
    """What earlier scans saw, to match a new one with."""

    def __init__(self, frames: Iterable[Surface]) -> None:
        from scipy.spatial import cKDTree

        points = np.concatenate([*(frame.points for frame in frames), _NOWHERE])
        self._normals = np.concatenate([*(frame.normals for frame in frames), _NOWHERE])
        self._along = (points * self._normals.conj()).real
        self._tree = cKDTree(_coordinates(points[:-1]), balanced_tree=False, compact_nodes=False)

    def pull(self, own: Surface, pose: Pose2, gate: float) -> Array | None:
        """How a scan that is placed at `pose` is drawn: the normal equations (4, 4), the right-hand side last.

        None when too few points have a neighbour within `gate` m that faces as they do.
        """
        turn = cmath.rect(1.0, pose.yaw)
        about = own.points * turn
        ends = about + complex(pose.x, pose.y)
        nearest = self._tree.query(_coordinates(ends), distance_upper_bound=gate)[1]
        normals = self._normals.take(nearest)
        alike = (own.normals * turn * normals.conj()).real > ALIKE
        if np.count_nonzero(alike) < LEAST:
            return None
        normals *= alike
        against = normals.conj()
        slope = np.empty((4, len(ends)))
        slope[0], slope[1] = normals.real, normals.imag
        slope[2] = -(about * against).imag
        slope[3] = self._along.take(nearest) * alike - (ends * against).real
        equations: Array = slope @ slope.T / SIGMA**2
        return equations


_NOWHERE: Plane = np.zeros(1, dtype=np.complex128)
"""What a point without a neighbour is matched with: it faces nothing."""


def _coordinates(points: Plane) -> Array:
    """Points (n,) as rows (n, 2)."""
    return points.view(np.float64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Step:
    """A motion in the base frame before it, and its covariance (3, 3) in that frame."""

    delta: Pose2
    covariance: Array

    def agrees(self, odometry: Pose2) -> bool:
        """Whether odometry says about the same of it."""
        off = odometry.between(self.delta)
        far, turned = math.hypot(odometry.x, odometry.y), abs(odometry.yaw)
        return math.hypot(off.x, off.y) < AGREES[0] + AGREES[1] * far and abs(off.yaw) < AGREES[2] + AGREES[3] * turned


def moved(poses: Array, step: Step, chance: np.random.Generator) -> Array:
    """Each of `poses` (n, 3) moved by its own copy of a step."""
    ahead, left, turn = np.linalg.cholesky(step.covariance) @ chance.standard_normal((3, len(poses)))
    ahead += step.delta.x
    left += step.delta.y
    turn += step.delta.yaw
    x, y, heading = poses.T
    c, s = np.cos(heading), np.sin(heading)
    after = columns(len(poses))
    after[:, 0] = x + c * ahead - s * left
    after[:, 1] = y + s * ahead + c * left
    after[:, 2] = wrapped(heading + turn)
    return after


class ScanMatcher:
    """Follows one lidar; `pose` is the base's in a frame that begins at the first scan, and drifts slowly."""

    def __init__(self) -> None:
        self._frames: deque[Surface] = deque(maxlen=FRAMES)
        self.pose = Pose2(0.0, 0.0, 0.0)

    def step(self, scan: Scan, guess: Pose2) -> Step | None:
        """How the base moved since the last scan, where odometry says `guess`; None when the scans do not say."""
        if abs(scan.angle_increment) > COARSEST:
            self.pose = self.pose.compose(guess)
            return None
        seen = surfaces_of(scan)
        found = self._matched(seen, guess) if len(seen.points) and any(len(f.points) for f in self._frames) else None
        pose, information = found or (self.pose.compose(guess), np.eye(3))
        self._frames.append(seen.thinned(REFERENCE).placed(pose))
        last, self.pose = self.pose, pose
        if found is None:
            return None
        c, s = math.cos(last.yaw), math.sin(last.yaw)
        turned = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        covariance = turned @ np.linalg.inv(information * (1 / INFLATED)) @ turned.T + FLOOR
        return Step(last.between(pose), covariance)

    def _matched(self, seen: Surface, guess: Pose2) -> tuple[Pose2, Array] | None:
        """The pose in the matcher's frame and its information (3, 3)."""
        reference, own = _Reference(self._frames), seen.thinned(MATCHED)
        guessed = pose = self.pose.compose(guess)
        trust, gate, last = self._trust(guess), 0, len(GATES) - 1
        for _ in range(ITERATIONS):
            if (normal_equations := reference.pull(own, pose, GATES[gate])) is None:
                return None
            towards = (guessed.x - pose.x, guessed.y - pose.y, wrap(guessed.yaw - pose.yaw))
            information = normal_equations[:3, :3] + trust
            dx, dy, turn = np.linalg.solve(information, normal_equations[:3, 3] + trust @ towards).tolist()
            pose = Pose2(pose.x + dx, pose.y + dy, pose.yaw + turn)
            step = math.hypot(dx, dy), abs(turn)
            if gate == last and _within(step, STILL):
                break
            gate = last if _within(step, SETTLED) else min(gate + 1, last)
        return pose, information

    def _trust(self, guess: Pose2) -> Array:
        """The information (3, 3) of the guess."""
        far, turned = math.hypot(guess.x, guess.y), abs(guess.yaw)
        place, heading = DOUBT[0] * far + DOUBT[1], DOUBT[2] * turned + DOUBT[3]
        return np.diag([place**-2, place**-2, heading**-2])


def _within(step: tuple[float, float], limits: tuple[float, float]) -> bool:
    return step[0] < limits[0] and step[1] < limits[1]
