"""Tracking of moving obstacles in the scans of one lidar.

A cluster that appears in formerly free space starts a track. A later cluster near the predicted position updates it. A
track with a significant speed over some updates counts as moving. A track without updates ends: soon if its position is
visible, later if it is hidden.
"""

import numpy as np

from simscen.advanced.prediction.association import ScanClusters, associate, start_tracks
from simscen.advanced.prediction.clusters import Hits, Mask, Places, Runs, clusters, marked_hits, runs, valid_hits
from simscen.advanced.prediction.scan_outline import CurrentScan
from simscen.advanced.prediction.tracks import Track, TrackLifecycle
from simscen.advanced.prediction.visibility import FARTHEST, EarlierScan, FreeSpaceMemory
from simscen.core.geometry import Array, Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.guards import Prediction
from simscen.stack.moving_obstacles import MovingObstacle, MovingObstacles, no_moving_obstacles

CHECKED = 120
"""Number of beams that are checked while nothing moves; if one of them hits something new, all are."""
APPEARED, FEW = 0.3, 3
"""Minimum share and number of new hits of a cluster that starts a track."""
STANDS = 0.5
"""Share of hits that an earlier scan also has, above which a cluster is static."""
BODY = 0.25
"""Minimum radius in m of a moving obstacle. The lidar may see only the mast of a robot or the leg of a person."""


class Tracker:
    """Tracks of one lidar in the odom frame."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        """Take the parameters and the tick rate in Hz."""
        self._spec, self._rate = spec, tick_rate
        self._memory = FreeSpaceMemory(tick_rate)
        self._every, self._restless = 1, False
        self._towards = self._towards_some = np.zeros(0, dtype=np.complex128)
        self._tracks, self._going = list[Track](), TrackLifecycle(spec, tick_rate)
        self.tick = 0
        """Tick of the latest scan."""
        self.began: int | None = None
        """Tick of the first scan."""
        self.hits: Mask | None = None
        """Mask of the beams of the latest scan that hit moving obstacles; None if there are none."""
        self._nothing = no_moving_obstacles(spec.acceleration)
        self.moving = self._nothing
        """Moving obstacles at the tick of the latest scan."""

    @property
    def sees(self) -> bool:
        """Whether there are moving obstacles."""
        return self.moving is not self._nothing

    def on_scan(self, scan: Scan, odometry: Pose2) -> None:
        """Process a scan that was taken with the base at `odometry`."""
        lidar = odometry.compose(scan.mount)
        if len(self._towards) != len(scan.ranges):
            self._look_along(scan)
        if self.began is None:
            self.began = scan.tick
        seconds, self.tick = (scan.tick - self.tick) / self._rate, scan.tick
        if seconds > 0:
            for track in self._tracks:
                track.predict(seconds, self._spec.acceleration)
        self.hits, self.moving = None, self._nothing
        before = self._memory.before(scan.tick)
        if self._tracks or (before is not None and (self._restless or self._suspicious(scan, lidar, before))):
            self._follow(CurrentScan(scan, _ends(scan.ranges, self._towards), lidar, before))
        self._memory.remember(scan, lidar)

    def _look_along(self, scan: Scan) -> None:
        """Compute the directions of the beams, and of those that are checked while nothing moves."""
        self._every = max(1, len(scan.ranges) // CHECKED)
        self._towards = np.exp(1j * scan.angles())
        self._towards_some = self._towards[:: self._every].copy()

    def _suspicious(self, scan: Scan, lidar: Pose2, before: EarlierScan) -> bool:
        """Return whether one of the checked beams hits something new."""
        ranges = scan.ranges[:: self._every]
        looked = before.looked(_ends(ranges, self._towards_some), lidar)
        come = looked.free()
        if not come.any():
            return False
        come &= (ranges >= scan.range_min) & (ranges <= self._farthest(scan))
        return bool(looked.appeared(come).any())

    def _farthest(self, scan: Scan) -> float:
        return min(scan.range_max, self._spec.max_range)

    def _follow(self, sight: CurrentScan) -> None:
        seen = self._seen(sight)
        if seen is None:
            return
        tracks, going, tick = self._tracks, self._going, sight.scan.tick
        start_tracks(tracks, seen, associate(tracks, seen))
        followed: list[Track] = []
        for track in tracks:
            going.settle(track, tick, tracks, sight.left)
            if not going.ended(track, tick, tracks, sight.past):
                followed.append(track)
        self._tracks = followed
        if moving := [track for track in followed if track.moving]:
            self._tell(moving, sight)

    def _seen(self, sight: CurrentScan) -> ScanClusters | None:
        """Return the clusters of the scan compared with an earlier one; None if there is no track and none starts."""
        scan, before, tracks = sight.scan, sight.before, self._tracks
        hits = valid_hits(scan.ranges, sight.ends, scan.angle_increment, scan.range_min, self._farthest(scan))
        looked = None if before is None or not len(hits.beams) else before.looked(hits.places, sight.at)
        free = None if looked is None else looked.free()
        if not tracks and (free is None or not self._may_begin(hits, free)):
            return None
        found = runs(hits)
        appeared = None if looked is None or free is None else looked.appeared(free)
        if not tracks and (appeared is None or not self._begins(found, appeared)):
            return None
        pieces = clusters(found, scan.ranges, scan.angle_min, scan.angle_increment, self._spec.max_radius)
        came = stood = [False] * len(pieces)
        if looked is not None and appeared is not None and pieces:
            came = [count >= max(FEW, APPEARED * every) for count, every in marked_hits(pieces, appeared)]
            if tracks:
                stood = [count > STANDS * every for count, every in marked_hits(pieces, looked.stood())]
        return ScanClusters(scan.tick, hits.places, pieces, sight.lidar, came, stood)

    def _may_begin(self, hits: Hits, free: Mask) -> bool:
        """Return whether enough hits in formerly free space may belong to one obstacle."""
        which = free.nonzero()[0].tolist()
        self._restless = len(which) > 0
        return hits.may_be_together(which, FEW)

    def _begins(self, found: Runs, appeared: Mask) -> bool:
        """Return whether enough hits of a run are new, including one of the checked beams."""
        return found.together(appeared, FEW) and bool((found.hits.beams[appeared] % self._every == 0).any())

    def _tell(self, moving: list[Track], sight: CurrentScan) -> None:
        """Update the moving obstacles, and the beams that hit them."""
        scan, ends, lidar = sight.scan, sight.ends, sight.lidar
        things = [
            MovingObstacle(
                each.place,
                each.velocity,
                max(each.radius, BODY),
                each.variance,
                each.covariance,
                each.velocity_variance,
            )
            for each in moving
        ]
        self.moving = MovingObstacles.of(things, self._spec.acceleration)
        hits = np.zeros(len(ends), dtype=np.bool_)
        for thing in things:
            hits |= np.abs(ends - lidar.into(thing.place)) <= self._spec.margin + thing.radius
        self.hits = hits & (scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max)


def _ends(ranges: Array, towards: Places) -> Places:
    """Return the ends of beams (n,); beams without a valid range end farther away than anything that can be seen."""
    ends: Places = np.fmin(np.abs(ranges), 2 * FARTHEST) * towards  # too close beams have the range -inf
    return ends
