"""Relocalization: detects that the particle filter is lost, and searches the map for the robot's pose.

All distances driven include rotations (scan_memory.METERS_PER_RAD). Scores of poses are from GlobalSearch.score. The
lead of a pose is its score minus the next best score. Its gain is its score minus the score of the current pose.
"""

import math
from collections import deque

import numpy as np

from simscen.advanced.localizers.global_search import GlobalSearch, View, are_distinct
from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.pose_prior import CERTAIN_STD, ObservedMotion, PosePrior
from simscen.advanced.localizers.scan_memory import ScanMemory, distance_driven
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import ComplexPoints

RECENT_SCANS, MIN_FITTING_SHARE = 5, 0.6
"""The robot may be lost if the mean share of fitting beams in the last RECENT_SCANS is below MIN_FITTING_SHARE."""
MIN_MAPPED_SHARE = 0.6
"""Minimum share of the beams of a scan that end on the mapped area. With fewer, the fit of the scan is unknown."""
SEARCH_INTERVAL_M, MAX_SEARCH_INTERVAL_M = 0.7, 8.0
"""Distance driven between two searches of the map; doubled after each search without a result, up to the maximum."""
MIN_LENGTH_M, MIN_LEAD = 2.0, 0.05
"""Minimum distance driven, and minimum lead of a pose, before a robot without initial pose gets this pose."""
MIN_GAIN, MIN_SCORE = 0.1, 0.75
"""A pose replaces the current one if its score is above MIN_SCORE, its gain is above MIN_GAIN, its lead is above
MIN_LEAD, and two searches agree."""
CHECK_INTERVAL_M, CERTAIN_SCORE = 1.5, 0.85
"""Distance driven between two searches near the current pose. If the score of the current pose is above CERTAIN_SCORE,
no search is necessary."""
MIN_NEAR_SCORE, CERTAIN_GAIN = 0.82, 0.04
"""A nearby pose replaces the current one if its score is at least MIN_NEAR_SCORE, its lead above MIN_LEAD, and its gain
at least MIN_GAIN. If its score is above CERTAIN_SCORE, a gain of CERTAIN_GAIN suffices."""
MAX_REDUCTION = 0.1
"""Maximum reduction of the score of a pose, if the drift from the last certain pose to this pose is unlikely."""
MIN_LOG_RATIO = 3.0
"""Minimum log-likelihood ratio of another pose to the current one, while the robot drives the first `settling` m."""
SAME_POSE_TOLERANCE = 0.7, 0.3
"""Maximum difference (m, rad) of the poses found by two searches that agree."""
AGREEMENT_LENGTH_M = 2.0
"""Minimum distance driven between two searches that agree."""
UNMAPPED_DISTANCE_M, RETURN_SCORE, RETURN_LEAD = 5.0, 0.9, 0.1
"""Distance driven outside the mapped area after which the map is searched, and minimum score and lead of a pose found
in this search. Both are higher because unmapped rooms often resemble mapped rooms."""
SCORE_SCALE = 0.02
"""Difference of scores for which one pose is e times as likely as the other, and gets e times as many particles."""
UNOBSERVED_MOTION = ObservedMotion()
"""Motion between two scans that were not matched."""
PoseHypotheses = tuple[Array, Array]
"""Poses (k, 3) where the robot may be, and their shares (k,) of the particles."""


