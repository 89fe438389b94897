"""Tracks of obstacles as Kalman filters with constant velocity, and rules that decide which tracks move, stand, or end.

The acceleration is white and constant within a step (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2). Because noise
and measurements are isotropic, position and velocity are complex numbers, and three values replace the covariance
(4, 4).
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from simscen.advanced.prediction.clusters import BOTH_EDGES
from simscen.model.costmaps import Prediction


@dataclass(slots=True)
class ConstantVelocityFilter:
    """Position (m) and velocity (m/s) of a point as x + iy, with their variances and covariance along any axis."""

    position: complex
    velocity: complex
    variance: float
    covariance: float
    velocity_variance: float

    def predict(self, seconds: float, acceleration: float) -> None:
        """Predict the state after `seconds`. `acceleration` is a standard deviation in m/s² along each axis."""
        noise, drift = (acceleration * seconds) ** 2, self.velocity_variance * seconds
        self.position += self.velocity * seconds
        self.variance += seconds * (2.0 * self.covariance + drift) + 0.25 * seconds * seconds * noise
        self.covariance += drift + 0.5 * seconds * noise
        self.velocity_variance += noise

    def correct(self, measured: complex, std: float) -> None:
        """Correct the state with a measured position (x + iy) and its standard deviation in m along each axis."""
        innovation, noise = measured - self.position, std * std
        remaining, gain = noise / (self.variance + noise), self.covariance / (self.variance + noise)
        self.position, self.velocity = measured - remaining * innovation, self.velocity + gain * innovation
        self.velocity_variance -= gain * self.covariance
        self.variance *= remaining
        self.covariance *= remaining


MAX_UPDATES = 10
"""Number of last updates that a track stores."""
INITIAL_SPEED_STD_M_S = 1.5
"""Standard deviation of the initial velocity."""


class Update(NamedTuple):
    """Update of a track with a cluster of hits.

    position:      position of the track after the update, as x + iy in m
    std:           standard deviation in m of the position along any axis
    appeared:      whether enough hits are in formerly free space, through which beams of an earlier scan passed
    was_occupied:  whether most hits are where the earlier scan also hit something; possible together with `appeared`
    edges:         number of visible edges of the cluster
    """

    tick: int
    position: complex
    std: float
    appeared: bool
    was_occupied: bool
    edges: int


@dataclass(slots=True)
class Track(ConstantVelocityFilter):
    """Tracked obstacle with its radius in m, its first position (x + iy), and its last updates.

    `last_fast_tick` is the last tick at which the track was faster than the minimum speed of moving obstacles.
    """

    radius: float
    start_position: complex
    last_fast_tick: int
    updates: deque[Update] = field(default_factory=lambda: deque(maxlen=MAX_UPDATES))
    is_moving: bool = False
    """Whether the obstacle is moving now."""
    has_moved: bool = False
    """Whether the obstacle has ever been moving."""
    updates_outside_free_space: int = 0
    """Number of consecutive updates, up to the newest, without `appeared`."""
    static_updates: int = 0
    """Number of consecutive updates, up to the newest, with `was_occupied` and without `appeared`."""

    @classmethod
    def start(cls, tick: int, position: complex, std: float, radius: float) -> "Track":
        """Start a track at a position (x + iy) with a standard deviation in m, and with unknown velocity."""
        return cls(position, 0j, std * std, 0.0, INITIAL_SPEED_STD_M_S**2, radius, position, tick)

    @property
    def last_update_tick(self) -> int:
        """Tick of the last update."""
        return self.updates[-1].tick

    def record_update(self, tick: int, appeared: bool, was_occupied: bool, edges: int, std: float) -> None:
        """Record an update at the current position, with its standard deviation in m."""
        self.updates.append(Update(tick, self.position, std, appeared, was_occupied, edges))
        self.updates_outside_free_space = 0 if appeared else self.updates_outside_free_space + 1
        self.static_updates = self.static_updates + 1 if was_occupied and not appeared else 0

    @property
    def position_std(self) -> float:
        """Standard deviation in m of the position along any axis."""
        return math.sqrt(self.variance)

    @property
    def speed_std(self) -> float:
        """Standard deviation in m/s of the velocity along any axis."""
        return math.sqrt(self.velocity_variance)


MIN_SIGNIFICANCE = 3.0
"""Minimum speed or displacement, in standard deviations, before a track counts as moving."""
MIN_TRAVEL_M = 0.15
"""Minimum distance from its oldest stored position before a track counts as moving."""
MIN_UPDATES, MIN_FREE_SHARE = 3, 0.6
"""Minimum number and share of the stored updates in formerly free space before a track counts as moving. False tracks
along a row of posts have less."""
VISIBLE_TIMEOUT_S = 0.35
"""Time without an update after which a moving track ends if its position is visible."""
HIDDEN_TIMEOUT_S = 2.5
"""Time without an update after which a moving track ends even if its position is hidden."""
STANDING_TIMEOUT_S = 0.8
"""Time without an update after which a track that is not moving ends."""
MAX_POSITION_STD_M = 1.2
"""Standard deviation of the position above which a track ends."""
MAX_SPEED_M_S = 4.0
"""Speed above which a track ends, because it has changed from one obstacle to another."""
OCCLUDED_MIN_VISIBLE_UPDATES = 5
"""The OCCLUDED constants are conditions for a moving track if another moving obstacle may have hidden the formerly free
space. This constant is the minimum number of updates with a completely visible cluster."""
OCCLUDED_MIN_TRAVEL_M = 0.4
"""Minimum distance from the oldest stored position."""
OCCLUDED_SPEED_RATIO = 1.6
"""Minimum speed relative to `min_speed`, the minimum speed of moving obstacles."""
OCCLUDED_MAX_OCCUPIED_SHARE = 0.2
"""Maximum share of the stored updates with `was_occupied`."""
FAR_TRAVEL_M = 0.5
"""A partly hidden track counts as moving after traveling twice the largest radius plus this distance. The visible part
of a wall at the edge of the field of view grows by less."""
MAX_UPDATES_OUTSIDE_FREE_SPACE = 5
"""Number of consecutive updates without `appeared` after which a track that has not moved ends."""
STANDING_AFTER_S = 1.5
"""Time below the minimum speed after which a moving track counts as standing."""
NEVER_MOVED_TIMEOUT_S = 0.5
"""Time below the minimum speed after which a track that has never moved ends."""
MOVED_TIMEOUT_S = 10.0
"""Time below the minimum speed after which a standing track that has moved before ends."""


class TrackLifecycle:
    """Decides after each scan which tracks are moving, and which have ended."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate

    def update_motion(self, track: Track, tick: int, tracks: list[Track], has_left: Callable[[Track], bool]) -> None:
        """Update `is_moving` and `has_moved` of a track, after the scan of a tick.

        `has_left(track)` returns whether the obstacle has left its earlier positions.
        """
        min_speed, speed = self._spec.min_speed, abs(track.velocity)
        if speed > min_speed:
            track.last_fast_tick = tick
        if track.is_moving:
            track.is_moving = (tick - track.last_fast_tick) / self._rate <= STANDING_AFTER_S
        elif speed <= min_speed:
            return
        elif track.has_moved and speed > track.speed_std and track.last_update_tick == tick:
            track.is_moving = not track.updates[
                -1
            ].was_occupied  # the obstacle may return over positions that it has just left
        elif self._is_surely_moving(track, tick, speed, tracks) and has_left(track):
            track.is_moving = track.has_moved = True

    def has_ended(self, track: Track, tick: int, tracks: list[Track], sees_past: Callable[[Track], bool]) -> bool:
        """Return whether a track has ended. `sees_past(track)` returns whether the track's position is visible."""
        unseen_s = (tick - track.last_update_tick) / self._rate
        if abs(track.velocity) >= MAX_SPEED_M_S or track.position_std > MAX_POSITION_STD_M:
            return True
        if track.is_moving:
            return unseen_s > VISIBLE_TIMEOUT_S and (unseen_s > HIDDEN_TIMEOUT_S or sees_past(track))
        timeout = MOVED_TIMEOUT_S if track.has_moved else NEVER_MOVED_TIMEOUT_S
        is_at_rest = (tick - track.last_fast_tick) / self._rate > timeout
        return (
            is_at_rest
            or unseen_s > STANDING_TIMEOUT_S
            or (not track.has_moved and (track.static_updates >= MIN_UPDATES or _is_sliding(track, tracks)))
        )

    def _is_surely_moving(self, track: Track, tick: int, speed: float, tracks: list[Track]) -> bool:
        """Return whether the speed is neither noise nor caused by a static obstacle that comes into view."""
        min_speed, updates, first = self._spec.min_speed, track.updates, track.updates[0]
        displacement = track.position - first.position
        if (displacement.conjugate() * track.velocity).real <= 0.0:
            return False
        distance, seconds = abs(displacement), (tick - first.tick) / self._rate
        is_significant = speed > MIN_SIGNIFICANCE * track.speed_std
        # Both ends of the recent path have errors, and more of a partly visible obstacle may come into view.
        has_traveled = distance > max(min_speed * seconds, MIN_SIGNIFICANCE * math.hypot(first.std, track.position_std))
        if not (is_significant or has_traveled):
            return False
        fully_visible_count = sum(each.edges == BOTH_EDGES for each in updates)
        min_appeared = max(MIN_UPDATES, MIN_FREE_SHARE * len(updates))
        if (is_significant or 2 * fully_visible_count > len(updates)) and sum(
            each.appeared for each in updates
        ) >= min_appeared:
            return distance > MIN_TRAVEL_M and updates[-1].appeared
        # Otherwise, a track counts as moving only while another obstacle moves, which may have hidden the free space.
        if not is_significant or speed < OCCLUDED_SPEED_RATIO * min_speed or not any(each.is_moving for each in tracks):
            return False
        if sum(each.was_occupied for each in updates) > OCCLUDED_MAX_OCCUPIED_SHARE * len(updates):
            return False
        is_far = abs(track.position - track.start_position) > 2 * self._spec.max_radius + FAR_TRAVEL_M
        if (
            is_far
            and len(updates) == MAX_UPDATES
            and sum(each.edges > 0 for each in updates) >= MIN_FREE_SHARE * MAX_UPDATES
        ):
            return True
        return fully_visible_count >= OCCLUDED_MIN_VISIBLE_UPDATES and distance > OCCLUDED_MIN_TRAVEL_M


def _is_sliding(track: Track, tracks: list[Track]) -> bool:
    """Return whether a track only seems to move, because different parts of a wall become visible."""
    return track.updates_outside_free_space >= MAX_UPDATES_OUTSIDE_FREE_SPACE and not any(
        each.is_moving for each in tracks
    )
