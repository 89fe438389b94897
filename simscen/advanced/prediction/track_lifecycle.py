"""Which tracks move, and which have ended."""

import math
from collections.abc import Callable

from simscen.advanced.prediction.clusters import BOTH
from simscen.advanced.prediction.track import LATELY, Track
from simscen.model.guards import Prediction

SURE, TRAVELLED, HITS = 3.0, 0.15, 3
"""A track moves when its speed is so many standard deviations, now or over its last updates, and it has come so far in
m in these, and in so many of them stood where it had been free."""
ENDS_UNSEEN, ENDS_HIDDEN, ENDS_UNSURE = 0.35, 2.5, 0.8
"""Seconds without a hit after which a track ends: where the lidar sees through; where it cannot see; and for one that
was not moving. All end when their place is known worse than this many meters."""
UNSURE_PLACE = 1.2
FASTEST = 4.0
"""m/s: nothing indoors is faster; a track that is has gone from one thing to another."""
SEEN_WHOLE, FARTHER, TWICE = 5, 0.4, 1.6
"""One that began beside something that moves has to be seen whole so often, to go so far in m, and to be so many times
as fast as what moves at the least."""
STOOD_OFTEN = 0.2
"""Share of the last updates that a track which began so may stand."""
MOSTLY = 0.6
"""Share of the last updates of a track that moves in which it stands where it had been free; what hops along a row of
posts does not."""
FAR = 0.5
"""Meters beyond twice the largest radius: what has gone so far moves, though no beam was ever where it came from. What
is seen of a wall, at the end of the field of view, grows by less."""
UNCOME = 5
"""Updates without standing where it had been free, after which what nobody has seen move is followed no more."""
RESTED, STOOD, REMEMBERED = 0.5, 1.5, 10.0
"""Seconds for which something stands until it is no longer followed, if it has not moved; until what moved is a thing
like any other, for who turns round stands a moment, too; and until nobody expects any more that it may set off again.
"""


class TrackLifecycle:
    """Looks at tracks after each scan."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate

    def settle(self, track: Track, tick: int, tracks: list[Track], left: Callable[[Track], bool]) -> None:
        """Note whether a track moves, by the scan of a tick; `tracks` are all.

        `left` says whether nothing still stands where it was.
        """
        least, speed = self._spec.min_speed, abs(track.velocity)
        if speed > least:
            track.fast_at = tick
        if track.moving:
            track.moving = (tick - track.fast_at) / self._rate <= STOOD
        elif speed <= least:
            return
        elif track.moved and speed > track.speed_deviation and track.hit_at == tick:
            track.moving = not track.lately[-1].stood  # it comes back over ground where it has just been
        else:
            track.moving = track.moved = self._goes(track, tick, speed, tracks) and left(track)

    def ended(self, track: Track, tick: int, tracks: list[Track], visible: Callable[[Track], bool]) -> bool:
        """Whether a track is followed no more; `visible` says whether the lidar sees past its place."""
        unseen = (tick - track.hit_at) / self._rate
        if abs(track.velocity) >= FASTEST or track.place_deviation > UNSURE_PLACE:
            return True
        if track.moving:
            return unseen > ENDS_UNSEEN and (unseen > ENDS_HIDDEN or visible(track))
        rested = (tick - track.fast_at) / self._rate > (REMEMBERED if track.moved else RESTED)
        return rested or unseen > ENDS_UNSURE or (not track.moved and (track.stands >= HITS or _slides(track, tracks)))

    def _goes(self, track: Track, tick: int, speed: float, tracks: list[Track]) -> bool:
        """Whether what is that fast is not only noise, nor something that stands and of which more comes into view."""
        least, lately, first = self._spec.min_speed, track.lately, track.lately[0]
        come = track.place - first.place
        if (come.conjugate() * track.velocity).real <= 0.0:
            return False
        way, seconds, sure = abs(come), (tick - first.tick) / self._rate, speed > SURE * track.speed_deviation
        # Over the last updates, both ends may be off; and of what is half seen, more may come into view.
        went = way > max(least * seconds, SURE * math.hypot(first.deviation, track.place_deviation))
        if not (sure or went):
            return False
        whole = sum(each.edges == BOTH for each in lately)
        if (sure or 2 * whole > len(lately)) and sum(each.came for each in lately) >= max(HITS, MOSTLY * len(lately)):
            return way > TRAVELLED and lately[-1].came
        # Without that, only beside something else that moves: it may have hidden the place.
        if not sure or speed < TWICE * least or not any(each.moving for each in tracks):
            return False
        if sum(each.stood for each in lately) > STOOD_OFTEN * len(lately):
            return False
        far = abs(track.place - track.born) > 2 * self._spec.max_radius + FAR
        if far and len(lately) == LATELY and sum(each.edges > 0 for each in lately) >= MOSTLY * LATELY:
            return True
        return whole >= SEEN_WHOLE and way > FARTHER


def _slides(track: Track, tracks: list[Track]) -> bool:
    """Whether it has not once stood where it had been free, for some updates, and nothing at all moves.

    So does a wall of which the robot sees another part at each moment. What does move begins anew when it comes.
    """
    return track.uncome >= UNCOME and not any(each.moving for each in tracks)
