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

from simscen.advanced.prediction.clusters import BOTH_EDGES
from simscen.model.guards import Prediction


@dataclass(slots=True)
class ConstantVelocityFilter:
    """Position (m) and velocity (m/s) of a point as x + iy, with variances and covariance along any axis."""

    position: complex
    velocity: complex
    variance: float
    covariance: float
    velocity_variance: float

    def predict(self, seconds: float, acceleration: float) -> None:
        """Predict the state after `seconds`; `acceleration` is the standard deviation in m/s² along each axis."""
        noise, drift = (acceleration * seconds) ** 2, self.velocity_variance * seconds
        self.position += self.velocity * seconds
        self.variance += seconds * (2.0 * self.covariance + drift) + 0.25 * seconds * seconds * noise
        self.covariance += drift + 0.5 * seconds * noise
        self.velocity_variance += noise

    def correct(self, measured: complex, std: float) -> None:
        """Correct the state with a measured position, with its standard deviation in m along each axis."""
        innovation, noise = measured - self.position, std * std
        remaining, gain = noise / (self.variance + noise), self.covariance / (self.variance + noise)
        self.position, self.velocity = measured - remaining * innovation, self.velocity + gain * innovation
        self.velocity_variance -= gain * self.covariance
        self.variance *= remaining
        self.covariance *= remaining


MAX_UPDATES = 10
"""Number of last updates that a track stores."""
INITIAL_SPEED_STD = 1.5
"""Standard deviation in m/s of the initial velocity."""


class Update(NamedTuple):
    """Update of a track: whether it was in formerly free space, and whether earlier scans hit something there.

    `std` is the standard deviation in m of the position along any axis; `edges` is the number of visible edges.
    """

    tick: int
    position: complex
    std: float
    appeared: bool
    was_occupied: bool
    edges: int


@dataclass(slots=True)
class Track(ConstantVelocityFilter):
    """State of a track with its `radius` in m, its first position, and its last updates."""

    radius: float
    start_position: complex
    last_fast_tick: int
    updates: deque[Update] = field(default_factory=lambda: deque(maxlen=MAX_UPDATES))
    is_moving: bool = False
    has_moved: bool = False
    not_appeared: int = 0
    """Number of last updates that were not in formerly free space."""
    static_updates: int = 0
    """Number of last updates where something had been hit before."""

    @classmethod
    def start(cls, tick: int, position: complex, std: float, radius: float) -> "Track":
        """Start a track at a position with a standard deviation in m, and with unknown velocity."""
        return cls(position, 0j, std * std, 0.0, INITIAL_SPEED_STD**2, radius, position, tick)

    @property
    def last_update_tick(self) -> int:
        """Tick of the last update."""
        return self.updates[-1].tick

    def record_update(self, tick: int, appeared: bool, was_occupied: bool, edges: int, std: float) -> None:
        """Record an update with the standard deviation in m of the position."""
        self.updates.append(Update(tick, self.position, std, appeared, was_occupied, edges))
        self.not_appeared = 0 if appeared else self.not_appeared + 1
        self.static_updates = self.static_updates + 1 if was_occupied and not appeared else 0

    @property
    def position_std(self) -> float:
        """Standard deviation in m of the position along any axis."""
        return math.sqrt(self.variance)

    @property
    def speed_std(self) -> float:
        """Standard deviation in m/s of the velocity along any axis."""
        return math.sqrt(self.velocity_variance)


MIN_SIGNIFICANCE, MIN_TRAVEL_M, MIN_UPDATES = 3.0, 0.15, 3
"""A track moves if its speed is significant (in standard deviations), it has traveled this distance in m, and this
many of its last updates were in formerly free space."""
VISIBLE_TIMEOUT_S, HIDDEN_TIMEOUT_S, NOT_MOVING_TIMEOUT_S = 0.35, 2.5, 0.8
"""Times in s without a hit after which a track ends: if its position is visible, if it is hidden, and if it was not
moving."""
MAX_POSITION_STD_M = 1.2
"""Standard deviation in m of the position above which a track ends."""
MAX_SPEED = 4.0
"""Speed in m/s above which a track is wrong, because it has changed from one obstacle to another."""
NEARBY_MIN_VISIBLE, NEARBY_MIN_TRAVEL_M, NEARBY_SPEED_RATIO = 5, 0.4, 1.6
"""A track that started near another moving obstacle must be completely visible this often, travel this distance in m,
and exceed the minimum speed by this factor."""
NEARBY_MAX_OCCUPIED_SHARE = 0.2
"""Maximum share of the last updates of such a track where something was hit before."""
MIN_FREE_SHARE = 0.6
"""Minimum share of the last updates of a moving track in formerly free space. False tracks along a row of posts have
less."""
FAR_TRAVEL_M = 0.5
"""Distance in m beyond twice the largest radius after which a track moves although its origin was never visible. The
visible part of a wall at the edge of the field of view grows by less."""
MAX_NOT_APPEARED = 5
"""Number of updates outside formerly free space after which a track that has not moved ends."""
NEVER_MOVED_TIMEOUT_S, STANDING_AFTER_S, MOVED_TIMEOUT_S = 0.5, 1.5, 10.0
"""Times in s of standing after which a track that has never moved ends, a moving track counts as standing, and a track
that has moved ends."""


