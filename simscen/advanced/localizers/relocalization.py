"""Relocalization: detects that the particle filter is lost, and searches the map for the robot.

All distances driven include rotations (scan_memory.METERS_PER_RAD). Scores are those of GlobalSearch.score.
"""

import math
from collections import deque

import numpy as np

from simscen.advanced.localizers.global_search import MIN_SEPARATION, GlobalSearch, View
from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.pose_prior import CERTAIN_STD, ObservedMotion, PosePrior
from simscen.advanced.localizers.scan_memory import ScanMemory, traveled
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane
from simscen.stack.localizers.particles import pose_errors

RECENT_SCANS, MIN_FITTING_SHARE = 5, 0.6
"""The robot may be lost if the mean share of fitting beams in this many scans is below the second value."""
MIN_MAPPED_SHARE = 0.6
"""Share of the beams that must end on the mapped area for the fit of a scan to be known."""
SEARCH_INTERVAL_M, MAX_SEARCH_INTERVAL_M = 0.7, 8.0
"""Distance driven between two searches of the map; doubled after each search without a result, up to the maximum."""
MIN_LENGTH_M, MIN_LEAD = 2.0, 0.05
"""A robot without initial pose gets a pose if the score of this pose, over at least MIN_LENGTH_M driven, exceeds that
of any other pose by MIN_LEAD."""
MIN_GAIN, MIN_SCORE = 0.1, 0.75
"""A robot that had a pose gets another one if two searches agree. The score must be above MIN_SCORE, and exceed that of
any other pose by MIN_LEAD and that of the current pose by MIN_GAIN."""
CHECK_INTERVAL_M, CERTAIN_SCORE = 1.5, 0.85
"""Distance driven after which poses near the current pose are searched, unless its score is above CERTAIN_SCORE."""
MIN_NEAR_SCORE, CERTAIN_GAIN = 0.82, 0.04
"""The estimate is moved to a nearby pose if the score of that pose is at least MIN_NEAR_SCORE, exceeds that of any
other pose by MIN_LEAD, and exceeds that of the estimate by MIN_GAIN. Above CERTAIN_SCORE, CERTAIN_GAIN suffices.

Scores are reduced by SCORE_SCALE times the negative log-likelihood of the drift since the last certain pose, because in
a changed corridor a pose one meter away may have a better score by chance.
"""
MAX_REDUCTION = 0.1
"""Maximum reduction of a score, because the last certain pose may be wrong."""
MIN_LOG_RATIO = 3.0
"""Log-likelihood ratio by which another pose must exceed the current one in the first `settling` m of Relocalizer."""
SAME_POSE = 0.7, 0.3
"""Maximum difference (m, rad) of the poses found by two searches that agree."""
AGREEMENT_LENGTH_M = 2.0
"""Distance driven over which searches must agree."""
UNMAPPED_DISTANCE_M, RETURN_SCORE, RETURN_LEAD = 5.0, 0.9, 0.1
"""After this distance driven outside the mapped area, the map is searched, too. The robot has returned if score and
lead exceed these values, which are higher than usual because unmapped rooms often resemble mapped ones."""
SCORE_SCALE = 0.02
"""Difference of two scores for which one pose is e times as likely as the other, and gets e times as many particles."""
UNOBSERVED_MOTION = ObservedMotion()
"""The motion if there is no scan matching."""


