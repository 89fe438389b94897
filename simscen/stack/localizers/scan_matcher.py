"""How far a robot went between two scans, from what it saw: odometry is the guess, and what the scans leave open.

Iterated closest points with a point-to-line metric (Censi, An ICP variant using a point-to-line metric, ICRA 2008),
against the scans of the last metres; the guess counts as a measurement too, so that along a corridor, which looks the
same everywhere, odometry has its way (Gauss and Newton with a prior).
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.sensing import Scan

FRAMES = 6
"""Scans that a new one is matched with."""
REFERENCE, MATCHED = 180, 90
"""Beams kept of each of those, and of the new one."""
BASELINE = 0.15
"""m between the points whose line is the surface at the point amid them."""
TORN = 0.5
"""m: points this far apart on both sides of one are not of one surface."""
GATES = (0.5, 0.35, 0.25, 0.15, 0.1, 0.1)
"""m: what is further from its nearest neighbour counts for nothing, in each of the iterations."""
SIGMA = 0.03
"""m: the standard deviation of points from surfaces, correlations included."""
LEAST = 12
"""Points that must be matched for an answer."""
DOUBT = (0.15, 0.02, 0.15, 0.03)
"""Standard deviations of the guess: of each metre driven, and m; of each rad turned, and rad."""
REACH = 20.0
COARSEST = 0.04
"""rad between two beams: of a lidar whose beams are further apart nobody can tell which points are of one surface."""
AGREES = (0.03, 0.1, 0.03, 0.1)
"""m, and of each metre; rad, and of each rad: within this the match and odometry say the same."""
INFLATED, FLOOR = 2.0, (0.005, 0.005, 0.002)
"""Of the covariance that the match itself gives, and standard deviations in m, m, rad that are added: neighbouring
frames share the errors of their surfaces."""


@dataclass(frozen=True, eq=False)
class _Surface:
    """Points (n, 2) and the normals (n, 2) of the surfaces that they are on."""

    points: Array
    normals: Array

    def placed(self, pose: Pose2) -> "_Surface":
        """The same in the parent frame of `pose`."""
        return _Surface(pose.apply(self.points), Pose2(0.0, 0.0, pose.yaw).apply(self.normals))


@dataclass(frozen=True, eq=False)
class Step:
    """A motion in the base frame before it, and its covariance (3, 3) in that frame."""

    delta: Pose2
    covariance: Array

    def agrees(self, odometry: Pose2) -> bool:
        """Whether odometry says about the same of it."""
        off = odometry.between(self.delta)
        far, turned = float(np.hypot(odometry.x, odometry.y)), abs(odometry.yaw)
        return (
            float(np.hypot(off.x, off.y)) < AGREES[0] + AGREES[1] * far
            and abs(off.yaw) < AGREES[2] + AGREES[3] * turned
        )


def moved(poses: Array, step: Step, chance: np.random.Generator) -> Array:
    """Each of `poses` (n, 3) moved by its own copy of a step."""
    steps = chance.standard_normal(poses.shape) @ np.linalg.cholesky(step.covariance).T + step.delta
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack((
        poses[:, 0] + c * steps[:, 0] - s * steps[:, 1],
        poses[:, 1] + s * steps[:, 0] + c * steps[:, 1],
        wrap_array(poses[:, 2] + steps[:, 2]),
    ))  # fmt: skip


class ScanMatcher:
    """Follows one lidar; `pose` is the base's in a frame that begins at the first scan, and drifts slowly."""

    def __init__(self) -> None:
        self._frames: deque[_Surface] = deque(maxlen=FRAMES)
        self.pose = Pose2(0.0, 0.0, 0.0)

    def step(self, scan: Scan, guess: Pose2) -> Step | None:
        """How the base moved since the last scan, where odometry says `guess`; None when the scans do not say."""
        if abs(scan.angle_increment) > COARSEST:
            self.pose = self.pose.compose(guess)
            return None
        seen = surfaces_of(scan)
        found = self._matched(seen, guess) if self._frames and len(seen.points) else None
        pose, information = found or (self.pose.compose(guess), np.eye(3))
        self._frames.append(_thinned(seen, REFERENCE).placed(pose))
        last, self.pose = self.pose, pose
        if found is None:
            return None
        turned = np.eye(3)
        turned[:2, :2] = Pose2(0.0, 0.0, -last.yaw).apply(np.eye(2)).T
        covariance = INFLATED * turned @ np.linalg.inv(information) @ turned.T + np.diag(np.square(FLOOR))
        return Step(last.between(pose), covariance)

    def _matched(self, seen: _Surface, guess: Pose2) -> tuple[Pose2, Array] | None:
        """The pose in the matcher's frame and its information (3, 3)."""
        from scipy.spatial import cKDTree

        points = np.concatenate([frame.points for frame in self._frames])
        normals = np.concatenate([frame.normals for frame in self._frames])
        guessed = pose = self.pose.compose(guess)
        if not len(points):
            return None
        tree, own = cKDTree(points), _thinned(seen, MATCHED)
        trust = self._trust(guess)
        for gate in GATES:
            here = own.placed(pose)
            distance, closest = tree.query(here.points, distance_upper_bound=gate)
            matched = np.isfinite(distance)
            nearest = np.asarray(closest)[matched]
            same = (here.normals[matched] * normals[nearest]).sum(axis=1) > 0.7
            if np.count_nonzero(same) < LEAST:
                return None
            ends, normal = here.points[matched][same], normals[nearest[same]]
            off = ((points[nearest[same]] - ends) * normal).sum(axis=1)
            lever = ends - pose[:2]
            slope = np.column_stack((normal, normal[:, 1] * lever[:, 0] - normal[:, 0] * lever[:, 1])) / SIGMA
            towards = np.array(guessed) - np.array(pose)
            towards[2] = (towards[2] + np.pi) % (2 * np.pi) - np.pi
            information = slope.T @ slope + trust
            dx, dy, turn = np.linalg.solve(information, slope.T @ (off / SIGMA) + trust @ towards).tolist()
            pose = Pose2(pose.x + dx, pose.y + dy, pose.yaw + turn)
        return pose, information

    def _trust(self, guess: Pose2) -> Array:
        """The information (3, 3) of the guess."""
        far, turned = float(np.hypot(guess.x, guess.y)), abs(guess.yaw)
        place, heading = DOUBT[0] * far + DOUBT[1], DOUBT[2] * turned + DOUBT[3]
        return np.diag([place**-2, place**-2, heading**-2])


