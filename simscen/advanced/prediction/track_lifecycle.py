"""Life cycle of tracks: when a track counts as moving, and when it ends."""

import math
from collections.abc import Callable

from simscen.advanced.prediction.clusters import BOTH
from simscen.advanced.prediction.track import LATELY, Track
from simscen.model.guards import Prediction

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