class Relocalizer:
    """Compares scans with the map at the estimated pose, and searches the whole map if the scans do not fit.

    The search uses the scans of the last meters together. A robot without initial pose has particles at all fitting
    poses until one of these poses is clearly the best. A robot with a pose gets another pose only if the other
    pose is clearly better.
    """

    def __init__(self, search: GlobalSearch, trust: MapTrust, estimate: Estimate, settling: float) -> None:
        """Create the relocalizer. The pose of `estimate` is also considered for the first `settling` m driven."""
        self._search, self._trust, self._memory = search, trust, ScanMemory()
        self._has_pose, self._estimate, self._settling = estimate.pose is not None, estimate, settling
        self._initial: PosePrior | None = None
        """Prior from the pose of `estimate`."""
        self._certain: PosePrior | None = None
        """Prior from the last certain pose."""
        self._fitting_shares: deque[float] = deque(maxlen=RECENT_SCANS)
        self._driven = self._searched_at = self._checked_at = self._mapped_at = 0.0  # distances driven
        self._interval, self._was_in_doubt, self._knows_overlap = 0.0, False, False
        self._last: Pose2 | None = None
        self._candidate: tuple[Pose2, Pose2, float] | None = None
        """Best pose of the last search, with the pose in the drifting frame and the distance driven at that time."""

    def update(
        self, scan: Scan, base: Pose2, estimated: Pose2, limits: tuple[float, float],
        motion: ObservedMotion = UNOBSERVED_MOTION, fitting_share: float | None = None,
    ) -> PoseHypotheses | None:  # fmt: skip
        """Return where the robot may be; None if the estimate should be kept.

        base:           pose of the robot at the time of the scan, in the drifting frame of scan matching or odometry
        estimated:      estimated pose of the robot in the map
        limits:         minimum and maximum range of beams to use, in m
        motion:         motion since the last scan
        fitting_share:  share of the beams that fit the map at the estimated pose; None if not computed yet
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
        if self._driven - self._searched_at < self._interval:
            return None
        return self._search_map(self._memory.view_from(base), base, current)

    def add_scan(self, scan: Scan, base: Pose2, limits: tuple[float, float], motion: ObservedMotion) -> ComplexPoints:
        """Add a scan without checking the pose. Return the endpoints in the base frame. Arguments as in `update`."""
        self._propagate(base, motion)
        return self._memory.add(scan, base, *limits)

    def _propagate(self, base: Pose2, motion: ObservedMotion) -> None:
        """Propagate the pose priors by a motion to `base`, or forget them if the robot was carried."""
        last, self._last = self._last, base
        if last is None:
            if self._estimate.pose is not None:
                std = np.maximum(self._estimate.std, CERTAIN_STD)
                self._initial = self._certain = PosePrior.at(np.array(self._estimate.pose), base, std)
            return
        self._knows_overlap = motion.was_carried is not None
        distance = distance_driven(last, base)
        self._driven += distance
        if motion.was_carried or motion.is_scene_moving:
            self._memory.forget(0)
        if motion.was_carried:
            self._initial = self._certain = None
        self._initial = self._initial and self._initial.propagate(last, base, distance, motion)
        self._certain = self._certain and self._certain.propagate(last, base, distance, motion)

    def _search_by_initial_pose(self, initial: PosePrior, base: Pose2, current: Array) -> PoseHypotheses | None:
        """Return the most likely pose, given the initial pose and stored scans; None if `current` is nearly as likely.

        If few beams end on the mapped area, many poses fit by chance, and only the pose that odometry and scan matching
        predict is considered.
        """
        if not self._memory.length:
            return None
        view, expected = self._memory.view_from(base), initial.expected(base)[None]
        if not len(view.ends) or (current_score := self._search.score(current, view)[0]) > CERTAIN_SCORE:
            return None
        is_mapped = self._trust.fitting_share(expected, view.ends, MIN_MAPPED_SHARE) is not None
        poses, scores = (
            self._search.search_near(view, expected[0]) if is_mapped else (expected, self._search.score(expected, view))
        )
        log_likelihoods = scores / SCORE_SCALE - initial.negative_log_likelihood(poses, base)
        current_log_likelihood = current_score / SCORE_SCALE - initial.negative_log_likelihood(current, base)[0]
        best = log_likelihoods.argmax()
        found = poses[best : best + 1]
        log_ratio = log_likelihoods[best] - current_log_likelihood
        if log_ratio < MIN_LOG_RATIO or not are_distinct(current[0], found)[0]:
            return None
        self._fitting_shares.clear()
        return found, np.ones(1)

    def _search_nearby(self, base: Pose2, current: Array) -> PoseHypotheses | None:
        """Return a better pose near the `current` one (1, 3), e.g. after drift; None if there is none."""
        if min(self._driven - self._checked_at, self._memory.length) < CHECK_INTERVAL_M:
            return None
        self._checked_at, view = self._driven, self._memory.view_from(base)
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
        """Return the scores (n,) of `poses` (n, 3), reduced by the negative log-likelihood of the drift to them."""
        if self._certain is None:
            return scores
        return scores - np.minimum(SCORE_SCALE * self._certain.negative_log_likelihood(poses, base), MAX_REDUCTION)

    def _accept(self, poses: Array, base: Pose2) -> PoseHypotheses:
        """Return a pose (1, 3) with the share 1 of the particles, and make it the last certain pose."""
        self._fitting_shares.clear()
        self._certain = PosePrior.at(poses[0], base)
        return poses, np.ones(1)

    def _update_doubt(self) -> bool:
        """Return whether recent scans do not fit the map.

        If recent scans fitted before, make the next search due at once, and forget older scans. Older scans are kept if
        scan matching knows whether the robot was carried.
        """
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
        """Whether the robot has driven UNMAPPED_DISTANCE_M outside the mapped area, by the estimated pose."""
        return self._driven - self._mapped_at >= UNMAPPED_DISTANCE_M

    @property
    def _has_left_map(self) -> bool:
        """Whether the robot drove out of the mapped area, and was not carried."""
        return self._is_unmapped and self._certain is not None

    def _search_map(self, view: View, base: Pose2, current: Array) -> PoseHypotheses | None:
        """Return the fitting poses and their shares. If the robot has a pose, two searches must agree on a new one."""
        poses, scores = self._search.search(view)
        last_interval, self._interval, self._searched_at = self._interval, SEARCH_INTERVAL_M, self._driven
        if not len(poses):
            return None
        if not self._has_pose:
            self._has_pose = _leads(scores, MIN_LEAD) and self._memory.length >= MIN_LENGTH_M
            if self._has_pose:
                self._certain = PosePrior.at(poses[0], base)
            shares = np.exp((scores - scores[0]) / SCORE_SCALE)
            return poses, shares / shares.sum()
        min_score, min_lead = (RETURN_SCORE, RETURN_LEAD) if self._has_left_map else (MIN_SCORE, MIN_LEAD)
        poses, scores = self._sort_by_score(poses, scores, base)
        current_score = self._reduce_scores(self._search.score(current, view), current, base)[0]
        if _leads(scores, min_lead) and scores[0] > min_score and scores[0] > current_score + MIN_GAIN:
            found = Pose2(*poses[0].tolist())
            if self._candidate is None or not _agree(*self._candidate[:2], found, base):
                self._candidate = found, base, self._driven
            elif self._driven - self._candidate[2] >= AGREEMENT_LENGTH_M:
                self._candidate, self._mapped_at = None, self._driven
                return self._accept(poses[:1], base)
        else:
            interval = MAX_SEARCH_INTERVAL_M if self._has_left_map else 2 * max(last_interval, SEARCH_INTERVAL_M)
            self._candidate, self._interval = None, min(MAX_SEARCH_INTERVAL_M, interval)
        return None


def _leads(scores: Array, min_lead: float) -> bool:
    """Return whether the first of the scores (n,) exceeds the second score by more than `min_lead`."""
    return len(scores) == 1 or bool(scores[0] - scores[1] > min_lead)


def _agree(first: Pose2, first_base: Pose2, second: Pose2, second_base: Pose2) -> bool:
    """Return whether the motion from `first_base` to `second_base` leads from the pose `first` to `second`."""
    difference = first.compose(first_base.between(second_base)).between(second)
    max_distance, max_turn = SAME_POSE_TOLERANCE
    return math.hypot(difference.x, difference.y) < max_distance and abs(difference.yaw) < max_turn
