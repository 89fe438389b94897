"""Which piece of a scan continues which track, and which begins one."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.prediction.clusters import Clusters, Indices, fitted
from simscen.stack.prediction.kalman import corrected
from simscen.stack.prediction.tracks import Track, Tracks

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
    """A scan in pieces, their `centres` (n, 2) in the odom frame in which the lidar is at `lidar`.

    Which of them (n,) stand where it was free, and which where something was hit before.
    """

    pieces: Clusters
    centres: Array
    lidar: Pose2
    came: npt.NDArray[np.bool_]
    stood: npt.NDArray[np.bool_]


def associate(tracks: Tracks, seen: Seen) -> set[int]:
    """Give each track the piece nearest to where it should be, nearest pairs first; the pieces that were given."""
    taken: set[int] = set()
    if not len(tracks) or not len(seen.centres):
        return taken
    off, gate = _apart(tracks, seen)
    given = dict[int, int]()
    for track, piece in sorted(np.argwhere(off <= gate).tolist(), key=lambda pair: (off[pair[0], pair[1]], pair)):
        if track not in given and piece not in taken:
            taken.add(piece)
            given[track] = piece
    if given:
        numbers = list(given)
        places, deviations = _measured(tracks, numbers, seen, np.array(list(given.values())))
        tracks.states[numbers], tracks.covariances[numbers] = corrected(
            tracks.states[numbers], tracks.covariances[numbers], places, deviations
        )
        for number, piece in given.items():
            tracks.note(number, bool(seen.came[piece]), bool(seen.stood[piece]), int(seen.pieces.edges[piece]))
    return taken


def _apart(tracks: Tracks, seen: Seen) -> tuple[Array, Array]:
    """Metres (tracks, pieces) between them, and how many there may be."""
    states, covariances, centres = tracks.states, tracks.covariances, seen.centres
    off = np.hypot(centres[None, :, 0] - states[:, None, 0], centres[None, :, 1] - states[:, None, 1])
    spread = np.sqrt(np.maximum(covariances[:, 0, 0], covariances[:, 1, 1]))
    radii = np.array([track.radius for track in tracks.known])
    # Of what is half hidden, the middle of the visible part may be a radius off.
    return off, GATE + GATE_SIGMAS * spread[:, None] + np.where(seen.pieces.whole[None, :], 0.0, radii[:, None])


def _measured(tracks: Tracks, numbers: list[int], seen: Seen, which: Indices) -> tuple[Array, Array]:
    """Where the middles of tracks are seen (n, 2), in the odom frame, as these pieces; and the standard deviations."""
    pieces, lidar = seen.pieces, seen.lidar
    whole, radii = pieces.whole[which], np.array([tracks.known[number].radius for number in numbers])
    radii = np.where(whole, radii + RADIUS_GAIN * (pieces.radii[which] - radii), radii)
    for number, radius in zip(numbers, radii.tolist(), strict=True):
        tracks.known[number].radius = radius
    expected = lidar.inverse().apply(tracks.states[numbers, :2])
    centres = fitted(pieces, which, np.where(whole[:, None], pieces.centres[which], expected), radii)
    deviations = NOISE + RELATIVE * np.hypot(centres[:, 0], centres[:, 1]) + np.where(whole, 0.0, HALF_SEEN)
    return lidar.apply(centres), deviations


def begin(tracks: Tracks, seen: Seen, taken: set[int]) -> None:
    """Tracks of pieces that no track has taken and that stand where it was free."""
    pieces, come = seen.pieces, seen.came
    # Among moving things others may, of which a thing that passed hid that they were not there before.
    if any(track.moving for track in tracks.known):
        come = come | (pieces.radii >= LEAST_RADIUS)
    new = [piece for piece in np.flatnonzero(come).tolist() if piece not in taken]
    if not new:
        return
    begun = [Track(_first_radius(pieces, piece), seen.centres[piece].copy(), fast_at=tracks.tick) for piece in new]
    deviations = NOISE + RELATIVE * np.hypot(*pieces.centres[new].T) + FIRST_SEEN
    tracks.begin(begun, seen.centres[new], deviations)
    for number, piece in enumerate(new, start=len(tracks) - len(new)):
        tracks.note(number, bool(seen.came[piece]), bool(seen.stood[piece]), 0)


def _first_radius(pieces: Clusters, piece: int) -> float:
    """Of what is half hidden more may be there than is seen."""
    radius = float(pieces.radii[piece])
    return radius if pieces.whole[piece] else max(radius, HALF_RADIUS)
