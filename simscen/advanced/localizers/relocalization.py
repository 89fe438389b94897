"""When a particle filter is lost, and where its robot may be instead."""

import math
from collections import deque

import numpy as np

from simscen.advanced.localizers.global_search import APART, GlobalSearch, View
from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.pose_prior import AROUND, ObservedMotion, PosePrior
from simscen.advanced.localizers.scan_memory import ScanMemory, travelled
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.stack.localizers.beams import Plane
from simscen.stack.localizers.clusters import errors_about

RECENT, DOUBTFUL = 5, 0.6
"""Over so many scans that corrected the share of the beams that fit is averaged, and below this the robot may be lost.
"""
TELLING = 0.6
"""Share of the beams that must end where the map says anything, for a scan to count."""
BETWEEN, MOST_BETWEEN = 0.7, 8.0
"""m between two searches, turns included; doubled up to the most while the robot has a place and nothing better is
found."""
ENOUGH, PLAIN, BETTER, GOOD = 2.0, 0.05, 0.1, 0.75
"""A robot that was told nothing is where scans of ENOUGH meters fit by PLAIN better than anywhere else; one that had a
place is elsewhere when they fit there so, and GOOD, and by BETTER better than where it was, in two searches that agree.
"""
CHECKED, FITS = 1.5, 0.85
"""m, turns included, after each of which a robot that has a place is compared with its neighborhood, if what it saw
fits less than that."""
NEAR_GOOD, NEAR_BETTER = 0.82, 0.04
"""It is moved to a place nearby that fits so and BETTER than where it is, or more than FITS and so much better, and by
PLAIN better than any other. Each fit counts less by SHARPNESS for each e times that it is unlikely to have drifted
there since it was last sure of its place: rebuilt corridors fit a meter further on by chance, better than here."""
UNREACHED = 0.1
"""At most: where it was sure it may have been wrong."""
LIKELIER = 3.0
"""While a told place counts: the logarithm of how many times likelier another place nearby must be for a robot to be
moved there, by what was told and all that was seen since."""
AGREE = 0.7, 0.3
"""m, rad: two searches agree that find places so near to each other, the way between them taken off."""
AGREED = 2.0
"""m, turns included, over which searches must agree."""
ASTRAY, BACK_GOOD, BACK_PLAIN = 20, 0.9, 0.1
"""So many scans that correct without a beam that the map could tell anything of, and a robot is sought on the map, too:
what it saw since says it is back if it fits so, and by so much better than anywhere else, in two searches that agree.
Rooms that nobody mapped often look like one that somebody did, though less than that."""
SHARPNESS = 0.02
"""Of two places that fit so much better or worse, the better is e times as likely, and gets as many more particles."""
UNSEEN = ObservedMotion()
"""Of a robot that does not see how it goes."""


