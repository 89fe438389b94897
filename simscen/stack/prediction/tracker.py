"""Follows what moves from scan to scan.

What has come where an earlier scan saw through begins a track; a piece of a later scan near where a track should be
continues it; a track that keeps its speed for some updates, by more than noise would make it, is told as moving. What
nothing continues ends: soon where the lidar sees through the place, later where something hides it.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Scan
from simscen.model.guards import Prediction
from simscen.stack.prediction.clusters import BOTH, Clusters, clusters, fitted
from simscen.stack.prediction.kalman import corrected, predicted
from simscen.stack.prediction.moving import Moving, nothing
from simscen.stack.prediction.seen_through import FARTHEST, SeenThrough

CHECKED = 120
"""Beams of a scan that are looked at while nothing moves; all, when what one of these hits has appeared."""
APPEARED, FEW = 0.3, 3
"""Share of a piece's hits, and how many at least, that must have appeared to begin a track."""
NOISE, RELATIVE, HALF_SEEN = 0.02, 0.004, 0.10
"""Standard deviation in m of a measured centre: near by, for each metre of range, and more where a piece is hidden."""
GATE, GATE_SIGMAS = 0.25, 3.0
"""Metres, and standard deviations, beyond which a piece is no continuation of a track."""
FIRST_SPEED = 1.5
"""m/s: standard deviation of the velocity of what has just been seen."""
SURE, TRAVELLED, HITS = 3.0, 0.15, 3
"""A track moves when its speed is so many standard deviations, now or over its last updates, and it has come so far in
m in these, and in so many of them stood where it had been free."""
LATELY = 10
"""Updates that are looked at: who turns round has not come far from where he was first seen."""
ENDS_UNSEEN, ENDS_HIDDEN, ENDS_UNSURE = 0.35, 2.5, 0.8
"""Seconds without a hit after which a track ends: where the lidar sees through; where it cannot see; and for one that
was not moving. All end when their place is known worse than this many metres."""
UNSURE_PLACE = 1.2
FASTEST = 4.0
"""m/s: nothing indoors is faster; a track that is has gone from one thing to another."""
SEEN_WHOLE, FARTHER, TWICE = 5, 0.4, 1.6
"""One that began beside something that moves has to be seen whole so often, to go so far in m, and to be so many times
as fast as what moves at the least."""
STANDS, STOOD_OFTEN = 0.5, 0.2
"""Share of its hits that an earlier scan hit, too, from which a piece stands there; share of the last updates that a
track which began so may stand."""
LEAST_RADIUS = 0.15
"""Metres: of such a one."""
MOSTLY = 0.6
"""Share of the last updates of a track that moves in which it stands where it had been free; what hops along a row of
posts does not."""
FAR = 0.5
"""Metres beyond twice the largest radius: what has gone so far moves, though no beam was ever where it came from. What
is seen of a wall, at the end of the field of view, grows by less."""
RESTED, STOOD, REMEMBERED = 0.5, 1.5, 10.0
"""Seconds for which something stands until it is no longer followed, if it has not moved; until what moved is a thing
like any other, for who turns round stands a moment, too; and until nobody expects any more that it may set off again.
"""
HALF_RADIUS = 0.3
"""Metres: the least radius of what is half hidden when it is first seen: that of a person."""
BODY = 0.25
"""Metres: the least radius of what is told as moving. Of another robot the lidar may see no more than its mast, of a
person a leg."""
RADIUS_GAIN = 0.3
"""How much a new look at a whole piece changes the radius of a track."""


class Update(NamedTuple):
    """When and where a track was hit; whether it stood where it had been free, or where something had been hit before.

    `edges` is how many of its two ends were seen.
    """

    tick: int
    x: float
    y: float
    came: bool
    stood: bool
    edges: int


@dataclass
class Track:
    """What is known of a track besides its state; `lately` are its last updates."""

    radius: float
    born: Array
    lately: deque[Update] = field(default_factory=lambda: deque(maxlen=LATELY))
    moving: bool = False
    moved: bool = False
    fast_at: int = 0

    @property
    def hit_at(self) -> int:
        """When it was last hit."""
        return self.lately[-1].tick


