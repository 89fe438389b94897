"""Follows what moves from scan to scan.

What has come where an earlier scan saw through begins a track; a piece of a later scan near where a track should be
continues it; a track that keeps its speed for some updates, by more than noise would make it, is told as moving. What
nothing continues ends: soon where the lidar sees through the place, later where something hides it.
"""

import math
from functools import partial

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Scan
from simscen.model.guards import Prediction
from simscen.stack.prediction.association import Seen, associate, begin
from simscen.stack.prediction.clusters import Clusters, clusters
from simscen.stack.prediction.going import Going
from simscen.stack.prediction.moving import Moving, nothing
from simscen.stack.prediction.seen_through import FARTHEST, SeenThrough
from simscen.stack.prediction.tracks import Tracks

CHECKED = 120
"""Beams of a scan that are looked at while nothing moves; all, when what one of these hits has appeared."""
APPEARED, FEW = 0.3, 3
"""Share of a piece's hits, and how many at least, that must have appeared to begin a track."""
STANDS = 0.5
"""Share of its hits that an earlier scan hit, too, from which a piece stands there."""
BODY = 0.25
"""Metres: the least radius of what is told as moving. Of another robot the lidar may see no more than its mast, of a
person a leg."""


class Tracker:
    """The tracks of one lidar, in the odom frame."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate
        self._memory = SeenThrough(tick_rate)
        self._angles: Array = np.zeros(0)
        self._every = 1
        self._towards = self._towards_some = np.zeros(0, dtype=np.complex128)
        self._tracks, self._going = Tracks(), Going(spec, tick_rate)
        self.began: int | None = None
        """When the first scan was taken."""
        self.hits: npt.NDArray[np.bool_] | None = None
        """Which beams of the newest scan hit something that moves; None when none does."""
        self._nothing = nothing(spec.acceleration)
        self.moving = self._nothing
        """What moves, at the tick of the newest scan."""

    @property
    def sees(self) -> bool:
        """Whether anything moves."""
        return self.moving is not self._nothing

    @property
    def tick(self) -> int:
        """When the newest scan was taken."""
        return self._tracks.tick

    def on_scan(self, scan: Scan, odometry: Pose2) -> None:
        """Take a scan in that was taken with the base at `odometry`."""
        lidar = odometry.compose(scan.mount)
        if len(self._angles) != len(scan.ranges):
            self._look_along(scan)
        if self.began is None:
            self.began = scan.tick
        self._tracks.forecast(scan.tick, (scan.tick - self.tick) / self._rate, self._spec.acceleration)
        self.hits, self.moving = None, self._nothing
        if len(self._tracks) or self._suspicious(scan, lidar):
            self._follow(scan, lidar)
        self._memory.remember(scan, lidar)

    def _look_along(self, scan: Scan) -> None:
        """Note where the beams go, and which are looked at while nothing moves."""
        self._angles = scan.angles()
        self._every = max(1, len(self._angles) // CHECKED)
        self._towards = np.exp(1j * self._angles)
        self._towards_some = self._towards[:: self._every].copy()

    def _suspicious(self, scan: Scan, lidar: Pose2) -> bool:
        """Whether so many neighbouring beams hit what has appeared that it may be a thing."""
        some = scan.ranges[:: self._every]
        if not len(self._appeared(scan, some, self._towards_some, lidar)):
            return False
        beams = self._appeared(scan, scan.ranges, self._towards, lidar)
        return len(beams) >= FEW and bool((beams[FEW - 1 :] - beams[: 1 - FEW]).min() * APPEARED <= FEW)

    def _appeared(
        self, scan: Scan, ranges: Array, towards: npt.NDArray[np.complex128], lidar: Pose2
    ) -> npt.NDArray[np.int64]:
        """Which beams of these ranges hit what has appeared."""
        # What a beam that met nothing shows is farther off than anything was seen; nan is taken for that.
        places = np.fmin(np.fmax(ranges, 0.0), 2 * FARTHEST) * towards
        beams = self._memory.appeared(scan.tick, places, lidar).nonzero()[0]
        if not len(beams):
            return beams
        hit = ranges[beams]
        return beams[(hit >= scan.range_min) & (hit <= self._farthest(scan))]

    def _farthest(self, scan: Scan) -> float:
        return min(scan.range_max, self._spec.max_range)

    def _follow(self, scan: Scan, lidar: Pose2) -> None:
        tracks, seen = self._tracks, self._seen(scan, lidar)
        visible = partial(self._visible, scan, lidar)
        begin(tracks, seen, associate(tracks, seen))
        keep = []
        for number in range(len(tracks)):
            self._going.settle(tracks, number)
            if not self._going.ended(tracks, number, visible):
                keep.append(number)
        tracks.keep(keep)
        which = [number for number, track in enumerate(tracks.known) if track.moving]
        if which:
            self._tell(which)
            self._mark(scan, lidar)

    def _seen(self, scan: Scan, lidar: Pose2) -> Seen:
        """The scan in pieces, and what an earlier one saw where they are."""
        step = scan.angle_increment
        full = abs(len(scan.ranges) * abs(step) - 2 * math.pi) < abs(step)
        pieces = clusters(scan.ranges, self._angles, scan.range_min, self._farthest(scan), self._spec.max_radius, full)
        count, share = self._shares(pieces, self._memory.appeared(scan.tick, pieces.places, lidar))
        came = (count >= FEW) & (share >= APPEARED)
        stood = np.zeros(len(came), dtype=bool)
        if any(track.moved for track in self._tracks.known):  # else nobody asks
            stood = self._shares(pieces, self._memory.stood(scan.tick, pieces.places, lidar))[1] > STANDS
        return Seen(pieces, lidar.apply(pieces.centres), lidar, came, stood)

    @staticmethod
    def _shares(pieces: Clusters, which: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
        """How many (n,) of each piece's hits these are, and the share."""
        total = np.concatenate(([0], np.cumsum(which)))
        count = total[pieces.last + 1] - total[pieces.first]
        return count, count / (pieces.last - pieces.first + 1)

    def _visible(self, scan: Scan, lidar: Pose2, number: int) -> bool:
        """Whether the lidar sees past the place where the middle of a track should be."""
        x, y = lidar.inverse().apply(self._tracks.states[number : number + 1, :2])[0].tolist()
        turn = (math.atan2(y, x) - scan.angle_min) % (2 * math.pi)
        beam = round(turn / scan.angle_increment)
        return 0 <= beam < len(scan.ranges) and bool(scan.ranges[beam] > math.hypot(x, y))

    def _tell(self, which: list[int]) -> None:
        """Note what moves."""
        tracks = self._tracks
        states, radii = tracks.states[which], np.array([max(tracks.known[number].radius, BODY) for number in which])
        self.moving = Moving(states[:, :2], states[:, 2:], radii, tracks.covariances[which], self._spec.acceleration)

    def _mark(self, scan: Scan, lidar: Pose2) -> None:
        """Note which beams hit what moves."""
        moving = self.moving
        with np.errstate(invalid="ignore"):
            use = np.flatnonzero((scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max))
        r, a = scan.ranges[use], self._angles[use]
        points = lidar.apply(np.column_stack((r * np.cos(a), r * np.sin(a))))
        off = np.hypot(points[:, None, 0] - moving.centres[None, :, 0], points[:, None, 1] - moving.centres[None, :, 1])
        room = self._spec.margin + moving.radii
        belongs = np.zeros(len(scan.ranges), dtype=bool)
        belongs[use] = (off <= room[None, :]).any(axis=1)
        self.hits = belongs
