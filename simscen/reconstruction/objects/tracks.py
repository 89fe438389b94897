"""Object tracking: assigns the clusters of successive scans to tracks, one track for each object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.objects.clusters import ScanCluster

MAX_CENTER_DISTANCE_M = 2.5
"""Maximum distance between the center of a cluster and the center that the track predicts."""
GATE_DISTANCE_M, GATE_DISTANCE_PER_S_M = 0.25, 0.8
"""Maximum distance between a track and its next cluster: constant, and per second since the last cluster."""
MAX_UNSEEN_S = 2.0
"""Maximum time without a cluster in a track."""
CENTER_WEIGHT = 0.3
"""The distance of a cluster from a track is the distance between hits plus this weight times the distance between
centers."""
VELOCITY_CLUSTERS, MAX_SPEED_M_S = 6, 2.5
"""Number of clusters from which the velocity is computed, and upper limit of the speed."""
MAX_STOPPING_SPEED_M_S = 0.3
"""A hidden object whose last measured speed is lower may also have stopped where it was last seen."""
MIN_CLUSTERS, MIN_TRACK_S = 6, 0.6
"""Minimum number of clusters, and minimum duration, of a track."""
MAX_LINK_S, LINK_DISTANCE_M, LINK_DISTANCE_PER_S_M = 6.0, 0.5, 0.5
"""Maximum time for which an object is hidden, and maximum distance between its predicted position and the position
where it reappears: constant, and per second hidden."""


@dataclass(eq=False)
class ObjectTrack:
    """Clusters of one object in order of time, and velocity (2,) in m/s at the last cluster."""

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
        """Return the distance in m of a cluster from the prediction of the track; inf above MAX_CENTER_DISTANCE_M."""
        last = self.clusters[-1]
        predicted = last.points + self.velocity * (cluster.time - last.time)
        centers = float(np.hypot(*(last.center + self.velocity * (cluster.time - last.time) - cluster.center)))
        if centers > MAX_CENTER_DISTANCE_M:
            return float("inf")
        between = np.hypot(*(predicted[:, None, :] - cluster.points[None, :, :]).transpose(2, 0, 1))
        surfaces = float(min(between.min(axis=0).mean(), between.min(axis=1).mean()))
        return surfaces + CENTER_WEIGHT * centers


def track_objects(scans: list[list[ScanCluster]]) -> list[ObjectTrack]:
    """Return the tracks of objects. `scans` are the clusters of each scan. Short tracks are omitted."""
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
    return _link_tracks(sorted(tracks, key=lambda track: (track.begin, *track.clusters[0].center.tolist())))


def _associate(active: list[ObjectTrack], clusters: list[ScanCluster]) -> None:
    """Add each cluster of a scan to the nearest of the `active` tracks (nearest pairs first), or append a new track."""
    pairs = []
    for number, track in enumerate(active):
        for index, cluster in enumerate(clusters):
            distance = track.distance_to(cluster)
            if distance <= GATE_DISTANCE_M + GATE_DISTANCE_PER_S_M * (cluster.time - track.end):
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


def _link_tracks(tracks: list[ObjectTrack]) -> list[ObjectTrack]:
    """Merge the tracks of an object before and after it was hidden."""
    linked: list[ObjectTrack] = []
    for track in tracks:
        predecessors = [(gap, earlier) for earlier in linked if (gap := _link_distance(earlier, track)) is not None]
        if predecessors:
            nearest = min(predecessors, key=lambda pair: pair[0])[1]
            nearest.clusters += track.clusters
            nearest.velocity = track.velocity
        else:
            linked.append(track)
    return linked


def _link_distance(before: ObjectTrack, after: ObjectTrack) -> float | None:
    """Return the distance in m between the start of `after` and the prediction of `before`; None if not linkable."""
    gap = after.begin - before.end
    if not 0.0 < gap <= MAX_LINK_S:
        return None
    places = [before.clusters[-1].center + before.velocity * gap]
    if float(np.hypot(*before.velocity)) < MAX_STOPPING_SPEED_M_S:
        places.append(before.clusters[-1].center)
    distance = min(float(np.hypot(*(after.clusters[0].center - place))) for place in places)
    return distance if distance <= LINK_DISTANCE_M + LINK_DISTANCE_PER_S_M * gap else None