class Relocalizer:
    """Compares scans with the map at the estimated pose, and searches the whole map if they do not fit.

    The search uses the scans of the last meters together, which distinguishes rooms that look alike. A robot without
    initial pose has particles at all poses that fit until one of them is clearly the best. A robot with an initial pose
    gets another pose only if that pose is clearly better.
    """

    def __init__(self, search: GlobalSearch, trust: MapTrust, estimate: Estimate, settling: float) -> None:
        """Create the relocalizer. For the first `settling` m driven, it also searches near the initial `estimate`."""
        self._search, self._trust, self._memory = search, trust, ScanMemory()
        self._has_pose, self._estimate, self._settling = estimate.pose is not None, estimate, settling
        self._initial: PosePrior | None = None
        self._certain: PosePrior | None = None
        self._fitting_shares: deque[float] = deque(maxlen=RECENT_SCANS)
        self._driven, self._since_search, self._since_check, self._since_candidate = 0.0, 0.0, 0.0, 0.0
        self._interval, self._was_in_doubt = 0.0, False
        self._last: Pose2 | None = None
        self._candidate: tuple[Pose2, Pose2] | None = None  # pose found by the last search, and the base there
        self._mapped_at, self._knows_overlap = 0.0, False

    def update(
        self, scan: Scan, base: Pose2, estimated: Pose2, limits: tuple[float, float],
        motion: ObservedMotion = UNOBSERVED_MOTION, fitting_share: float | None = None,
    ) -> tuple[Array, Array] | None:  # fmt: skip
        """Return poses (k, 3) where the robot may be, with their shares (k,); None if the estimate should be kept.

        base:           pose of the robot when the scan was taken, in the drifting frame of scan matching or odometry
        estimated:      pose of the robot in the map
        limits:         minimum and maximum range of beams to use, in m
        motion:         motion since the last scan
        fitting_share:  share of the beams that fit at the estimated pose, if it is already known
        """
        ends = self.add_scan(scan, base, limits, motion)
        if not len(ends):
            return None
        current = np.array([estimated])
        if self._initial is not None and self._driven < self._settling:
            by_initial_pose = self._search_by_initial_pose(self._initial, base, current)
            if by_initial_pose is not None:
                return by_initial_pose
        if fitting_share is None:
            fitting_share = self._trust.fitting_share(current, ends, MIN_MAPPED_SHARE)
        if fitting_share is not None:
            self._fitting_shares.append(fitting_share)
            self._mapped_at = self._driven
        if self._has_pose and (found := self._search_nearby(base, current)) is not None:
            return found
        if self._has_pose and not (self._update_doubt() or self._is_unmapped):
            return None
        if self._since_search < self._interval:
            return None
        return self._search_map(self._memory.view_from(base), base, current)

    def add_scan(self, scan: Scan, base: Pose2, limits: tuple[float, float], motion: ObservedMotion) -> Plane:
        """Add a scan without checking the pose. Return its endpoints in the base frame. Arguments as in `update`."""
        self._propagate(base, motion)
        return self._memory.add(scan, base, *limits)

    def _propagate(self, base: Pose2, motion: ObservedMotion) -> None:
        """Propagate the priors of the pose, or forget them if the robot was carried."""
        last, self._last = self._last, base
        if last is None:
            if self._estimate.pose is not None:
                std = np.maximum(self._estimate.std, CERTAIN_STD)
                self._initial = self._certain = PosePrior.at(np.array(self._estimate.pose), base, std)
            return
        self._knows_overlap = motion.was_carried is not None
        distance = traveled(last, base)
        self._since_search += distance
        self._since_check += distance
        self._driven += distance
        self._since_candidate += distance
        if motion.was_carried or motion.is_scene_moving:
            self._memory.forget(0)
        if motion.was_carried:
            self._initial = self._certain = None
        self._initial = self._initial and self._initial.after(last, base, distance, motion)
        self._certain = self._certain and self._certain.after(last, base, distance, motion)

    def _search_by_initial_pose(self, initial: PosePrior, base: Pose2, current: Array) -> tuple[Array, Array] | None:
        """Return the most likely pose, given the initial pose and all scans since; None if the estimate is near it.

        In a room whose furniture was moved, one scan may fit a wrong pose, and the next scans, which show the same,
        confirm it. All scans together, and the condition that beams cross only free space, often show that this pose is
        wrong. If the map shows little of the surroundings, many poses fit by chance, and only the expected pose counts.
        """
        if not self._memory.length:
            return None
        view, expected = self._memory.view_from(base), initial.expected(base)[None]
        if not len(view.ends) or (score := self._search.score(current, view))[0] > CERTAIN_SCORE:
            return None
        is_mapped = self._trust.fitting_share(expected, view.ends, MIN_MAPPED_SHARE) is not None
        poses, scores = (
            self._search.search_near(view, expected[0]) if is_mapped else (expected, self._search.score(expected, view))
        )
        likelihoods = scores / SCORE_SCALE - initial.negative_log_likelihood(poses, base)
        own = score[0] / SCORE_SCALE - initial.negative_log_likelihood(current, base)[0]
        best = int(likelihoods.argmax())
        difference = pose_errors(current[0], poses[best : best + 1])[0]
        if likelihoods[best] - own < MIN_LOG_RATIO or (
            math.hypot(difference[0], difference[1]) < MIN_SEPARATION[0] and abs(difference[2]) < MIN_SEPARATION[1]
        ):
            return None
        self._fitting_shares.clear()
        return poses[best : best + 1], np.ones(1)

    def _search_nearby(self, base: Pose2, current: Array) -> tuple[Array, Array] | None:
        """Return a better pose near the current one, e.g. after drift outside the map; None if there is none."""
        if min(self._since_check, self._memory.length) < CHECK_INTERVAL_M:
            return None
        self._since_check, view = 0.0, self._memory.view_from(base)
        if not len(view.ends) or self._trust.fitting_share(current, view.ends, MIN_MAPPED_SHARE) is None:
            return None
        score = float(self._reduce_scores(self._search.score(current, view), current, base)[0])
        if score > CERTAIN_SCORE:
            self._certain = PosePrior.at(current[0], base)
            return None
        poses, scores = self._sort_by_score(*self._search.search_near(view, current[0]), base)
        gain = CERTAIN_GAIN if scores[0] > CERTAIN_SCORE else MIN_GAIN
        if not _leads(scores, MIN_LEAD) or scores[0] < max(MIN_NEAR_SCORE, score + gain):
            return None
        return self._accept(poses[:1], base)

    def _sort_by_score(self, poses: Array, scores: Array, base: Pose2) -> tuple[Array, Array]:
        """Return poses (n, 3) and their reduced scores (n,), best first."""
        reduced = self._reduce_scores(scores, poses, base)
        order = np.argsort(-reduced, kind="stable")
        return poses[order], reduced[order]

    def _reduce_scores(self, scores: Array, poses: Array, base: Pose2) -> Array:
        """Return the scores (n,) of `poses` (n, 3), reduced by how unlikely the drift to them is."""
        if self._certain is None:
            return scores
        return scores - np.minimum(SCORE_SCALE * self._certain.negative_log_likelihood(poses, base), MAX_REDUCTION)

    def _accept(self, poses: Array, base: Pose2) -> tuple[Array, Array]:
        """Return `poses` (1, 3) with all particles, and mark it as certain."""
        self._fitting_shares.clear()
        self._certain = PosePrior.at(poses[0], base)
        return poses, np.ones(1)

    def _update_doubt(self) -> bool:
        """Return whether recent scans do not fit. When this begins, forget scans that may be from another place."""
        is_in_doubt = (
            len(self._fitting_shares) == RECENT_SCANS and sum(self._fitting_shares) < RECENT_SCANS * MIN_FITTING_SHARE
        )
        if is_in_doubt and not self._was_in_doubt:
            if not self._knows_overlap:
                self._memory.forget(1)
            self._interval = 0.0
        self._was_in_doubt = is_in_doubt
        return is_in_doubt

    @property
    def _is_unmapped(self) -> bool:
        """Whether the estimated pose has been outside the mapped area for a long way."""
        return self._driven - self._mapped_at >= UNMAPPED_DISTANCE_M

    @property
    def _has_left_map(self) -> bool:
        """Whether the robot drove out of the mapped area. If it had been carried there, it could be anywhere."""
        return self._is_unmapped and self._certain is not None

    def _search_map(self, view: View, base: Pose2, current: Array) -> tuple[Array, Array] | None:
        """Return the poses that fit; for a robot that had a pose, only a pose that two searches agree on, or None."""
        poses, scores = self._search.search(view)
        last_interval, self._interval, self._since_search = self._interval, SEARCH_INTERVAL_M, 0.0
        if not len(poses):
            return None
        if not self._has_pose:
            self._has_pose = _leads(scores, MIN_LEAD) and self._memory.length >= MIN_LENGTH_M
            if self._has_pose:
                self._certain = PosePrior.at(poses[0], base)
            shares = np.exp((scores - scores[0]) / SCORE_SCALE)
            return poses, shares / shares.sum()
        min_score, lead = (RETURN_SCORE, RETURN_LEAD) if self._has_left_map else (MIN_SCORE, MIN_LEAD)
        poses, scores = self._sort_by_score(poses, scores, base)
        own = self._reduce_scores(self._search.score(current, view), current, base)[0]
        if _leads(scores, lead) and scores[0] > min_score and scores[0] > own + MIN_GAIN:
            found = Pose2(*poses[0].tolist())
            if self._candidate is None or not _agree(*self._candidate, found, base):
                self._candidate, self._since_candidate = (found, base), 0.0
            elif self._since_candidate >= AGREEMENT_LENGTH_M:
                self._candidate = None
                self._mapped_at = self._driven
                return self._accept(poses[:1], base)
        else:
            interval = MAX_SEARCH_INTERVAL_M if self._has_left_map else 2 * max(last_interval, SEARCH_INTERVAL_M)
            self._candidate, self._interval = None, min(MAX_SEARCH_INTERVAL_M, interval)
        return None


def _leads(scores: Array, lead: float) -> bool:
    """Return whether the first of the scores exceeds the second by `lead`."""
    return len(scores) == 1 or bool(scores[0] - scores[1] > lead)


def _agree(first: Pose2, first_base: Pose2, second: Pose2, second_base: Pose2) -> bool:
    """Return whether the motion of the base leads from the first pose to the second."""
    difference = first.compose(first_base.between(second_base)).between(second)
    return math.hypot(difference.x, difference.y) < SAME_POSE[0] and abs(difference.yaw) < SAME_POSE[1]
