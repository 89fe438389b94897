"""Scan matching: the motion between two scans, with odometry as the initial guess.

Source: Censi, An ICP variant using a point-to-line metric (ICRA 2008). A scan is matched with the scans of the last
meters. The guess is also a measurement (Gauss-Newton with a prior), so that odometry decides where scans cannot, e.g.
along a corridor that looks the same everywhere.
"""

import cmath
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane, directions, evenly_spaced
from simscen.stack.localizers.particles import empty_poses, wrap_headings

BASELINE_M = 0.15
"""Distance between the two points whose line gives the normal of the point between them."""
MAX_BEND_M = 0.05
"""Maximum distance of the point from this line."""
MAX_LINE_M = 0.5
"""Maximum length of this line, at least four beam spacings. Points farther apart are not on the same surface."""
MAX_RANGE_M = 20.0
"""Points farther away are not used."""

_NONE: Plane = np.empty(0, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Surface:
    """Points (n,) on surfaces, and the unit normals (n,) there, all as x + iy."""

    points: Plane
    normals: Plane

    def placed(self, pose: Pose2) -> "Surface":
        """Return the surface in the parent frame of `pose`."""
        turn = cmath.rect(1.0, pose.yaw)
        return Surface(self.points * turn + complex(pose.x, pose.y), self.normals * turn)

    def thinned(self, count: int) -> "Surface":
        """Return at most `count` points, evenly spaced."""
        if len(self.points) <= count:
            return self
        chosen = evenly_spaced(len(self.points), count)
        return Surface(self.points.take(chosen), self.normals.take(chosen))


def extract_surface(scan: Scan) -> Surface:
    """Return the hits of a scan in the base frame, without those at edges, where the normal is unknown."""
    ranges = scan.ranges
    hit = ((ranges > scan.range_min) & (ranges < min(scan.range_max, MAX_RANGE_M))).nonzero()[0]
    if len(hit) < 3:
        return Surface(_NONE, _NONE)
    ranges, gap = ranges.take(hit), abs(scan.angle_increment)
    points: Plane = ranges * directions(scan).take(hit)
    apart = np.ceil((BASELINE_M / 2 / gap) / np.maximum(ranges, 1e-3 / gap)).astype(np.int64)
    row = np.arange(len(hit))
    before = points.take(row - apart, mode="clip")
    along = points.take(row + apart, mode="clip") - before
    length = np.abs(along)
    bent = np.abs(((points - before).conj() * along).imag)
    # A line of length 0 fails the second comparison.
    flat = ((length < np.maximum(MAX_LINE_M, 4 * gap * ranges)) & (bent < MAX_BEND_M * length)).nonzero()[0]
    normals = along.take(flat) * -1j / length.take(flat)
    return Surface(points.take(flat) + complex(scan.mount.x, scan.mount.y), normals)


REFERENCE_SCANS = 4
"""Number of earlier scans that a new scan is matched with."""
REFERENCE_POINTS, SCAN_POINTS = 120, 90
"""Maximum number of points of each of these scans, and of the new scan."""
GATES_M, MAX_ITERATIONS = (0.5, 0.35, 0.25, 0.15, 0.1), 6
"""Maximum distance of a point from its nearest neighbor in successive iterations, and maximum number of iterations."""
LAST_GATE_STEP, CONVERGED_STEP = (0.02, 0.01), (0.002, 0.001)
"""Changes of the pose (m, rad) by an iteration below which the last of GATES_M follows, and the match ends."""
OUTLIER_DISTANCE_M, OUTLIER_RATIO = 0.1, 1.5
"""A point has a quarter of its weight (Geman-McClure) if its distance from its neighbor is OUTLIER_DISTANCE_M, or
OUTLIER_RATIO times the root mean square of all distances if that is more.

If most points fit, a person who walks along does not change the match. If none fits, the wheels have slipped, and all
points must keep their weight.
"""
POINT_STD_M = 0.03
"""Standard deviation of the distance of points from surfaces, including correlations."""
MIN_NORMAL_COSINE = 0.7
"""Minimum cosine of the angle between the normals of two points on the same surface."""
MIN_MATCHED_POINTS = 12
GUESS_STD = (0.15, 0.02, 0.15, 0.03)
"""Standard deviation of the guess: a share of the distance plus m, and a share of the rotation plus rad."""
MAX_BEAM_ANGLE_RAD = 0.04
"""Maximum angle between two beams. With a larger angle, the normals of surfaces are unknown."""
AGREEMENT = (0.03, 0.1, 0.03, 0.1)
"""Maximum difference of a match that agrees with odometry: m plus a share of the distance, rad plus one of the turn."""
MIN_OVERLAP = 0.3
"""Share of a scan's points that earlier scans also showed, below which the match is rejected."""
MAX_OVERLAP_STEP = 0.75, 0.75
"""Longest step between two scans (m, rad) after which an overlap below MIN_OVERLAP means that the robot was carried.

After a longer step, e.g. around a corner between sparse scans, the scans may share little anyway.
"""
COVARIANCE_SCALE, COVARIANCE_FLOOR = 0.5, (0.004**2, 0.003**2, 0.0015**2)
"""Factor on the covariance of the least-squares solution, and variances (m², m², rad²) added to it.

They are fitted to observed errors: consecutive scans share the errors of their surfaces.
"""


Symmetric = tuple[float, float, float, float, float, float]
"""Upper triangle of a symmetric matrix (3, 3) by rows. A tuple is faster than an array of this size."""
Equations = tuple[tuple[float, float, float, float], ...]
"""Normal equations of x, y and yaw, right-hand side last, in units of 1 / POINT_STD_M²."""


class _Reference:
    """Surfaces of earlier scans, with which a new scan is matched.

    The nearest neighbors are found by comparing all pairs of points in one matrix product. For so few points, this
    takes less time than building a k-d tree.
    """

    def __init__(self, frames: Iterable[Surface], middle: complex) -> None:
        """Combine scans. Distances are computed relative to `middle`, near the robot, to keep rounding errors small."""
        seen = list(frames)
        self._points = np.concatenate([frame.points for frame in seen])
        self._normals = np.concatenate([frame.normals for frame in seen])
        self.overlap = 0.0
        """Share of the last matched scan's points that have a neighbor in the earlier scans."""
        self._middle, around = middle, self._points - middle
        # The b nearest to a has the greatest a·b - b²/2.
        self._compared = np.empty((3, len(around)))
        self._compared[0], self._compared[1] = around.real, around.imag
        self._compared[2] = (around * around.conj()).real * -0.5

    def equations(self, own: Surface, pose: Pose2, gate: float) -> Equations | None:
        """Return the normal equations of a scan, `own` in the base frame, for a base at `pose`.

        None if too few points have a neighbor within `gate` m with a similar normal.
        """
        turn = cmath.rect(1.0, pose.yaw)
        rotated = own.points * turn
        ends = rotated + complex(pose.x, pose.y)
        compared = np.ones((len(ends), 3))
        compared[:, :2] = (ends - self._middle).view(np.float64).reshape(-1, 2)
        nearest = (compared @ self._compared).argmax(axis=1)
        gap = self._points.take(nearest)
        gap -= ends
        against = self._normals.take(nearest).conj()
        matched = (own.normals * turn * against).real > MIN_NORMAL_COSINE
        squares = (gap * gap.conj()).real
        matched &= squares < gate * gate
        count = int(np.count_nonzero(matched))
        self.overlap = count / len(ends)
        if count < MIN_MATCHED_POINTS:
            return None
        squares /= max(OUTLIER_DISTANCE_M**2, OUTLIER_RATIO**2 * squares.dot(matched).item() / count)
        squares += 1.0
        against *= matched / squares
        slope = np.empty((4, len(ends)))
        slope[0] = against.real
        np.negative(against.imag, out=slope[1])
        np.negative((rotated * against).imag, out=slope[2])
        slope[3] = (gap * against).real
        equations: Equations = tuple(map(tuple, (slope @ slope.T).tolist()))
        return equations


@dataclass(frozen=True, eq=False)
class Step:
    """Motion between two scans in the base frame of the first, with its covariance (3, 3)."""

    delta: Pose2
    covariance: Array

    def agrees(self, odometry: Pose2) -> bool:
        """Return whether odometry measured nearly the same motion."""
        difference = odometry.between(self.delta)
        distance, turned = math.hypot(odometry.x, odometry.y), abs(odometry.yaw)
        return (
            math.hypot(difference.x, difference.y) < AGREEMENT[0] + AGREEMENT[1] * distance
            and abs(difference.yaw) < AGREEMENT[2] + AGREEMENT[3] * turned
        )


def sample_step(poses: Array, step: Step, rng: np.random.Generator) -> Array:
    """Return `poses` (n, 3), each moved by its own random sample of a step."""
    ahead, left, turn = np.dot(_root(step.covariance), rng.standard_normal((3, len(poses))))
    ahead += step.delta.x
    left += step.delta.y
    turn += step.delta.yaw
    x, y, heading = poses.T
    c, s = np.cos(heading), np.sin(heading)
    after = empty_poses(len(poses))
    after[:, 0] = x + c * ahead - s * left
    after[:, 1] = y + s * ahead + c * left
    after[:, 2] = wrap_headings(heading + turn)
    return after


class ScanMatcher:
    """Estimates the motion of the base by matching successive scans of one lidar.

    `pose` is that of the base in a frame that begins at the first scan and drifts slowly.
    """

    def __init__(self) -> None:
        self._frames: deque[Surface] = deque(maxlen=REFERENCE_SCANS)
        self.pose = Pose2(0.0, 0.0, 0.0)
        self.overlap: float | None = None
        """Share of the last scan's points that earlier scans also showed; None if unknown or after a long step."""

    @property
    def was_carried(self) -> bool | None:
        """Whether the robot was carried elsewhere, because the last scan overlaps little; None if unknown."""
        return None if self.overlap is None else self.overlap < MIN_OVERLAP

    def step(self, scan: Scan, guess: Pose2) -> Step | None:
        """Return the motion of the base since the last scan; None if scans do not show it. `guess` is by odometry."""
        self.overlap = None
        if abs(scan.angle_increment) > MAX_BEAM_ANGLE_RAD:
            self.pose = self.pose.compose(guess)
            return None
        seen = extract_surface(scan)
        found = self._matched(seen, guess) if len(seen.points) and any(len(f.points) for f in self._frames) else None
        if math.hypot(guess.x, guess.y) > MAX_OVERLAP_STEP[0] or abs(guess.yaw) > MAX_OVERLAP_STEP[1]:
            self.overlap = None
        last, self.pose = self.pose, found[0] if found else self.pose.compose(guess)
        self._frames.append(seen.thinned(REFERENCE_POINTS).placed(self.pose))
        return Step(last.between(self.pose), _step_covariance(last.yaw, found[1])) if found else None

    def _matched(self, seen: Surface, guess: Pose2) -> tuple[Pose2, Symmetric] | None:
        """Return the pose in the matcher's frame, and its covariance in units of POINT_STD_M²."""
        guessed = pose = self.pose.compose(guess)
        reference, own = _Reference(self._frames, complex(pose.x, pose.y)), seen.thinned(SCAN_POINTS)
        (place, heading), gate, last = _prior_information(guess), 0, len(GATES_M) - 1
        for _ in range(MAX_ITERATIONS):
            if (equations := reference.equations(own, pose, GATES_M[gate])) is None:
                self.overlap = 0.0
                return None
            (xx, xy, xa, right), (_, yy, ya, up), (_, _, aa, around), _ = equations
            inverse = _inverse((xx + place, xy, xa, yy + place, ya, aa + heading))
            right += place * (guessed.x - pose.x)
            up += place * (guessed.y - pose.y)
            around += heading * wrap(guessed.yaw - pose.yaw)
            xx, xy, xa, yy, ya, aa = inverse
            dx = xx * right + xy * up + xa * around
            dy = xy * right + yy * up + ya * around
            turn = xa * right + ya * up + aa * around
            pose = Pose2(pose.x + dx, pose.y + dy, pose.yaw + turn)
            step = math.hypot(dx, dy), abs(turn)
            if gate == last and _within(step, CONVERGED_STEP):
                break
            gate = last if _within(step, LAST_GATE_STEP) else min(gate + 1, last)
        self.overlap = reference.overlap
        return None if self.overlap < MIN_OVERLAP else (pose, inverse)


def _prior_information(guess: Pose2) -> tuple[float, float]:
    """Return the information of the guess about each coordinate and about the yaw, in units of 1 / POINT_STD_M²."""
    distance, turned = math.hypot(guess.x, guess.y), abs(guess.yaw)
    return (POINT_STD_M / (GUESS_STD[0] * distance + GUESS_STD[1])) ** 2, (
        POINT_STD_M / (GUESS_STD[2] * turned + GUESS_STD[3])
    ) ** 2


def _inverse(matrix: Symmetric) -> Symmetric:
    """Return the inverse of a positive definite matrix."""
    xx, xy, xa, yy, ya, aa = matrix
    of_xx, of_xy, of_xa = yy * aa - ya * ya, xa * ya - xy * aa, xy * ya - xa * yy
    each = 1 / (xx * of_xx + xy * of_xy + xa * of_xa)
    rest = (xx * aa - xa * xa) * each, (xy * xa - xx * ya) * each, (xx * yy - xy * xy) * each
    return of_xx * each, of_xy * each, of_xa * each, *rest


def _step_covariance(yaw: float, inverse: Symmetric) -> Array:
    """Return the covariance (3, 3) of a step in the frame of a base with heading `yaw`."""
    c, s, scale = math.cos(yaw), math.sin(yaw), COVARIANCE_SCALE * POINT_STD_M**2
    xx, xy, xa, yy, ya, aa = (scale * value for value in inverse)
    crossed = c * s * (yy - xx) + (c * c - s * s) * xy
    ahead, left = c * xa + s * ya, c * ya - s * xa
    along, aside = c * c * xx + 2 * c * s * xy + s * s * yy, s * s * xx - 2 * c * s * xy + c * c * yy
    floor_x, floor_y, floor_yaw = COVARIANCE_FLOOR
    return np.array((
        (along + floor_x, crossed, ahead), (crossed, aside + floor_y, left), (ahead, left, aa + floor_yaw),
    ))  # fmt: skip


def _root(covariance: Array) -> Array:
    """Return the Cholesky factor (3, 3), lower triangle, of a covariance."""
    (xx, _, _), (xy, yy, _), (xa, ya, aa) = covariance.tolist()
    x = math.sqrt(xx)
    y_x, a_x = xy / x, xa / x
    y = math.sqrt(yy - y_x * y_x)
    a_y = (ya - a_x * y_x) / y
    return np.array(((x, 0.0, 0.0), (y_x, y, 0.0), (a_x, a_y, math.sqrt(aa - a_x * a_x - a_y * a_y))))


def _within(step: tuple[float, float], limits: tuple[float, float]) -> bool:
    return step[0] < limits[0] and step[1] < limits[1]
