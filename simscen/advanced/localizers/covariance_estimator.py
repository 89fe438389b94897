"""How far off a pose may be: by how the poses of the last meters scatter, and by how badly scans fit the map."""

import math
from collections import deque

import numpy as np

from simscen.advanced.localizers.map_residuals import ScanResiduals
from simscen.advanced.localizers.scan_matcher import FLOOR
from simscen.advanced.localizers.scan_memory import METERS_A_RAD
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.stack.localizers.planar_motion import swing, turn

COUNTED = 36
"""Corrections whose poses are opinions of where the robot is now: some 9 m of driving."""
LASTS = np.array((2.0, 2.0, 1.1))
"""m driven, turns included, in which errors ahead, aside and of the heading become others: those of poses 4 m apart
are correlated by 0.4, 0.4 and 0.1, whether everything is as mapped or furniture was moved."""
DRIFT = np.square((0.002, 0.002, 0.0016))
"""m, m, rad: squares of what matched scans drift by in one meter where they see enough."""
FORGOTTEN = 0.99
"""How much of what was learned before counts still, after each correction."""
PRIOR, BEFORE = np.array((1.7, 1.7, 1.0)), 20.0
"""Standard deviations ahead, aside and of the heading, over those of the particles, where beams are as far off as
`sigma_hit` says: before anything has scattered, and the corrections that this counts for."""
EXPECTED = 0.05
"""Opinions, far apart, that what beams and PRIOR say counts for: those of a robot that hardly moved say nothing."""
FREEDOM = 6.0
"""Degrees of freedom of a covariance that is told from so few opinions which hang together."""
WHEELS = 0.05, 0.05
"""Standard deviations of odometry before it was compared with steps that were seen: m and rad for each meter."""
COMPARED = 0.2
"""m²: squares of steps that these count for: three."""
LEAST = np.diag(np.square((1e-3, 1e-3, 1e-3)))
"""m, m, rad: nothing is known better, so that no covariance is singular."""


