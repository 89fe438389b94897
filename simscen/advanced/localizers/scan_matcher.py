"""Scan matching: the motion since the last scan, by point-to-line ICP with odometry as the initial guess.

Source: Censi, An ICP variant using a point-to-line metric (ICRA 2008). Each scan is matched with several earlier scans.
The guess is also a prior: along a corridor that looks the same everywhere, odometry determines the motion.
"""

import cmath
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.matched_motion import MatchedMotion
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import ComplexPoints, directions, evenly_spaced
from simscen.stack.localizers.dead_reckoning import CovarianceTriangle, rotate_covariance

BASELINE_M = 0.15
"""Approximate length of the line between two neighbors of a point. The line determines the normal of the point."""
MAX_BEND_M = 0.05
"""Maximum distance of the point from the line between its neighbors."""
MAX_LINE_M = 0.5
"""Maximum length of the line, or four beam spacings if these are longer. The ends of a longer line are on different
surfaces."""
MAX_RANGE_M = 20.0
"""Range beyond which points are ignored."""
_NO_POINTS: ComplexPoints = np.empty(0, dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Surface:
    """Points (n,) on surfaces and their unit normals (n,), as x + iy."""

    points: ComplexPoints
    normals: ComplexPoints

    def to_parent_frame(self, pose: Pose2) -> "Surface":
        """Return the surface, transformed from the frame at `pose` to the parent frame."""
        turn = cmath.rect(1.0, pose.yaw)
        return Surface(self.points * turn + complex(pose.x, pose.y), self.normals * turn)

    def thinned(self, count: int) -> "Surface":
        """Return at most `count` points, evenly spaced."""
        if len(self.points) <= count:
            return self
        chosen = evenly_spaced(len(self.points), count)
        return Surface(self.points.take(chosen), self.normals.take(chosen))


def extract_surface(scan: Scan) -> Surface:
    """Return the hits of a scan in the base frame, without hits at edges of surfaces, which have no normal."""
    ranges = scan.ranges
    hit = ((ranges > scan.range_min) & (ranges < min(scan.range_max, MAX_RANGE_M))).nonzero()[0]
    if len(hit) < 3:
        return Surface(_NO_POINTS, _NO_POINTS)
    ranges, gap = ranges.take(hit), abs(scan.angle_increment)
    points: ComplexPoints = ranges * directions(scan).take(hit)
    neighbor_offset = np.ceil((BASELINE_M / 2 / gap) / np.maximum(ranges, 1e-3 / gap)).astype(np.int64)
    index = np.arange(len(hit))
    before = points.take(index - neighbor_offset, mode="clip")
    line = points.take(index + neighbor_offset, mode="clip") - before
    length = np.abs(line)
    bend_times_length = np.abs(((points - before).conj() * line).imag)
    is_flat = (length < np.maximum(MAX_LINE_M, 4 * gap * ranges)) & (bend_times_length < MAX_BEND_M * length)
    flat = is_flat.nonzero()[0]  # excludes lines of length 0, because of `<`
    normals = line.take(flat) * -1j / length.take(flat)
    return Surface(points.take(flat) + complex(scan.mount.x, scan.mount.y), normals)


REFERENCE_SCANS = 4
"""Number of earlier scans that a new scan is matched with."""
REFERENCE_POINTS, SCAN_POINTS = 120, 90
"""Maximum number of points of each earlier scan, and of the new scan."""
GATES_M, MAX_ITERATIONS = (0.5, 0.35, 0.25, 0.15, 0.1), 6
"""Maximum distances of a point from its nearest neighbor in successive iterations, and maximum number of iterations."""
LAST_GATE_STEP, CONVERGED_STEP = (0.02, 0.01), (0.002, 0.001)
"""Change of the pose (m, rad) in an iteration below which the last of GATES_M is used next, and change below which the
match ends."""
OUTLIER_DISTANCE_M, OUTLIER_RATIO = 0.1, 1.5
"""Scale of the Geman-McClure weights: the larger one of OUTLIER_DISTANCE_M, and OUTLIER_RATIO times the root mean
square of all distances. A point at this distance from its neighbor has a quarter of the full weight."""
POINT_STD_M = 0.03
"""Standard deviation of the distance of points from surfaces, including correlations."""
MIN_NORMAL_COSINE = 0.7
"""Minimum cosine of the angle between the normals of two matched points."""
MIN_MATCHED_POINTS = 12
"""Minimum number of matched points; with fewer, the match fails."""
GUESS_STD_PER_M, GUESS_STD_M = 0.15, 0.02
"""Standard deviation of the translation of the guess: a part per meter of translation, and a constant."""
GUESS_STD_PER_RAD, GUESS_STD_RAD = 0.15, 0.03
"""Standard deviation of the rotation of the guess: a part per radian of rotation, and a constant."""
MAX_BEAM_ANGLE_RAD = 0.04
"""Maximum angle between neighboring beams. Scans with larger angles are not matched."""
MIN_OVERLAP = 0.3
"""Minimum share of the points of a scan that match earlier scans. With less, the match fails."""
MAX_OVERLAP_STEP = 0.75, 0.75
"""Longest step between two scans (m, rad) after which little overlap means that the robot was carried elsewhere."""
COVARIANCE_SCALE, COVARIANCE_FLOOR = 0.5, (0.004**2, 0.003**2, 0.0015**2)
"""Factor on the covariance of the least-squares solution, and variances (m², m², rad²) that are added to it."""


Equations = tuple[tuple[float, float, float, float], ...]
"""Rows (4, 4) of the normal equations of x, y, and yaw, with the right-hand side as last column, in units of
1 / POINT_STD_M²."""


class _ReferenceScans:
    """Surfaces of earlier scans, with which a new scan is matched."""

    def __init__(self, surfaces: Iterable[Surface], middle: complex) -> None:
        """Combine surfaces. `middle` is a point near the robot, used as the origin to keep rounding errors small."""
        combined = list(surfaces)
        self._points = np.concatenate([surface.points for surface in combined])
        self._normals = np.concatenate([surface.normals for surface in combined])
        self.overlap = 0.0
        """Share of the points of the last scan that have a neighbor in the earlier scans."""
        self._middle, around = middle, self._points - middle
        # All pairs in one product, faster than a k-d tree here: the b nearest to a has the greatest a·b - b²/2.
        self._neighbor_terms = np.empty((3, len(around)))
        self._neighbor_terms[0], self._neighbor_terms[1] = around.real, around.imag
        self._neighbor_terms[2] = (around * around.conj()).real * -0.5

    def equations(self, surface: Surface, pose: Pose2, gate: float) -> Equations | None:
        """Return the normal equations of the new scan's `surface` in the base frame, for a base at `pose`.

        None if too few points have a neighbor within `gate` m with a similar normal.
        """
        turn = cmath.rect(1.0, pose.yaw)
        rotated = surface.points * turn
        points = rotated + complex(pose.x, pose.y)
        point_terms = np.ones((len(points), 3))
        point_terms[:, :2] = (points - self._middle).view(np.float64).reshape(-1, 2)
        nearest = (point_terms @ self._neighbor_terms).argmax(axis=1)
        offsets = self._points.take(nearest)
        offsets -= points
        normals = self._normals.take(nearest).conj()
        is_matched = (surface.normals * turn * normals).real > MIN_NORMAL_COSINE
        squares = (offsets * offsets.conj()).real
        is_matched &= squares < gate * gate
        count = int(np.count_nonzero(is_matched))
        self.overlap = count / len(points)
        if count < MIN_MATCHED_POINTS:
            return None
        squares /= max(OUTLIER_DISTANCE_M**2, OUTLIER_RATIO**2 * squares.dot(is_matched).item() / count)
        squares += 1.0
        normals *= is_matched / squares  # the square root of the weight of each point
        jacobian = np.empty((4, len(points)))  # derivatives by x, y, and yaw, and the residual of each point
        jacobian[0] = normals.real
        np.negative(normals.imag, out=jacobian[1])
        np.negative((rotated * normals).imag, out=jacobian[2])
        jacobian[3] = (offsets * normals).real
        equations: Equations = tuple(map(tuple, (jacobian @ jacobian.T).tolist()))
        return equations


class ScanMatcher:
    """Estimates the motion of the base by matching successive scans of one lidar.

    `pose` is the pose of the base in a frame that begins at the first scan and drifts slowly.
    """

    def __init__(self) -> None:
        self._surfaces: deque[Surface] = deque(maxlen=REFERENCE_SCANS)
        self.pose = Pose2(0.0, 0.0, 0.0)
        self.overlap: float | None = None
        """Share of the points of the last scan that match earlier scans; None if unknown or after a long step."""

    @property
    def was_carried(self) -> bool | None:
        """Whether the last scan hardly overlaps, because the robot was carried elsewhere; None if unknown."""
        return None if self.overlap is None else self.overlap < MIN_OVERLAP

    def step(self, scan: Scan, guess: Pose2) -> MatchedMotion | None:
        """Return the motion of the base since the last scan; None if the match fails.

        `guess` is the motion by odometry.
        """
        self.overlap = None
        if abs(scan.angle_increment) > MAX_BEAM_ANGLE_RAD:
            self.pose = self.pose.compose(guess)
            return None
        surface = extract_surface(scan)
        is_possible = len(surface.points) and any(len(earlier.points) for earlier in self._surfaces)
        found = self._match(surface, guess) if is_possible else None
        if math.hypot(guess.x, guess.y) > MAX_OVERLAP_STEP[0] or abs(guess.yaw) > MAX_OVERLAP_STEP[1]:
            self.overlap = None
        last, self.pose = self.pose, found[0] if found else self.pose.compose(guess)
        self._surfaces.append(surface.thinned(REFERENCE_POINTS).to_parent_frame(self.pose))
        return MatchedMotion(last.between(self.pose), _step_covariance(last.yaw, found[1])) if found else None

    def _match(self, surface: Surface, guess: Pose2) -> tuple[Pose2, CovarianceTriangle] | None:
        """Return the new value of `pose`, and its covariance in units of POINT_STD_M²; None on failure."""
        guessed = pose = self.pose.compose(guess)
        reference, thinned = _ReferenceScans(self._surfaces, complex(pose.x, pose.y)), surface.thinned(SCAN_POINTS)
        (position_information, yaw_information), gate, last = _prior_information(guess), 0, len(GATES_M) - 1
        for _ in range(MAX_ITERATIONS):
            if (equations := reference.equations(thinned, pose, GATES_M[gate])) is None:
                self.overlap = 0.0
                return None
            # The letter a stands for the yaw. The column r is the right-hand side, to which the prior is added.
            (xx, xy, xa, xr), (_, yy, ya, yr), (_, _, aa, ar), _ = equations
            inverse = _inverse((xx + position_information, xy, xa, yy + position_information, ya, aa + yaw_information))
            xr += position_information * (guessed.x - pose.x)
            yr += position_information * (guessed.y - pose.y)
            ar += yaw_information * wrap(guessed.yaw - pose.yaw)
            xx, xy, xa, yy, ya, aa = inverse
            dx = xx * xr + xy * yr + xa * ar
            dy = xy * xr + yy * yr + ya * ar
            turn = xa * xr + ya * yr + aa * ar
            pose = Pose2(pose.x + dx, pose.y + dy, pose.yaw + turn)
            step = math.hypot(dx, dy), abs(turn)
            if gate == last and _is_within(step, CONVERGED_STEP):
                break
            gate = last if _is_within(step, LAST_GATE_STEP) else min(gate + 1, last)
        self.overlap = reference.overlap
        return None if self.overlap < MIN_OVERLAP else (pose, inverse)


def _prior_information(guess: Pose2) -> tuple[float, float]:
    """Return the inverse variance of x and y, and of the yaw, of the guess, in units of 1 / POINT_STD_M²."""
    position_std = GUESS_STD_PER_M * math.hypot(guess.x, guess.y) + GUESS_STD_M
    yaw_std = GUESS_STD_PER_RAD * abs(guess.yaw) + GUESS_STD_RAD
    return (POINT_STD_M / position_std) ** 2, (POINT_STD_M / yaw_std) ** 2


def _inverse(matrix: CovarianceTriangle) -> CovarianceTriangle:
    """Return the inverse of a positive definite matrix (3, 3)."""
    xx, xy, xa, yy, ya, aa = matrix
    cofactor_xx, cofactor_xy, cofactor_xa = yy * aa - ya * ya, xa * ya - xy * aa, xy * ya - xa * yy
    factor = 1 / (xx * cofactor_xx + xy * cofactor_xy + xa * cofactor_xa)
    lower = (xx * aa - xa * xa) * factor, (xy * xa - xx * ya) * factor, (xx * yy - xy * xy) * factor
    return cofactor_xx * factor, cofactor_xy * factor, cofactor_xa * factor, *lower


def _step_covariance(yaw: float, inverse: CovarianceTriangle) -> Array:
    """Return the covariance (3, 3) of a motion in a base frame with heading `yaw`. `inverse` is from `_match`."""
    xx, xy, xa, yy, ya, aa = inverse
    scaled = COVARIANCE_SCALE * POINT_STD_M**2 * np.array(((xx, xy, xa), (xy, yy, ya), (xa, ya, aa)))
    xx, xy, xa, yy, ya, aa = rotate_covariance(scaled, -yaw)
    return np.array(((xx, xy, xa), (xy, yy, ya), (xa, ya, aa))) + np.diag(COVARIANCE_FLOOR)


def _is_within(step: tuple[float, float], limits: tuple[float, float]) -> bool:
    """Return whether the distance and the turn of a step are below both limits (m, rad)."""
    return step[0] < limits[0] and step[1] < limits[1]
