"""Data association: which cluster of a scan updates which track, and which starts a new one."""

import math

from simscen.advanced.prediction.clusters import BOTH, Cluster, Places, fit_circle
from simscen.advanced.prediction.scan_outline import LidarPose
from simscen.advanced.prediction.tracks import Track
from simscen.core.decorators import fast_dataclass

NOISE, RELATIVE, HALF_SEEN = 0.02, 0.004, 0.10
"""Standard deviation in m of a measured center: constant part, part per meter of range, and part if partly hidden."""
FIRST_SEEN = 0.1
"""Additional standard deviation in m of the first measurement of a track."""
GATE, GATE_SIGMAS = 0.25, 3.0
"""Gate of the association: a distance in m plus a number of standard deviations."""
LEAST_RADIUS = 0.15
"""Minimum radius in m of a cluster that starts a track without having appeared in free space."""
HALF_RADIUS = 0.3
"""Minimum radius in m of a partly hidden cluster that starts a track: that of a person."""
RADIUS_GAIN = 0.3
"""Gain of the radius update with a completely visible cluster."""


@fast_dataclass(eq=False)
class ScanClusters:
    """The clusters of a scan with their hits `places` (m,), seen by a lidar at `lidar` in the odom frame.

    `came` tells which of them are where earlier scans saw free space, `stood` which are where something was hit before.
    """

    tick: int
    places: Places
    pieces: list[Cluster]
    lidar: LidarPose
    came: list[bool]
    stood: list[bool]

    def stands(self, piece: int) -> bool:
        """Return whether a cluster is at the same place as before."""
        return self.stood[piece] and not self.came[piece]


def associate(tracks: list[Track], seen: ScanClusters) -> set[int]:
    """Update each track with the nearest cluster, nearest pairs first. Return the indices of the clusters used."""
    pieces, lidar = seen.pieces, seen.lidar
    if not tracks or not pieces:
        return set()
    possible: list[tuple[float, int, int]] = []
    for number, track in enumerate(tracks):
        expected, gate = lidar.into(track.place), GATE + GATE_SIGMAS * track.place_deviation
        for piece, (_, _, center, _, edges) in enumerate(pieces):
            # The center of a partly hidden obstacle can be off by its radius.
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
    """Return whether a static cluster is the one that the track was last updated with."""
    return abs(lidar.into(track.lately[-1].place) - center) <= GATE + hidden


def _update(given: list[tuple[Track, int]], seen: ScanClusters) -> None:
    """Update tracks with their clusters."""
    lidar = seen.lidar
    for track, number in given:
        first, last, guess, radius, edges = seen.pieces[number]
        if edges == BOTH:
            track.radius += RADIUS_GAIN * (radius - track.radius)
        else:
            guess = lidar.into(track.place)
        center = fit_circle(seen.places[first : last + 1].tolist(), track.radius, guess)
        hidden = 0.0 if edges == BOTH else HALF_SEEN
        track.correct(lidar.out(center), NOISE + RELATIVE * abs(center) + hidden)
        track.note(seen.tick, seen.came[number], seen.stood[number], edges, track.place_deviation)


def start_tracks(tracks: list[Track], seen: ScanClusters, taken: set[int]) -> None:
    """Start tracks for unused clusters that are in formerly free space."""
    # While something moves, it may have hidden the free space in which another obstacle appears.
    least = LEAST_RADIUS if any(track.moving for track in tracks) else math.inf
    for number, (_, _, center, radius, edges) in enumerate(seen.pieces):
        came, stood = seen.came[number], seen.stood[number]
        if number in taken or not (came or (radius >= least and not stood)):
            continue
        # A partly hidden obstacle may be larger than its visible part.
        whole, noise = edges == BOTH, NOISE + RELATIVE * abs(center)
        size = radius if whole else max(radius, HALF_RADIUS)
        track = Track.begun(seen.tick, seen.lidar.out(center), noise + FIRST_SEEN, size)
        track.note(seen.tick, came, stood, 0, noise if whole else noise + HALF_SEEN)
        tracks.append(track)