def surfaces_of(scan: Scan) -> _Surface:
    """What a scan hit, in the base frame; points at an edge, whose surface nobody can tell, are left out."""
    ranges = scan.ranges
    with np.errstate(invalid="ignore"):
        hit = np.flatnonzero((ranges > scan.range_min) & (ranges < min(scan.range_max, REACH)))
    angles = scan.angles()[hit]
    points = ranges[hit, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    if len(points) < 3:
        return _Surface(np.empty((0, 2)), np.empty((0, 2)))
    gaps: Array = ranges[hit] * abs(scan.angle_increment)
    spread: npt.NDArray[np.int64] = np.ceil(BASELINE / 2 / np.maximum(gaps, 1e-3)).astype(np.int64)
    row = np.arange(len(points))
    before, after = points[np.maximum(row - spread, 0)], points[np.minimum(row + spread, len(points) - 1)]
    along = after - before
    length = np.hypot(*along.T)
    bent = np.abs((points - before)[:, 0] * along[:, 1] - (points - before)[:, 1] * along[:, 0])
    with np.errstate(invalid="ignore", divide="ignore"):
        flat = (length > 0) & (length < np.maximum(TORN, 4 * gaps)) & (bent / length < 0.05)
    points, along, length = points[flat], along[flat], length[flat]
    normals = np.column_stack((along[:, 1], -along[:, 0])) / length[:, None]
    return _Surface(scan.mount.apply(points), Pose2(0.0, 0.0, scan.mount.yaw).apply(normals))


def _thinned(surface: _Surface, count: int) -> _Surface:
    """At most `count` points, evenly chosen."""
    if len(surface.points) <= count:
        return surface
    chosen: npt.NDArray[np.int64] = np.linspace(0, len(surface.points) - 1, count).astype(np.int64)
    return _Surface(surface.points[chosen], surface.normals[chosen])