class CovarianceEstimator:
    """Widens or narrows the covariance of particles, which take each scan for news and each beam for independent.

    What stands elsewhere than the map shows it, and cells that are half a cell off, pull scan after scan the same way
    for as long as they are in sight: the particles agree, and are wrong together. Two things tell, for each axis of
    the robot, how many times further off they are than their covariance says. One is how they scatter: scans that are
    matched with each other know nothing of the map, so each of the last COUNTED poses, carried on to the present by
    them, is an opinion of where the robot is, that differs from the one that is told by both errors, as far as they
    are not the same, and by what the matches drift. The other one is how far off the beams are that the map explains
    (in the adjustment of observations: the variance of unit weight): errors that all poses share do not scatter. How
    much a beam that is off means for the pose is learned from the first. The two are averaged. Where the map explains
    only some of the beams it does so by chance, too: the fewer, the wider. And a covariance that is estimated makes
    errors over it Student's, whose squares are larger by FREEDOM / (FREEDOM - 2).
    Between corrections it grows as odometry has been seen to err.
    """

    def __init__(self) -> None:
        self._meant, self._counts = PRIOR * BEFORE, BEFORE
        self._off, self._turned, self._squares = WHEELS[0] ** 2 * COMPARED, WHEELS[1] ** 2 * COMPARED, COMPARED
        self.forget()

    def forget(self) -> None:
        """The robot is elsewhere than was thought: opinions are void, but not what was learned of them."""
        self._poses: Array = np.empty((0, 3))
        self._bases: Array = np.empty((0, 3))
        self._drifts: Array = np.empty((0, 3, 3))  # since each opinion, in the frame of the bases
        self._ways, self._weights = np.empty(0), np.empty(0)
        self._misfits: deque[ScanResiduals] = deque(maxlen=COUNTED)
        self._base: Pose2 | None = None

    def compare(self, seen: Pose2, odometry: Pose2) -> None:
        """Take in what the scans show of a step of which odometry says something else: by more than they err alone."""
        x, y, yaw = odometry.between(seen)
        self._off = max(0.0, FORGOTTEN * self._off + (x * x + y * y - FLOOR[0] - FLOOR[1]) / 2)
        self._turned = max(0.0, FORGOTTEN * self._turned + yaw * yaw - FLOOR[2])
        self._squares = FORGOTTEN * self._squares + _way(odometry) ** 2

    def carry(self, covariance: Array, yaw: float, delta: Pose2) -> Array:
        """The covariance (3, 3) after `delta` of odometry, which errs as it did, of a pose with heading `yaw`."""
        c, s, share = math.cos(yaw), math.sin(yaw), _way(delta) ** 2 / self._squares
        aside = self._off * share
        noise = aside, 0.0, 0.0, aside, 0.0, self._turned * share
        return swing(covariance, c * delta.x - s * delta.y, s * delta.x + c * delta.y, noise)

    def drive(self, base: Pose2, doubt: Array | None) -> None:
        """The robot is at `base` in a frame that drifts slowly: what its scans say without the map.

        `doubt` (3, 3) is the covariance of the step there, in the frame of the base before it, as its scans were
        matched; None where they were not, and wheels told it.
        """
        last, self._base = self._base or base, base
        step = last.between(base)
        way = _way(step)
        if doubt is None:
            share = way**2 / self._squares
            doubt = np.diag((self._off * share, self._off * share, self._turned * share))
        else:
            doubt = doubt - np.diag(FLOOR)  # what steps are off by about the way does not add up along it
        frame = turn(last.yaw)
        swung = np.array(((1.0, 0.0, last.y - base.y), (0.0, 1.0, base.x - last.x), (0.0, 0.0, 1.0)))
        self._drifts = swung @ self._drifts @ swung.T + frame @ (doubt + np.diag(DRIFT * way)) @ frame.T
        self._ways = self._ways + way

    def widened(self, pose: Pose2, covariance: Array, misfit: ScanResiduals | None) -> Array:
        """The covariance (3, 3) of `pose` after a correction at the base that was driven to.

        The particles say `covariance`; `misfit` is that of the scan.
        """
        own = covariance + LEAST
        self._add(pose, 1.0 / float(own[0, 0] + own[1, 1]))
        if misfit is not None:
            self._misfits.append(misfit)
        fits, off = self._beams()
        axes = turn(pose.yaw).T
        told = axes @ own @ axes.T
        meant = self._meant / self._counts
        scattered = self._scattered(np.diag(told), np.square(meant * off))
        self._meant = FORGOTTEN * self._meant + scattered / off
        self._counts = FORGOTTEN * self._counts + 1.0
        expected = off * self._meant / self._counts
        times = (scattered + expected) / 2.0 / fits * math.sqrt(FREEDOM / (FREEDOM - 2.0))
        widened: Array = axes.T @ (told * np.outer(times, times)) @ axes
        return widened

    def _add(self, pose: Pose2, weight: float) -> None:
        """One more opinion; `weight` (1/m²) is how sure its particles were of it."""
        assert self._base is not None  # every correction is driven to
        kept = slice(1 - COUNTED, None)
        self._poses = np.vstack((self._poses[kept], pose))
        self._bases = np.vstack((self._bases[kept], self._base))
        self._drifts = np.concatenate((self._drifts[kept], np.zeros((1, 3, 3))))
        self._ways = np.append(self._ways[kept], 0.0)
        self._weights = np.append(self._weights[kept], weight)

    def _beams(self) -> tuple[float, float]:
        """The share of the beams of the last scans that the map explains, and how far off these are, in standard
        deviations of a beam."""
        if not self._misfits:
            return 1.0, 1.0
        fits, squares = (sum(values) / len(self._misfits) for values in zip(*self._misfits, strict=True))
        return fits, math.sqrt(max(squares / fits, 1e-3))

    def _scattered(self, own: Array, expected: Array) -> Array:
        """How many times further off poses are than variances `own` (3,) say, ahead, aside and in heading: (3,).

        By what the opinions differ from the newest one: the less, the more of that is drift. `expected` (3,) are the
        squares that are thought before any says anything.
        """
        x, y, yaw = self._poses[-1]
        turned = self._poses[:, 2] - self._bases[:, 2]
        carried = np.exp(1j * turned) * ((self._bases[-1] - self._bases)[:, :2] @ (1.0, 1j))
        away = (self._poses[:, :2] @ (1.0, 1j) + carried - complex(x, y)) * np.exp(-1j * yaw)
        off = np.column_stack((away.real, away.imag, wrap_array(turned - turned[-1])))
        c, s = math.cos(self._bases[-1, 2]), math.sin(self._bases[-1, 2])
        (xx, xy, _), (_, yy, _), (_, _, aa) = self._drifts.transpose(1, 2, 0)
        drift = np.column_stack(
            (c * c * xx + 2 * c * s * xy + s * s * yy, s * s * xx - 2 * c * s * xy + c * c * yy, aa)
        )
        telling = np.square(own / (own + drift)) * (self._weights / self._weights.sum())[:, np.newaxis]
        past = self._ways[:, np.newaxis] / LASTS
        apart = 2.0 * (1.0 - (1.0 + past) * np.exp(-past))  # Matérn's correlation, of errors that change smoothly
        squares = (telling * np.square(off)).sum(axis=0) / own + EXPECTED * expected
        times: Array = np.sqrt(squares / ((telling * apart).sum(axis=0) + EXPECTED))
        return times


def _way(step: Pose2) -> float:
    """Meters, turns included."""
    return math.hypot(step.x, step.y) + METERS_A_RAD * abs(step.yaw)
