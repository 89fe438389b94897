"""Which tracks move, and which have ended."""

import math
from collections.abc import Callable

from simscen.model.guards import Prediction
from simscen.stack.prediction.clusters import BOTH
from simscen.stack.prediction.tracks import LATELY, Track, Tracks

SURE, TRAVELLED, HITS = 3.0, 0.15, 3
"""A track moves when its speed is so many standard deviations, now or over its last updates, and it has come so far in
m in these, and in so many of them stood where it had been free."""
ENDS_UNSEEN, ENDS_HIDDEN, ENDS_UNSURE = 0.35, 2.5, 0.8
"""Seconds without a hit after which a track ends: where the lidar sees through; where it cannot see; and for one that
was not moving. All end when their place is known worse than this many metres."""
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
"""Metres beyond twice the largest radius: what has gone so far moves, though no beam was ever where it came from. What
is seen of a wall, at the end of the field of view, grows by less."""
UNCOME = 5
"""Updates without standing where it had been free, after which what nobody has seen move is followed no more."""
RESTED, STOOD, REMEMBERED = 0.5, 1.5, 10.0
"""Seconds for which something stands until it is no longer followed, if it has not moved; until what moved is a thing
like any other, for who turns round stands a moment, too; and until nobody expects any more that it may set off again.
"""


def _slides(tracks: Tracks, track: Track) -> bool:
    """Whether it has not once stood where it had been free, for some updates, and nothing at all moves.

    So does a wall of which the robot sees another part at each moment. What does move begins anew when it comes.
    """
    if track.moved or len(track.lately) < UNCOME or any(each.came for each in list(track.lately)[-UNCOME:]):
        return False
    return not any(each.moving for each in tracks.known)


class Going:
    """Looks at tracks after each scan."""

    def __init__(self, spec: Prediction, tick_rate: int) -> None:
        self._spec, self._rate = spec, tick_rate

    def settle(self, tracks: Tracks, number: int) -> None:
        """Note whether a track moves."""
        track, least = tracks.known[number], self._spec.min_speed
        vx, vy = tracks.states[number, 2:].tolist()
        speed, noise = math.hypot(vx, vy), tracks.speed_deviation(number)
        if speed > least:
            track.fast_at = tracks.tick
        if track.moving:
            track.moving = (tracks.tick - track.fast_at) / self._rate <= STOOD
        elif track.moved and speed > max(least, noise) and track.hit_at == tracks.tick:
            track.moving = not track.lately[-1].stood  # it comes back over ground where it has just been
        elif speed > least:
            track.moving = track.moved = self._goes(tracks, number, speed, noise)

    def ended(self, tracks: Tracks, number: int, visible: Callable[[int], bool]) -> bool:
        """Whether a track is followed no more; `visible` says whether the lidar sees past its place."""
        track = tracks.known[number]
        unseen = (tracks.tick - track.hit_at) / self._rate
        rests = REMEMBERED if track.moved else RESTED
        rested = not track.moving and (tracks.tick - track.fast_at) / self._rate > rests
        impossible = math.hypot(*tracks.states[number, 2:].tolist()) >= FASTEST
        if impossible or rested or _slides(tracks, track) or tracks.place_deviation(number) > UNSURE_PLACE:
            return True
        if unseen == 0.0 or not track.moving:
            return unseen > ENDS_UNSURE
        return unseen > (ENDS_UNSEEN if visible(number) else ENDS_HIDDEN)

    def _goes(self, tracks: Tracks, number: int, speed: float, noise: float) -> bool:
        """Whether what is that fast is not only noise, nor something that stands and of which more comes into view."""
        track, least = tracks.known[number], self._spec.min_speed
        x, y, vx, vy = tracks.states[number].tolist()
        lately, first = track.lately, track.lately[0]
        dx, dy = x - first.x, y - first.y
        way, seconds = math.hypot(dx, dy), (tracks.tick - first.tick) / self._rate
        if dx * vx + dy * vy <= 0.0:
            return False
        whole = sum(each.edges == BOTH for each in lately)
        sure = speed > SURE * noise
        # Over the last updates, both ends may be off; and of what is half seen, more may come into view.
        unsure = SURE * math.sqrt(2.0) * tracks.place_deviation(number)
        went = way > max(least * seconds, unsure) and 2 * whole > len(lately)
        if (sure or went) and sum(each.came for each in lately) >= max(HITS, MOSTLY * len(lately)):
            return way > TRAVELLED
        # Without that, only beside something else that moves: it may have hidden the place.
        if not sure or speed < TWICE * least or not any(each.moving for each in tracks.known):
            return False
        if sum(each.stood for each in lately) > STOOD_OFTEN * len(lately):
            return False
        far = math.dist((x, y), track.born.tolist()) > 2 * self._spec.max_radius + FAR
        if far and len(lately) == LATELY and sum(each.edges > 0 for each in lately) >= MOSTLY * LATELY:
            return True
        return whole >= SEEN_WHOLE and way > FARTHER
