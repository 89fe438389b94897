"""How far a robot went between two scans, from what it saw: odometry is the guess, and what the scans leave open.

Iterated closest points with a point-to-line metric (Censi, An ICP variant using a point-to-line metric, ICRA 2008),
against the scans of the last meters; the guess counts as a measurement too, so that along a corridor, which looks the
same everywhere, odometry has its way (Gauss and Newton with a prior).
"""

import cmath
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simscen.advanced.localizers.surfaces import Surface, surfaces_of
from simscen.core.geometry import Array, Pose2, wrap
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.particles import columns, wrapped

FRAMES = 4
"""Scans that a new one is matched with."""
REFERENCE, MATCHED = 120, 90
"""Beams kept of each of those, and of the new one."""
GATES, ITERATIONS = (0.5, 0.35, 0.25, 0.15, 0.1), 6
"""m: what is further from its nearest neighbor counts for nothing, in one iteration after the other; and the most."""
SETTLED, STILL = (0.02, 0.01), (0.002, 0.001)
"""m, rad: after an iteration that moved the scan less the last gate comes next; after one that moved it less, none."""
LOOSE, LOOSER = 0.1, 1.5
"""m, and of the root mean square of all gaps, whichever is more: what is so far from its neighbor counts a quarter,
what is further soon nothing (Geman & McClure). Where most points fit, who walks along and what comes into sight beside
a thing are no reason to doubt them; where none does, the robot went elsewhere than its wheels say."""
SIGMA = 0.03
"""m: the standard deviation of points from surfaces, correlations included."""
ALIKE = 0.7
"""The cosine between two normals that may be of one surface, at least."""
LEAST = 12
"""Points that must be matched for an answer."""
DOUBT = (0.15, 0.02, 0.15, 0.03)
"""Standard deviations of the guess: of each meter driven, and m; of each rad turned, and rad."""
COARSEST = 0.04
"""rad between two beams: of a lidar whose beams are further apart nobody can tell which points are of one surface."""
AGREES = (0.03, 0.1, 0.03, 0.1)
"""m, and of each meter; rad, and of each rad: within this the match and odometry say the same."""
AGAIN = 0.3
"""Share of what a scan shows that the ones before it must have shown: less, and the robot was carried elsewhere."""
INFLATED, FLOOR = 0.5, (0.004**2, 0.003**2, 0.0015**2)
"""Of the covariance that the match itself gives, and what is added (m, m, rad): neighboring frames share the errors of
their surfaces."""


Symmetric = tuple[float, float, float, float, float, float]
"""The upper triangle of a symmetric matrix (3, 3) by rows: nine numbers are too few for arrays."""
Equations = tuple[tuple[float, float, float, float], ...]
"""Normal equations of x, y and yaw, right-hand side last, in units of 1 / SIGMA²."""


class _Reference:
    """What earlier scans saw, to match a new one with.

    Of so few points each is compared with each, in one product and one `argmax`: a tree takes longer to build.
    """

    def __init__(self, frames: Iterable[Surface], middle: complex) -> None:
        """`middle` is about where the robot is, so that squares are small however far it went."""
        seen = list(frames)
        self._points = np.concatenate([frame.points for frame in seen])
        self._normals = np.concatenate([frame.normals for frame in seen])
        self.again = 0.0
        """The share of the points of the last scan that was pulled which it did not see for the first time."""
        self._middle, around = middle, self._points - middle
        # a·b - b²/2 is greatest for the b that is nearest to a
        self._compared = np.empty((3, len(around)))
        self._compared[0], self._compared[1] = around.real, around.imag
        self._compared[2] = (around * around.conj()).real * -0.5

    def pull(self, own: Surface, pose: Pose2, gate: float) -> Equations | None:
        """How a scan that is placed at `pose` is drawn: its normal equations.

        None when too few points have a neighbor within `gate` m that faces as they do.
        """
        turn = cmath.rect(1.0, pose.yaw)
        about = own.points * turn
        ends = about + complex(pose.x, pose.y)
        compared = np.ones((len(ends), 3))
        compared[:, :2] = (ends - self._middle).view(np.float64).reshape(-1, 2)
        nearest = (compared @ self._compared).argmax(axis=1)
        gap = self._points.take(nearest)
        gap -= ends
        against = self._normals.take(nearest).conj()
        matched = (own.normals * turn * against).real > ALIKE
        squares = (gap * gap.conj()).real
        matched &= squares < gate * gate
        count = int(np.count_nonzero(matched))
        self.again = count / len(ends)
        if count < LEAST:
            return None
        squares /= max(LOOSE**2, LOOSER**2 * squares.dot(matched).item() / count)
        squares += 1.0
        against *= matched / squares
        slope = np.empty((4, len(ends)))
        slope[0] = against.real
        np.negative(against.imag, out=slope[1])
        np.negative((about * against).imag, out=slope[2])
        slope[3] = (gap * against).real
        equations: Equations = tuple(map(tuple, (slope @ slope.T).tolist()))
        return equations


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


