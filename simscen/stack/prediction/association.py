"""Which piece of a scan continues which track, and which begins one."""

from dataclasses import dataclass

import numpy as np

from simscen.stack.prediction.clusters import BOTH, Clusters, fitted
from simscen.stack.prediction.stance import Stance
from simscen.stack.prediction.tracks import Track

NOISE, RELATIVE, HALF_SEEN = 0.02, 0.004, 0.10
"""Standard deviation in m of a measured centre: near by, for each metre of range, and more where a piece is hidden."""
FIRST_SEEN = 0.1
"""Metres more of what is seen for the first time."""
GATE, GATE_SIGMAS = 0.25, 3.0
"""Metres, and standard deviations, beyond which a piece is no continuation of a track."""
LEAST_RADIUS = 0.15
"""Metres: of what may begin a track without having come where it was free."""
HALF_RADIUS = 0.3
"""Metres: the least radius of what is half hidden when it is first seen: that of a person."""
RADIUS_GAIN = 0.3
"""How much a new look at a whole piece changes the radius of a track."""


@dataclass(frozen=True, eq=False)
class Seen:
    """A scan at a tick, in pieces, by a lidar that is at `lidar` in the odom frame.

    Which of them stand where it was free, and which where something was hit before.
    """

    tick: int
    pieces: Clusters
    lidar: Stance
    came: list[bool]
    stood: list[bool]


def associate(tracks: list[Track], seen: Seen) -> set[int]:
    """Give each track the piece nearest to where it should be, nearest pairs first; the pieces that were given."""
    pieces, lidar = seen.pieces, seen.lidar
    if not tracks or not len(pieces.centres):
        return set()
    expected = [lidar.into(track.place) for track in tracks]
    gates = [GATE + GATE_SIGMAS * track.place_deviation for track in tracks]
    # Of what is half hidden, the middle of the visible part may be a radius off.
    most = [gate + track.radius for gate, track in zip(gates, tracks, strict=True)]
    off = np.abs(np.array(expected)[:, None] - pieces.centres)
    numbers, near = (off <= np.array(most)[:, None]).nonzero()
    possible = list[tuple[float, int, int]]()
    for number, piece, far in zip(numbers.tolist(), near.tolist(), off[numbers, near].tolist(), strict=True):
        track, hidden = tracks[number], pieces.edges[piece] != BOTH
        reach = gates[number] + track.radius * hidden
        if seen.stood[piece] and not seen.came[piece]:
            # What stands continues what has stood there: nothing hops from one post to the next.
            last = abs(lidar.into(track.lately[-1].place) - pieces.centres[piece])
            if last > GATE + track.radius * hidden:
                continue
        if far <= reach:
            possible.append((far, number, piece))
    possible.sort()
    given = dict[int, int]()
    taken = set[int]()
    for _, number, piece in possible:
        if number not in given and piece not in taken:
            taken.add(piece)
            given[number] = piece
    if given:
        _update([(tracks[number], piece) for number, piece in given.items()], seen)
    return taken


def _update(given: list[tuple[Track, int]], seen: Seen) -> None:
    """Tracks are seen as these pieces."""
    pieces, lidar = seen.pieces, seen.lidar
    edges, centres, radii = pieces.edges.tolist(), pieces.centres.tolist(), pieces.radii.tolist()
    guesses = list[complex]()
    for track, piece in given:
        if edges[piece] == BOTH:
            track.radius += RADIUS_GAIN * (radii[piece] - track.radius)
            guesses.append(centres[piece])
        else:
            guesses.append(lidar.into(track.place))
    which, sizes = np.array([piece for _, piece in given]), np.array([track.radius for track, _ in given])
    found = fitted(pieces, which, np.array(guesses), sizes).tolist()
    for (track, piece), centre in zip(given, found, strict=True):
        hidden = 0.0 if edges[piece] == BOTH else HALF_SEEN
        track.correct(lidar.out(centre), NOISE + RELATIVE * abs(centre) + hidden)
        track.note(seen.tick, seen.came[piece], seen.stood[piece], edges[piece], track.place_deviation)


def begin(tracks: list[Track], seen: Seen, taken: set[int]) -> None:
    """Tracks of pieces that no track has taken and that stand where it was free."""
    pieces = seen.pieces
    # Among moving things others may, of which a thing that passed hid that they were not there before.
    least = LEAST_RADIUS if any(track.moving for track in tracks) else np.inf
    for piece, (radius, came) in enumerate(zip(pieces.radii.tolist(), seen.came, strict=True)):
        if piece in taken or not (came or (radius >= least and not seen.stood[piece])):
            continue
        centre = complex(pieces.centres[piece])
        # Of what is half hidden more may be there than is seen.
        whole, noise = pieces.edges[piece] == BOTH, NOISE + RELATIVE * abs(centre)
        size = radius if whole else max(radius, HALF_RADIUS)
        track = Track.begun(seen.tick, seen.lidar.out(centre), noise + FIRST_SEEN, size)
        track.note(seen.tick, came, seen.stood[piece], 0, noise if whole else noise + HALF_SEEN)
        tracks.append(track)