class TrackLifecycle:
    """Decides about the state of tracks after each scan."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        """Take the parameters and the tick rate in Hz."""
        self._spec, self._rate = spec, tick_rate

    def update_motion(self, track: Track, tick: int, tracks: list[Track], has_left: Callable[[Track], bool]) -> None:
        """Update whether a track moves, after the scan of a tick. `has_left` checks its old positions."""
        min_speed, speed = self._spec.min_speed, abs(track.velocity)
        if speed > min_speed:
            track.last_fast_tick = tick
        if track.is_moving:
            track.is_moving = (tick - track.last_fast_tick) / self._rate <= STANDING_AFTER_S
        elif speed <= min_speed:
            return
        elif track.has_moved and speed > track.speed_std and track.last_update_tick == tick:
            track.is_moving = not track.updates[-1].was_occupied  # it may return over positions that it has just left
        else:
            track.is_moving = track.has_moved = self._is_moving(track, tick, speed, tracks) and has_left(track)

    def has_ended(self, track: Track, tick: int, tracks: list[Track], visible: Callable[[Track], bool]) -> bool:
        """Return whether a track has ended; `visible` returns whether the lidar sees past its position."""
        unseen_s = (tick - track.last_update_tick) / self._rate
        if abs(track.velocity) >= MAX_SPEED or track.position_std > MAX_POSITION_STD_M:
            return True
        if track.is_moving:
            return unseen_s > VISIBLE_TIMEOUT_S and (unseen_s > HIDDEN_TIMEOUT_S or visible(track))
        timeout = MOVED_TIMEOUT_S if track.has_moved else NEVER_MOVED_TIMEOUT_S
        is_at_rest = (tick - track.last_fast_tick) / self._rate > timeout
        return (
            is_at_rest
            or unseen_s > NOT_MOVING_TIMEOUT_S
            or (not track.has_moved and (track.static_updates >= MIN_UPDATES or _is_sliding(track, tracks)))
        )

    def _is_moving(self, track: Track, tick: int, speed: float, tracks: list[Track]) -> bool:
        """Return whether the speed is neither noise nor caused by a static obstacle that comes into view."""
        min_speed, updates, first = self._spec.min_speed, track.updates, track.updates[0]
        displacement = track.position - first.position
        if (displacement.conjugate() * track.velocity).real <= 0.0:
            return False
        distance, seconds = abs(displacement), (tick - first.tick) / self._rate
        significant = speed > MIN_SIGNIFICANCE * track.speed_std
        # Both ends of the recent path have errors, and more of a partly visible obstacle may come into view.
        has_traveled = distance > max(min_speed * seconds, MIN_SIGNIFICANCE * math.hypot(first.std, track.position_std))
        if not (significant or has_traveled):
            return False
        fully_visible = sum(each.edges == BOTH_EDGES for each in updates)
        min_appeared = max(MIN_UPDATES, MIN_FREE_SHARE * len(updates))
        if (significant or 2 * fully_visible > len(updates)) and sum(each.appeared for each in updates) >= min_appeared:
            return distance > MIN_TRAVEL_M and updates[-1].appeared
        # Otherwise only near another moving obstacle, which may have hidden the free space.
        if not significant or speed < NEARBY_SPEED_RATIO * min_speed or not any(each.is_moving for each in tracks):
            return False
        if sum(each.was_occupied for each in updates) > NEARBY_MAX_OCCUPIED_SHARE * len(updates):
            return False
        is_far = abs(track.position - track.start_position) > 2 * self._spec.max_radius + FAR_TRAVEL_M
        if (
            is_far
            and len(updates) == MAX_UPDATES
            and sum(each.edges > 0 for each in updates) >= MIN_FREE_SHARE * MAX_UPDATES
        ):
            return True
        return fully_visible >= NEARBY_MIN_VISIBLE and distance > NEARBY_MIN_TRAVEL_M


def _is_sliding(track: Track, tracks: list[Track]) -> bool:
    """Return whether the last updates of a track were outside formerly free space, while nothing moves.

    Such a track is a wall of which different parts become visible. A real moving obstacle starts a new track.
    """
    return track.not_appeared >= MAX_NOT_APPEARED and not any(each.is_moving for each in tracks)