class Relocalizer:
    """Watches how well scans fit where the robot is believed to be, and searches the whole map when they do not.

    The search takes the scans of the last meters together, so that one room of many that look alike is told from the
    others. Until it is plain where a robot is that was told nothing, its particles lie at all places that fit; a robot
    that was told a place is moved only by what is plainly better.
    """

    def __init__(self, search: GlobalSearch, trust: MapTrust, told: Estimate, settling: float) -> None:
        """What was `told` counts for the first `settling` m, turns included."""
        self._search, self._trust, self._memory = search, trust, ScanMemory()
        self._known, self._told, self._settling = told.pose is not None, told, settling
        self._begun: PosePrior | None = None
        self._sure: PosePrior | None = None
        self._fits: deque[float] = deque(maxlen=RECENT)
        self._way, self._wait, self._driven, self._unchecked, self._doubted = 0.0, 0.0, 0.0, 0.0, False
        self._last: Pose2 | None = None
        self._suspected: tuple[Pose2, Pose2] | None = None
        self._since, self._astray, self._continuous = 0.0, 0, False

    def places(
        self, scan: Scan, base: Pose2, believed: Pose2, limits: tuple[float, float], way: ObservedMotion = UNSEEN,
        fit: float | None = None,
    ) -> tuple[Array, Array] | None:  # fmt: skip
        """Poses (k, 3) where the robot may be and the share of each (k,); None to leave it where it is believed to be.

        `base` is where it was when it took the scan, in a frame that drifts; `limits` are the ranges that count, and
        `way` is how it came there since the last scan. `fit` is the share of the beams that fit where it is believed to
        be, if anyone knows.
        """
        ends = self.passed(scan, base, limits, way)
        if not len(ends):
            return None
        here = np.array([believed])
        if (
            self._begun is not None
            and self._way < self._settling
            and (settled := self._as_told(self._begun, base, here)) is not None
        ):
            return settled
        if fit is None:
            fit = self._trust.fit(here, ends, TELLING)
        if fit is not None:
            self._fits.append(fit)
        self._astray = self._astray + 1 if fit is None else 0
        if self._known and (near := self._nearby(base, here)) is not None:
            return near
        if self._known and not (self._in_doubt() or self._astray >= ASTRAY):
            return None
        if self._driven < self._wait:
            return None
        return self._sought(self._memory.about(base), base, here)

    def passed(self, scan: Scan, base: Pose2, limits: tuple[float, float], way: ObservedMotion) -> Plane:
        """Remember a scan, and ask nothing; where it ended, about the base. As `places` otherwise."""
        self._moved(base, way)
        return self._memory.add(scan, base, *limits)

    def _moved(self, base: Pose2, way: ObservedMotion) -> None:
        """Carry on what is known of where the robot is; nothing is when it no longer sees what it saw."""
        last, self._last = self._last, base
        if last is None:
            if self._told.pose is not None:
                std = np.maximum(self._told.std, AROUND)
                self._begun = self._sure = PosePrior.at(np.array(self._told.pose), base, std)
            return
        self._continuous = way.parted is not None
        moved = travelled(last, base)
        self._driven += moved
        self._unchecked += moved
        self._way += moved
        self._since += moved
        if way.parted or way.led:
            self._memory.forget(0)
        if way.parted:
            self._begun = self._sure = None
        self._begun = self._begun and self._begun.after(last, base, moved, way)
        self._sure = self._sure and self._sure.after(last, base, moved, way)

    def _as_told(self, begun: PosePrior, base: Pose2, here: Array) -> tuple[Array, Array] | None:
        """Where the robot is by what it was told and all that it saw since, where particles settled elsewhere.

        A scan of a room whose furniture was moved fits another place of it, and the next scans, which show the same,
        confirm that. Seen together, and with the ways to what was seen, which must be free, they often do not. Where
        the map shows little of it, and is soon fitted by chance, the told place is asked alone.
        """
        if not self._memory.length:
            return None
        view, expected = self._memory.about(base), begun.expected(base)[None]
        if not len(view.ends) or (fit := self._search.fit(here, view))[0] > FITS:
            return None
        shown = self._trust.fit(expected, view.ends, TELLING) is not None
        poses, fits = self._search.near(view, expected[0]) if shown else (expected, self._search.fit(expected, view))
        likely = fits / SHARPNESS - begun.unlikely(poses, base)
        own = fit[0] / SHARPNESS - begun.unlikely(here, base)[0]
        best = int(likely.argmax())
        off = errors_about(here[0], poses[best : best + 1])[0]
        if likely[best] - own < LIKELIER or (math.hypot(off[0], off[1]) < APART[0] and abs(off[2]) < APART[1]):
            return None
        self._fits.clear()
        return poses[best : best + 1], np.ones(1)

    def _nearby(self, base: Pose2, here: Array) -> tuple[Array, Array] | None:
        """Where the robot is that is only somewhat off: it was told so, or drifted where there was no map."""
        if min(self._unchecked, self._memory.length) < CHECKED:
            return None
        self._unchecked, view = 0.0, self._memory.about(base)
        if not len(view.ends) or self._trust.fit(here, view.ends, TELLING) is None:
            return None
        fit = float(self._reached(here, self._search.fit(here, view), base)[0])
        if fit > FITS:
            self._sure = PosePrior.at(here[0], base)
            return None
        poses, fits = self._search.near(view, here[0])
        fits = self._reached(poses, fits, base)
        order = np.argsort(-fits, kind="stable")
        poses, fits = poses[order], fits[order]
        plain = len(fits) == 1 or fits[0] - fits[1] > PLAIN
        better = NEAR_BETTER if fits[0] > FITS else BETTER
        if not plain or fits[0] < max(NEAR_GOOD, fit + better):
            return None
        return self._found(poses[:1], base)

    def _reached(self, poses: Array, fits: Array, base: Pose2) -> Array:
        """How well `poses` (n, 3) fit, less what it takes to have drifted there."""
        if self._sure is None:
            return fits
        return fits - np.minimum(SHARPNESS * self._sure.unlikely(poses, base), UNREACHED)

    def _found(self, places: Array, base: Pose2) -> tuple[Array, Array]:
        """The one of `places` (1, 3) with all particles."""
        self._fits.clear()
        self._sure = PosePrior.at(places[0], base)
        return places, np.ones(1)

    def _in_doubt(self) -> bool:
        """Whether recent scans do not fit. When that begins, what was seen before may be of another place."""
        before, self._doubted = self._doubted, len(self._fits) == RECENT and sum(self._fits) < RECENT * DOUBTFUL
        if self._doubted and not before:
            if not self._continuous:
                self._memory.forget(1)
            self._wait = 0.0
        return self._doubted

    @property
    def _strayed(self) -> bool:
        """Whether it is where the map shows nothing, and went there: who was carried off may be anywhere."""
        return self._astray >= ASTRAY and self._sure is not None

    def _sought(self, view: View, base: Pose2, here: Array) -> tuple[Array, Array] | None:
        poses, fits = self._search.places(view)
        waited, self._wait, self._driven = self._wait, BETWEEN, 0.0
        if not len(poses):
            return None
        good, clear = (BACK_GOOD, BACK_PLAIN) if self._strayed else (GOOD, PLAIN)
        if self._known:
            order = np.argsort(-(fits := self._reached(poses, fits, base)), kind="stable")
            poses, fits = poses[order], fits[order]
        plain = len(fits) == 1 or fits[0] - fits[1] > clear
        if not self._known:
            self._known = plain and self._memory.length >= ENOUGH
            if self._known:
                self._sure = PosePrior.at(poses[0], base)
            shares = np.exp((fits - fits[0]) / SHARPNESS)
            return poses, shares / shares.sum()
        if plain and fits[0] > good and fits[0] > self._reached(here, self._search.fit(here, view), base)[0] + BETTER:
            found = Pose2(*poses[0].tolist())
            if self._suspected is None or not _agree(*self._suspected, found, base):
                self._suspected, self._since = (found, base), 0.0
            elif self._since >= AGREED:
                self._suspected = None
                self._astray = 0
                return self._found(poses[:1], base)
        else:
            more = MOST_BETWEEN if self._strayed else 2 * max(waited, BETWEEN)
            self._suspected, self._wait = None, min(MOST_BETWEEN, more)
        return None


def _agree(first: Pose2, then: Pose2, second: Pose2, now: Pose2) -> bool:
    """Whether a robot that was `first` when its base was at `then` is `second` when it is at `now`."""
    off = first.compose(then.between(now)).between(second)
    return math.hypot(off.x, off.y) < AGREE[0] and abs(off.yaw) < AGREE[1]


def around(poses: Array, shares: Array, count: int, rng: np.random.Generator) -> Array:
    """Particles (count, 3) about `poses` (k, 3), each with its share."""
    chosen = rng.choice(len(poses), count, p=shares)
    drawn: Array = poses[chosen] + rng.normal(0.0, AROUND, (count, 3))
    drawn[:, 2] = wrap_array(drawn[:, 2])
    return drawn
