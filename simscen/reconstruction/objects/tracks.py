"""Tracks objects: assigns the clusters of successive scans that belong to the same object to one track."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.objects.clusters import ScanCluster

MAX_CENTER_DISTANCE_M = 2.5
"""A cluster does not belong to a track if its center is farther from the predicted center."""
GATE_M, GATE_M_S = 0.25, 0.8
"""Maximum distance between a track and its next cluster: fixed, and per second since the last cluster."""
MAX_UNSEEN_S = 2.0
"""Time without a cluster after which a track ends."""
CENTER_WEIGHT = 0.3
"""Weight of the distance between centers, relative to that between hits, in the distance of a cluster from a track. It
is low because the center depends on which part of the object is visible."""
VELOCITY_CLUSTERS, MAX_SPEED_M_S = 6, 2.5
"""Number of clusters from which the velocity is computed, and upper limit of the speed."""
MOVING_SPEED_M_S = 0.3
"""A hidden object with a lower speed may also have stopped where it was last seen."""
MIN_CLUSTERS, MIN_TRACK_S = 6, 0.6
"""Smallest number of clusters, and shortest duration, of a track."""
MAX_LINK_S, LINK_M, LINK_M_S = 6.0, 0.5, 0.5
"""Longest time for which an object may be hidden, and largest distance from its predicted position at which it may
reappear: fixed, and per second hidden."""


@dataclass(eq=False)
class ObjectTrack:
    """Clusters of one object in order of time, and its velocity (2,) in m/s at the last one."""

    clusters: list[ScanCluster] = field(default_factory=list)
    velocity: Array = field(default_factory=lambda: np.zeros(2))

    @property
    def begin(self) -> float:
        """Time in s of the first cluster."""
        return self.clusters[0].time

    @property
    def end(self) -> float:
        """Time in s of the last cluster."""
        return self.clusters[-1].time

    def add(self, cluster: ScanCluster) -> None:
        """Add the next cluster and update the velocity."""
        self.clusters.append(cluster)
        recent = self.clusters[-VELOCITY_CLUSTERS:]
        if len(recent) >= 3:
            times = np.array([cluster.time for cluster in recent])
            offsets = times - times.mean()
            centers = np.array([cluster.center for cluster in recent])
            velocity = offsets @ centers / max(float(offsets @ offsets), 1e-6)
            speed = float(np.hypot(*velocity))
            self.velocity = velocity * min(1.0, MAX_SPEED_M_S / max(speed, 1e-6))

    def distance_to(self, cluster: ScanCluster) -> float:
        """Return the distance in m of a cluster from the hits and center that the track predicts; inf if it is far."""
        last = self.clusters[-1]
        predicted = last.points + self.velocity * (cluster.time - last.time)
        if float(np.hypot(*(predicted.mean(axis=0) - cluster.points.mean(axis=0)))) > MAX_CENTER_DISTANCE_M:
            return float("inf")
        between = np.hypot(*(predicted[:, None, :] - cluster.points[None, :, :]).transpose(2, 0, 1))
        surfaces = float(min(between.min(axis=0).mean(), between.min(axis=1).mean()))
        centers = float(np.hypot(*(last.center + self.velocity * (cluster.time - last.time) - cluster.center)))
        return surfaces + CENTER_WEIGHT * centers


def track_objects(scans: list[list[ScanCluster]]) -> list[ObjectTrack]:
    """Return the tracks of all objects that were seen often enough in `scans`, the clusters of each scan."""
    active: list[ObjectTrack] = []
    done: list[ObjectTrack] = []
    for clusters in scans:
        if not clusters:
            continue
        time = clusters[0].time
        done += [track for track in active if time - track.end > MAX_UNSEEN_S]
        active = [track for track in active if time - track.end <= MAX_UNSEEN_S]
        _associate(active, clusters)
    tracks = [track for track in (*done, *active) if len(track.clusters) >= MIN_CLUSTERS]
    tracks = [track for track in tracks if track.end - track.begin >= MIN_TRACK_S]
    return _linked(sorted(tracks, key=lambda track: (track.begin, *track.clusters[0].center.tolist())))


def _associate(active: list[ObjectTrack], clusters: list[ScanCluster]) -> None:
    """Add each cluster of a scan to the nearest of the `active` tracks, nearest pairs first, or append a new track."""
    pairs = []
    for number, track in enumerate(active):
        for index, cluster in enumerate(clusters):
            distance = track.distance_to(cluster)
            if distance <= GATE_M + GATE_M_S * (cluster.time - track.end):
                pairs.append((distance, number, index))
    used_tracks: set[int] = set()
    used: set[int] = set()
    for _, number, index in sorted(pairs):
        if number not in used_tracks and index not in used:
            used_tracks.add(number)
            used.add(index)
            active[number].add(clusters[index])
    for index, cluster in enumerate(clusters):
        if index not in used:
            track = ObjectTrack()
            track.add(cluster)
            active.append(track)


def _linked(tracks: list[ObjectTrack]) -> list[ObjectTrack]:
    """Return the tracks; those of one object before and after it was hidden become one."""
    linked: list[ObjectTrack] = []
    for track in tracks:
        before = [(gap, earlier) for earlier in linked if (gap := _link_distance(earlier, track)) is not None]
        if before:
            nearest = min(before, key=lambda pair: pair[0])[1]
            nearest.clusters += track.clusters
            nearest.velocity = track.velocity
        else:
            linked.append(track)
    return linked


def _link_distance(before: ObjectTrack, after: ObjectTrack) -> float | None:
    """Return how far in m a track starts from where an earlier one leads; None if that is too far or too late."""
    gap = after.begin - before.end
    if not 0.0 < gap <= MAX_LINK_S:
        return None
    places = [before.clusters[-1].center + before.velocity * gap]
    if float(np.hypot(*before.velocity)) < MOVING_SPEED_M_S:
        places.append(before.clusters[-1].center)
    distance = min(float(np.hypot(*(after.clusters[0].center - place))) for place in places)
    return distance if distance <= LINK_M + LINK_M_S * gap else None