class Tracker:
    """The tracks of one lidar, in the odom frame."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate
        self._memory = SeenThrough(tick_rate)
        self._angles: Array = np.zeros(0)
        self._some = self._all = slice(0, None)
        self._towards = np.zeros(0, dtype=np.complex128)
        self._tracks: list[Track] = []
        self._states, self._covariances = np.zeros((0, 4)), np.zeros((0, 4, 4))
        self._tick = 0
        self.began: int | None = None
        """When the first scan was taken."""
        self._belongs: npt.NDArray[np.bool_] | None = None
        self._nothing = nothing(spec.acceleration)
        self.moving = self._nothing
        """What moves, at the tick of the newest scan."""

    @property
    def tick(self) -> int:
        """When the newest scan was taken."""
        return self._tick

    @property
    def hits(self) -> npt.NDArray[np.bool_] | None:
        """Which beams of the newest scan hit something that moves; None when none does."""
        return self._belongs

    def on_scan(self, scan: Scan, odometry: Pose2) -> None:
        """Take a scan in that was taken with the base at `odometry`."""
        lidar = odometry.compose(scan.mount)
        if len(self._angles) != len(scan.ranges):
            self._look_along(scan.angles())
        if self.began is None:
            self.began = scan.tick
        self._forecast(scan.tick)
        self._belongs, self.moving = None, self._nothing
        if self._tracks or self._suspicious(scan, lidar):
            self._follow(scan, lidar)
        self._memory.remember(scan, lidar)

    def _look_along(self, angles: Array) -> None:
        """Note where the beams go, and which are looked at while nothing moves."""
        self._angles, self._towards = angles, np.exp(1j * angles)
        every = max(1, len(angles) // CHECKED)
        self._some, self._all = slice(0, None, every), slice(0, None)

    def _suspicious(self, scan: Scan, lidar: Pose2) -> bool:
        """Whether so many neighbouring beams hit what has appeared that it may be a thing."""
        if not len(self._appeared(scan, lidar, self._some)):
            return False
        beams = self._appeared(scan, lidar, self._all)
        return len(beams) >= FEW and bool((beams[FEW - 1 :] - beams[: 1 - FEW]).min() * APPEARED <= FEW)

    def _appeared(self, scan: Scan, lidar: Pose2, which: slice) -> npt.NDArray[np.int64]:
        """Which of these beams hit what has appeared."""
        ranges = scan.ranges[which]
        # What a beam that met nothing shows is farther off than anything was seen; nan is taken for that.
        places = np.fmin(np.fmax(ranges, 0.0), 2 * FARTHEST) * self._towards[which]
        beams = self._memory.appeared(scan.tick, places, lidar).nonzero()[0]
        return (
            beams[(ranges[beams] >= scan.range_min) & (ranges[beams] <= self._farthest(scan))] if len(beams) else beams
        )

    def _farthest(self, scan: Scan) -> float:
        return min(scan.range_max, self._spec.max_range)

    def _forecast(self, tick: int) -> None:
        seconds, self._tick = (tick - self._tick) / self._rate, tick
        if self._tracks and seconds > 0:
            self._states, self._covariances = predicted(
                self._states, self._covariances, seconds, self._spec.acceleration
            )

    def _follow(self, scan: Scan, lidar: Pose2) -> None:
        step = scan.angle_increment
        full = abs(len(scan.ranges) * abs(step) - 2 * math.pi) < abs(step)
        pieces = clusters(scan.ranges, self._angles, scan.range_min, self._farthest(scan), self._spec.max_radius, full)
        centres = lidar.apply(pieces.centres)
        count, share = self._shares(pieces, self._memory.appeared(scan.tick, pieces.places, lidar))
        came = (count >= FEW) & (share >= APPEARED)
        stood = np.zeros(len(came), dtype=bool)
        if any(track.moved for track in self._tracks):  # else nobody asks
            stood = self._shares(pieces, self._memory.stood(scan.tick, pieces.places, lidar))[1] > STANDS
        taken = self._associate(pieces, centres, came, stood, lidar)
        self._begin(pieces, centres, came, stood, taken, scan.tick)
        self._judge(scan, lidar)
        self._tell()
        self._mark(scan, lidar)

    def _shares(self, pieces: Clusters, which: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
        """How many (n,) of each piece's hits these are, and the share."""
        total = np.concatenate(([0], np.cumsum(which)))
        count = total[pieces.last + 1] - total[pieces.first]
        return count, count / (pieces.last - pieces.first + 1)

    def _associate(
        self, pieces: Clusters, centres: Array, came: npt.NDArray[np.bool_], stood: npt.NDArray[np.bool_], lidar: Pose2
    ) -> set[int]:
        """Give each track the piece nearest to where it should be, nearest pairs first."""
        taken: set[int] = set()
        if not self._tracks or not len(centres):
            return taken
        off = np.hypot(centres[None, :, 0] - self._states[:, None, 0], centres[None, :, 1] - self._states[:, None, 1])
        spread = np.sqrt(np.maximum(self._covariances[:, 0, 0], self._covariances[:, 1, 1]))
        radii = np.array([track.radius for track in self._tracks])
        # Of what is half hidden, the middle of the visible part may be a radius off.
        gate = GATE + GATE_SIGMAS * spread[:, None] + np.where(pieces.whole[None, :], 0.0, radii[:, None])
        pairs = np.argwhere(off <= gate)
        numbers, fits, places, deviations = list[int](), list[int](), list[Array](), list[float]()
        for track, piece in sorted(pairs.tolist(), key=lambda pair: (off[pair[0], pair[1]], pair)):
            if track in numbers or piece in taken:
                continue
            taken.add(piece)
            numbers.append(track)
            fits.append(piece)
            place, deviation = self._measured(self._tracks[track], pieces, piece, self._states[track], lidar)
            places.append(place)
            deviations.append(deviation)
        if numbers:
            self._states[numbers], self._covariances[numbers] = corrected(
                self._states[numbers], self._covariances[numbers], np.array(places), np.array(deviations)
            )
            for number, piece in zip(numbers, fits, strict=True):
                self._note(number, bool(came[piece]), bool(stood[piece]), int(pieces.edges[piece]))
        return taken

    def _measured(self, track: Track, pieces: Clusters, piece: int, state: Array, lidar: Pose2) -> tuple[Array, float]:
        """Where the middle of a track is seen, in the odom frame, and the standard deviation of that."""
        whole = bool(pieces.whole[piece])
        if whole:
            track.radius += RADIUS_GAIN * (float(pieces.radii[piece]) - track.radius)
        first = pieces.centres[piece] if whole else lidar.inverse().apply(state[None, :2])[0]
        centre = fitted(pieces.of(piece), first, track.radius)
        deviation = NOISE + RELATIVE * float(np.hypot(*centre)) + (0.0 if whole else HALF_SEEN)
        return lidar.apply(centre[None])[0], deviation

    def _begin(
        self,
        pieces: Clusters,
        centres: Array,
        came: npt.NDArray[np.bool_],
        stood: npt.NDArray[np.bool_],
        taken: set[int],
        tick: int,
    ) -> None:
        """Tracks of pieces that no track has taken and that stand where it was free."""
        # Among moving things others may, of which a thing that passed hid that they were not there before.
        also = (
            pieces.radii >= LEAST_RADIUS
            if any(track.moving for track in self._tracks)
            else np.zeros(len(came), dtype=bool)
        )
        new = [piece for piece in np.flatnonzero(came | also).tolist() if piece not in taken]
        if not new:
            return
        states = np.zeros((len(new), 4))
        states[:, :2] = centres[new]
        place = NOISE + RELATIVE * np.hypot(*pieces.centres[new].T) + 0.1
        covariances = np.zeros((len(new), 4, 4))
        covariances[:, 0, 0] = covariances[:, 1, 1] = place**2
        covariances[:, 2, 2] = covariances[:, 3, 3] = FIRST_SPEED**2
        self._states = np.concatenate((self._states, states))
        self._covariances = np.concatenate((self._covariances, covariances))
        for piece in new:
            track = Track(self._first_radius(pieces, piece), centres[piece].copy(), fast_at=tick)
            self._tracks.append(track)
            self._note(len(self._tracks) - 1, bool(came[piece]), bool(stood[piece]), 0)

    def _note(self, number: int, came: bool, stood: bool, edges: int) -> None:
        """Note that a track was hit."""
        x, y = self._states[number, :2].tolist()
        self._tracks[number].lately.append(Update(self._tick, x, y, came, stood, edges))

    @staticmethod
    def _first_radius(pieces: Clusters, piece: int) -> float:
        """Of what is half hidden more may be there than is seen."""
        radius = float(pieces.radii[piece])
        return radius if pieces.whole[piece] else max(radius, HALF_RADIUS)

    def _judge(self, scan: Scan, lidar: Pose2) -> None:
        """Which tracks move, and which end."""
        keep = []
        for number, track in enumerate(self._tracks):
            self._settle(number, track)
            unseen = (self._tick - track.hit_at) / self._rate
            spread = math.sqrt(max(self._covariances[number, 0, 0], self._covariances[number, 1, 1]))
            if unseen == 0.0:
                limit = math.inf
            elif not track.moving:
                limit = ENDS_UNSURE
            elif self._visible(number, scan, lidar):
                limit = ENDS_UNSEEN
            else:
                limit = ENDS_HIDDEN
            rests = REMEMBERED if track.moved else RESTED
            rested = not track.moving and (self._tick - track.fast_at) / self._rate > rests
            possible = math.hypot(*self._states[number, 2:].tolist()) < FASTEST
            if unseen <= limit and spread <= UNSURE_PLACE and possible and not rested:
                keep.append(number)
        if len(keep) < len(self._tracks):
            self._tracks = [self._tracks[number] for number in keep]
            self._states, self._covariances = self._states[keep], self._covariances[keep]

    def _settle(self, number: int, track: Track) -> None:
        vx, vy = self._states[number, 2:].tolist()
        speed = math.hypot(vx, vy)
        noise = math.sqrt(max(self._covariances[number, 2, 2], self._covariances[number, 3, 3]))
        if speed > self._spec.min_speed:
            track.fast_at = self._tick
        if track.moving:
            track.moving = (self._tick - track.fast_at) / self._rate <= STOOD
        elif track.moved and speed > max(self._spec.min_speed, noise) and track.hit_at == self._tick:
            track.moving = not track.lately[-1].stood  # it comes back over ground where it has just been
        elif speed > self._spec.min_speed:
            track.moving = track.moved = self._goes(number, track, speed, noise)

    def _goes(self, number: int, track: Track, speed: float, noise: float) -> bool:
        """Whether what is that fast is not only noise, nor something that stands and of which more comes into view."""
        x, y, vx, vy = self._states[number].tolist()
        lately, first = track.lately, track.lately[0]
        dx, dy = x - first.x, y - first.y
        way, seconds = math.hypot(dx, dy), (self._tick - first.tick) / self._rate
        if dx * vx + dy * vy <= 0.0:
            return False
        spread = math.sqrt(max(self._covariances[number, 0, 0], self._covariances[number, 1, 1]))
        whole = sum(each.edges == BOTH for each in lately)
        sure = speed > SURE * noise
        # Over the last updates, both ends may be off; and of what is half seen, more may come into view.
        went = way > max(self._spec.min_speed * seconds, SURE * math.sqrt(2.0) * spread) and 2 * whole > len(lately)
        if (sure or went) and sum(each.came for each in lately) >= max(HITS, MOSTLY * len(lately)):
            return way > TRAVELLED
        # Without that, only beside something else that moves: it may have hidden the place.
        if not sure or speed < TWICE * self._spec.min_speed or not any(each.moving for each in self._tracks):
            return False
        if sum(each.stood for each in lately) > STOOD_OFTEN * len(lately):
            return False
        far = math.dist((x, y), track.born.tolist()) > 2 * self._spec.max_radius + FAR
        if far and len(lately) == LATELY and sum(each.edges > 0 for each in lately) >= MOSTLY * LATELY:
            return True
        return whole >= SEEN_WHOLE and way > FARTHER

    def _visible(self, number: int, scan: Scan, lidar: Pose2) -> bool:
        """Whether the lidar sees past the place where the middle of a track should be."""
        x, y = lidar.inverse().apply(self._states[number : number + 1, :2])[0].tolist()
        turn = (math.atan2(y, x) - scan.angle_min) % (2 * math.pi)
        beam = round(turn / scan.angle_increment)
        return 0 <= beam < len(scan.ranges) and bool(scan.ranges[beam] > math.hypot(x, y))

    def _tell(self) -> None:
        """Note what moves."""
        which = [number for number, track in enumerate(self._tracks) if track.moving]
        if which:
            states, radii = self._states[which], np.array([max(self._tracks[number].radius, BODY) for number in which])
            self.moving = Moving(states[:, :2], states[:, 2:], radii, self._covariances[which], self._spec.acceleration)

    def _mark(self, scan: Scan, lidar: Pose2) -> None:
        """Note which beams hit what moves."""
        moving = self.moving
        if not len(moving):
            return
        with np.errstate(invalid="ignore"):
            use = np.flatnonzero((scan.ranges >= scan.range_min) & (scan.ranges <= scan.range_max))
        r, a = scan.ranges[use], self._angles[use]
        points = lidar.apply(np.column_stack((r * np.cos(a), r * np.sin(a))))
        off = np.hypot(points[:, None, 0] - moving.centres[None, :, 0], points[:, None, 1] - moving.centres[None, :, 1])
        room = self._spec.margin + moving.radii
        belongs = np.zeros(len(scan.ranges), dtype=bool)
        belongs[use] = (off <= room[None, :]).any(axis=1)
        self._belongs = belongs