def moved(poses: Array, step: Step, rng: np.random.Generator) -> Array:
    """Each of `poses` (n, 3) moved by its own copy of a step."""
    ahead, left, turn = np.dot(_root(step.covariance), rng.standard_normal((3, len(poses))))
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
        self.again: float | None = None
        """The share of what the last scan shows that those before it showed; None when nobody can say."""

    @property
    def parted(self) -> bool | None:
        """Whether the last scan shows hardly anything of what those before it did; None when nobody can say."""
        return None if self.again is None else self.again < AGAIN

    def step(self, scan: Scan, guess: Pose2) -> Step | None:
        """How the base moved since the last scan, where odometry says `guess`; None when the scans do not say."""
        self.again = None
        if abs(scan.angle_increment) > COARSEST:
            self.pose = self.pose.compose(guess)
            return None
        seen = surfaces_of(scan)
        found = self._matched(seen, guess) if len(seen.points) and any(len(f.points) for f in self._frames) else None
        last, self.pose = self.pose, found[0] if found else self.pose.compose(guess)
        self._frames.append(seen.thinned(REFERENCE).placed(self.pose))
        return Step(last.between(self.pose), _seen_from(last.yaw, found[1])) if found else None

    def _matched(self, seen: Surface, guess: Pose2) -> tuple[Pose2, Symmetric] | None:
        """The pose in the matcher's frame, and the inverse of its information, which is in units of 1 / SIGMA²."""
        guessed = pose = self.pose.compose(guess)
        reference, own = _Reference(self._frames, complex(pose.x, pose.y)), seen.thinned(MATCHED)
        (place, heading), gate, last = _trust(guess), 0, len(GATES) - 1
        for _ in range(ITERATIONS):
            if (equations := reference.pull(own, pose, GATES[gate])) is None:
                self.again = 0.0
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
            if gate == last and _within(step, STILL):
                break
            gate = last if _within(step, SETTLED) else min(gate + 1, last)
        self.again = reference.again
        return pose, inverse


def _trust(guess: Pose2) -> tuple[float, float]:
    """What is known by the guess of each coordinate of the place and of the heading, in units of 1 / SIGMA²."""
    far, turned = math.hypot(guess.x, guess.y), abs(guess.yaw)
    return (SIGMA / (DOUBT[0] * far + DOUBT[1])) ** 2, (SIGMA / (DOUBT[2] * turned + DOUBT[3])) ** 2


def _inverse(matrix: Symmetric) -> Symmetric:
    """That of a positive definite matrix."""
    xx, xy, xa, yy, ya, aa = matrix
    of_xx, of_xy, of_xa = yy * aa - ya * ya, xa * ya - xy * aa, xy * ya - xa * yy
    each = 1 / (xx * of_xx + xy * of_xy + xa * of_xa)
    rest = (xx * aa - xa * xa) * each, (xy * xa - xx * ya) * each, (xx * yy - xy * xy) * each
    return of_xx * each, of_xy * each, of_xa * each, *rest


def _seen_from(yaw: float, inverse: Symmetric) -> Array:
    """The covariance (3, 3) of a step, in the frame of a base with heading `yaw`."""
    c, s, scale = math.cos(yaw), math.sin(yaw), INFLATED * SIGMA**2
    xx, xy, xa, yy, ya, aa = (scale * value for value in inverse)
    crossed = c * s * (yy - xx) + (c * c - s * s) * xy
    ahead, left = c * xa + s * ya, c * ya - s * xa
    along, aside = c * c * xx + 2 * c * s * xy + s * s * yy, s * s * xx - 2 * c * s * xy + c * c * yy
    return np.array((
        (along + FLOOR[0], crossed, ahead), (crossed, aside + FLOOR[1], left), (ahead, left, aa + FLOOR[2]),
    ))  # fmt: skip


def _root(covariance: Array) -> Array:
    """The lower triangle (3, 3) whose product with its own transpose is `covariance` (Cholesky)."""
    (xx, _, _), (xy, yy, _), (xa, ya, aa) = covariance.tolist()
    x = math.sqrt(xx)
    y_x, a_x = xy / x, xa / x
    y = math.sqrt(yy - y_x * y_x)
    a_y = (ya - a_x * y_x) / y
    return np.array(((x, 0.0, 0.0), (y_x, y, 0.0), (a_x, a_y, math.sqrt(aa - a_x * a_x - a_y * a_y))))


def _within(step: tuple[float, float], limits: tuple[float, float]) -> bool:
    return step[0] < limits[0] and step[1] < limits[1]
