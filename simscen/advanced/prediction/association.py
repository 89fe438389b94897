"""Which piece of a scan continues which track, and which begins one."""

import math

from simscen.advanced.prediction.clusters import BOTH, Piece, Places, fitted
from simscen.advanced.prediction.scan_outline import LidarPose
from simscen.advanced.prediction.track import Track
from simscen.core.decorators import fast_dataclass

NOISE, RELATIVE, HALF_SEEN = 0.02, 0.004, 0.10
"""Standard deviation in m of a measured center: near by, for each meter of range, and more where a piece is hidden."""
FIRST_SEEN = 0.1
"""Meters more of what is seen for the first time."""
GATE, GATE_SIGMAS = 0.25, 3.0
"""Meters, and standard deviations, beyond which a piece is no continuation of a track."""
LEAST_RADIUS = 0.15
"""Meters: of what may begin a track without having come where it was free."""
HALF_RADIUS = 0.3
"""Meters: the least radius of what is half hidden when it is first seen: that of a person."""
RADIUS_GAIN = 0.3
"""How much a new look at a whole piece changes the radius of a track."""


@fast_dataclass(eq=False)
class Seen:
    """A scan at a tick, in pieces of its hits `places` (m,), by a lidar that is at `lidar` in the odom frame.

    Which of them stand where it was free, and which where something was hit before.
    """

    tick: int
    places: Places
    pieces: list[Piece]
    lidar: LidarPose
    came: list[bool]
    stood: list[bool]

    def stands(self, piece: int) -> bool:
        """Whether one stands where it stood before."""
        return self.stood[piece] and not self.came[piece]


def associate(tracks: list[Track], seen: Seen) -> set[int]:
    """Give each track the piece nearest to where it should be, nearest pairs first; the pieces that were given."""
    pieces, lidar = seen.pieces, seen.lidar
    if not tracks or not pieces:
        return set()
    possible: list[tuple[float, int, int]] = []
    for number, track in enumerate(tracks):
        expected, gate = lidar.into(track.place), GATE + GATE_SIGMAS * track.place_deviation
        for piece, (_, _, center, _, edges) in enumerate(pieces):
            # Of what is half hidden, the middle of the visible part may be a radius off.
            far, hidden = abs(expected - center), 0.0 if edges == BOTH else track.radius
            if far <= gate + hidden and (not seen.stands(piece) or _stood(track, center, lidar, hidden)):
                possible.append((far, number, piece))
    possible.sort()
    given: dict[int, int] = {}
    taken: set[int] = set()
    for _, number, piece in possible:
        if number not in given and piece not in taken:
            taken.add(piece)
            given[number] = piece
    if given:
        _update([(tracks[number], piece) for number, piece in given.items()], seen)
    return taken


def _stood(track: Track, center: complex, lidar: LidarPose, hidden: float) -> bool:
    """Whether what stands there is what the track was hit at: nothing hops from one post to the next."""
    return abs(lidar.into(track.lately[-1].place) - center) <= GATE + hidden


def _update(given: list[tuple[Track, int]], seen: Seen) -> None:
    """Tracks are seen as these pieces."""
    lidar = seen.lidar
    for track, number in given:
        first, last, guess, radius, edges = seen.pieces[number]
        if edges == BOTH:
            track.radius += RADIUS_GAIN * (radius - track.radius)
        else:
            guess = lidar.into(track.place)
        center = fitted(seen.places[first : last + 1].tolist(), track.radius, guess)
        hidden = 0.0 if edges == BOTH else HALF_SEEN
        track.correct(lidar.out(center), NOISE + RELATIVE * abs(center) + hidden)
        track.note(seen.tick, seen.came[number], seen.stood[number], edges, track.place_deviation)


def begin(tracks: list[Track], seen: Seen, taken: set[int]) -> None:
    """Tracks of pieces that no track has taken and that stand where it was free."""
    # Among moving things others may, of which a thing that passed hid that they were not there before.
    least = LEAST_RADIUS if any(track.moving for track in tracks) else math.inf
    for number, (_, _, center, radius, edges) in enumerate(seen.pieces):
        came, stood = seen.came[number], seen.stood[number]
        if number in taken or not (came or (radius >= least and not stood)):
            continue
        # Of what is half hidden more may be there than is seen.
        whole, noise = edges == BOTH, NOISE + RELATIVE * abs(center)
        size = radius if whole else max(radius, HALF_RADIUS)
        track = Track.begun(seen.tick, seen.lidar.out(center), noise + FIRST_SEEN, size)
        track.note(seen.tick, came, stood, 0, noise if whole else noise + HALF_SEEN)
        tracks.append(track)
