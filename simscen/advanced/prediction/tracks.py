"""Track of a moving obstacle: a Kalman filter with a constant-velocity model.

The acceleration is white and constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). The results are
those of filterpy's KalmanFilter with Q_discrete_white_noise. Because noise and measurements are isotropic, position and
velocity are complex numbers, and three values replace the covariance (4, 4).
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from simscen.advanced.prediction.clusters import BOTH
from simscen.model.guards import Prediction


@dataclass(slots=True)
class ConstantVelocityFilter:
    """Position (m) and velocity (m/s) of a point as x + iy, with variances and covariance along any axis."""

    place: complex
    velocity: complex
    variance: float
    covariance: float
    velocity_variance: float

    def predict(self, seconds: float, acceleration: float) -> None:
        """Predict the state after `seconds`; `acceleration` is the standard deviation in m/s² along each axis."""
        noise, drift = (acceleration * seconds) ** 2, self.velocity_variance * seconds
        self.place += self.velocity * seconds
        self.variance += seconds * (2.0 * self.covariance + drift) + 0.25 * seconds * seconds * noise
        self.covariance += drift + 0.5 * seconds * noise
        self.velocity_variance += noise

    def correct(self, measured: complex, deviation: float) -> None:
        """Correct the state with a measured position, with its standard deviation in m along each axis."""
        off, noise = measured - self.place, deviation * deviation
        kept, gain = noise / (self.variance + noise), self.covariance / (self.variance + noise)
        self.place, self.velocity = measured - kept * off, self.velocity + gain * off
        self.velocity_variance -= gain * self.covariance
        self.variance *= kept
        self.covariance *= kept


LATELY = 10
"""Number of recent updates that are kept."""
FIRST_SPEED = 1.5
"""Standard deviation in m/s of the initial velocity."""


class Update(NamedTuple):
    """Update of a track: whether it `came` to formerly free space, or `stood` where something was hit before.

    `deviation` is the standard deviation in m of the position along any axis; `edges` is the number of visible edges.
    """

    tick: int
    place: complex
    deviation: float
    came: bool
    stood: bool
    edges: int


@dataclass(slots=True)
class Track(ConstantVelocityFilter):
    """State of a track with its `radius` in m, the position where it was `born`, and its last updates."""

    radius: float
    born: complex
    fast_at: int
    lately: deque[Update] = field(default_factory=lambda: deque(maxlen=LATELY))
    moving: bool = False
    moved: bool = False
    uncome: int = 0
    """Number of last updates that were not in formerly free space."""
    stands: int = 0
    """Number of last updates where something had been hit before."""

    @classmethod
    def begun(cls, tick: int, place: complex, deviation: float, radius: float) -> "Track":
        """Start a track at a position with a standard deviation in m, and with unknown velocity."""
        return cls(place, 0j, deviation * deviation, 0.0, FIRST_SPEED**2, radius, place, tick)

    @property
    def hit_at(self) -> int:
        """Tick of the last update."""
        return self.lately[-1].tick

    def note(self, tick: int, came: bool, stood: bool, edges: int, deviation: float) -> None:
        """Record an update with the standard deviation in m of the position."""
        self.lately.append(Update(tick, self.place, deviation, came, stood, edges))
        self.uncome = 0 if came else self.uncome + 1
        self.stands = self.stands + 1 if stood and not came else 0

    @property
    def place_deviation(self) -> float:
        """Standard deviation in m of the position along any axis."""
        return math.sqrt(self.variance)

    @property
    def speed_deviation(self) -> float:
        """Standard deviation in m/s of the velocity along any axis."""
        return math.sqrt(self.velocity_variance)


SURE, TRAVELLED, HITS = 3.0, 0.15, 3
"""A track moves if its speed is significant (in standard deviations), it has travelled this distance in m, and this
many of its last updates were in formerly free space."""
ENDS_UNSEEN, ENDS_HIDDEN, ENDS_UNSURE = 0.35, 2.5, 0.8
"""Times in s without a hit after which a track ends: if its position is visible, if it is hidden, and if it was not
moving."""
UNSURE_PLACE = 1.2
"""Standard deviation in m of the position above which a track ends."""
FASTEST = 4.0
"""Speed in m/s above which a track is wrong, because it has changed from one obstacle to another."""
SEEN_WHOLE, FARTHER, TWICE = 5, 0.4, 1.6
"""A track that started beside a moving obstacle must be completely visible this often, travel this distance in m, and
exceed the minimum speed by this factor."""
STOOD_OFTEN = 0.2
"""Maximum share of the last updates of such a track where something was hit before."""
MOSTLY = 0.6
"""Minimum share of the last updates of a moving track in formerly free space. False tracks along a row of posts have
less."""
FAR = 0.5
"""Distance in m beyond twice the largest radius after which a track moves although its origin was never visible. The
visible part of a wall at the edge of the field of view grows by less."""
UNCOME = 5
"""Number of updates outside formerly free space after which a track that has not moved ends."""
RESTED, STOOD, REMEMBERED = 0.5, 1.5, 10.0
"""Times in s of standing after which a track that has not moved ends, a moving track counts as standing, and a track
that has moved ends."""


class TrackLifecycle:
    """Decides about the state of tracks after each scan."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        """Take the parameters and the tick rate in Hz."""
        self._spec, self._rate = spec, tick_rate

    def settle(self, track: Track, tick: int, tracks: list[Track], left: Callable[[Track], bool]) -> None:
        """Update whether a track moves, after the scan of a tick. `left` tells whether it left its old positions."""
        least, speed = self._spec.min_speed, abs(track.velocity)
        if speed > least:
            track.fast_at = tick
        if track.moving:
            track.moving = (tick - track.fast_at) / self._rate <= STOOD
        elif speed <= least:
            return
        elif track.moved and speed > track.speed_deviation and track.hit_at == tick:
            track.moving = not track.lately[-1].stood  # it returns over ground where it has just been
        else:
            track.moving = track.moved = self._goes(track, tick, speed, tracks) and left(track)

    def ended(self, track: Track, tick: int, tracks: list[Track], visible: Callable[[Track], bool]) -> bool:
        """Return whether a track has ended; `visible` tells whether the lidar sees past its position."""
        unseen = (tick - track.hit_at) / self._rate
        if abs(track.velocity) >= FASTEST or track.place_deviation > UNSURE_PLACE:
            return True
        if track.moving:
            return unseen > ENDS_UNSEEN and (unseen > ENDS_HIDDEN or visible(track))
        rested = (tick - track.fast_at) / self._rate > (REMEMBERED if track.moved else RESTED)
        return rested or unseen > ENDS_UNSURE or (not track.moved and (track.stands >= HITS or _slides(track, tracks)))

    def _goes(self, track: Track, tick: int, speed: float, tracks: list[Track]) -> bool:
        """Return whether the speed is neither noise nor caused by a static obstacle that comes into view."""
        least, lately, first = self._spec.min_speed, track.lately, track.lately[0]
        come = track.place - first.place
        if (come.conjugate() * track.velocity).real <= 0.0:
            return False
        way, seconds, sure = abs(come), (tick - first.tick) / self._rate, speed > SURE * track.speed_deviation
        # Both ends of the recent path have errors, and more of a partly visible obstacle may come into view.
        went = way > max(least * seconds, SURE * math.hypot(first.deviation, track.place_deviation))
        if not (sure or went):
            return False
        whole = sum(each.edges == BOTH for each in lately)
        if (sure or 2 * whole > len(lately)) and sum(each.came for each in lately) >= max(HITS, MOSTLY * len(lately)):
            return way > TRAVELLED and lately[-1].came
        # Otherwise only beside another moving obstacle, which may have hidden the free space.
        if not sure or speed < TWICE * least or not any(each.moving for each in tracks):
            return False
        if sum(each.stood for each in lately) > STOOD_OFTEN * len(lately):
            return False
        far = abs(track.place - track.born) > 2 * self._spec.max_radius + FAR
        if far and len(lately) == LATELY and sum(each.edges > 0 for each in lately) >= MOSTLY * LATELY:
            return True
        return whole >= SEEN_WHOLE and way > FARTHER


def _slides(track: Track, tracks: list[Track]) -> bool:
    """Return whether a track was never in formerly free space for some updates, while nothing moves.

    This happens with a wall of which different parts are visible over time. A real moving obstacle starts a new track.
    """
    return track.uncome >= UNCOME and not any(each.moving for each in tracks)
