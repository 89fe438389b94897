"""Object tracking: assigns the clusters of successive scans to tracks, one track for each object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.objects.clusters import ScanCluster

MAX_CENTER_DISTANCE_M = 2.5
"""Maximum distance between the center of a cluster and the center that the track predicts."""
GATE_DISTANCE_M, GATE_DISTANCE_PER_S_M = 0.25, 0.8
"""Maximum distance between a track and its next cluster: a constant, and an addition per second since the last
cluster."""
MAX_UNSEEN_S = 2.0
"""Maximum time without a cluster in a track. Tracks before and after a longer time are linked afterwards."""
CENTER_WEIGHT = 0.3
"""Weight of the distance between centers in the distance of a cluster from a track. The weight of the distance between
hits is 1."""
VELOCITY_CLUSTERS, MAX_SPEED_M_S = 6, 2.5
"""Number of clusters from which the velocity is computed, and maximum speed."""
MAX_STOPPING_SPEED_M_S = 0.3
"""Speed below which a hidden object may have stopped where it was last seen."""
MIN_CLUSTERS, MIN_TRACK_S = 6, 0.6
"""Minimum number of clusters, and minimum duration, of a track."""
MAX_LINK_S = 6.0
"""Maximum time for which an object is hidden."""
LINK_DISTANCE_M, LINK_DISTANCE_PER_S_M = 0.5, 0.5
"""Maximum distance between the predicted position of a hidden object and the position where it reappears: a constant,
and an addition per second for which the object is hidden."""


@dataclass(eq=False)
class ObjectTrack:
    """Clusters of one object in order of time, and velocity (2,) in m/s in the map frame at the last cluster."""

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
        motion = self.velocity * (cluster.time - last.time)
        center_distance = float(np.hypot(*(last.center + motion - cluster.center)))
        if center_distance > MAX_CENTER_DISTANCE_M:
            return float("inf")
        predicted = last.points + motion
        distances = np.hypot(*(predicted[:, None, :] - cluster.points[None, :, :]).transpose(2, 0, 1))
        hit_distance = float(min(distances.min(axis=0).mean(), distances.min(axis=1).mean()))
        return hit_distance + CENTER_WEIGHT * center_distance


def track_objects(scans: list[list[ScanCluster]]) -> list[ObjectTrack]:
    """Return the tracks of objects. `scans` are the clusters of each scan. Short tracks are omitted."""
    active: list[ObjectTrack] = []
    finished: list[ObjectTrack] = []
    for clusters in scans:
        if not clusters:
            continue
        time = clusters[0].time
        finished += [track for track in active if time - track.end > MAX_UNSEEN_S]
        active = [track for track in active if time - track.end <= MAX_UNSEEN_S]
        _associate(active, clusters)
    tracks = [track for track in (*finished, *active) if len(track.clusters) >= MIN_CLUSTERS]
    tracks = [track for track in tracks if track.end - track.begin >= MIN_TRACK_S]
    return _link_tracks(sorted(tracks, key=lambda track: (track.begin, *track.clusters[0].center.tolist())))


def _associate(active: list[ObjectTrack], clusters: list[ScanCluster]) -> None:
    """Assign the clusters of a scan to the `active` tracks, starting with the nearest pair of cluster and track.

    Append a new track for each cluster that has no track.
    """
    pairs = []
    for track_index, track in enumerate(active):
        for cluster_index, cluster in enumerate(clusters):
            distance = track.distance_to(cluster)
            if distance <= GATE_DISTANCE_M + GATE_DISTANCE_PER_S_M * (cluster.time - track.end):
                pairs.append((distance, track_index, cluster_index))
    assigned_tracks: set[int] = set()
    assigned_clusters: set[int] = set()
    for _, track_index, cluster_index in sorted(pairs):
        if track_index not in assigned_tracks and cluster_index not in assigned_clusters:
            assigned_tracks.add(track_index)
            assigned_clusters.add(cluster_index)
            active[track_index].add(clusters[cluster_index])
    for cluster_index, cluster in enumerate(clusters):
        if cluster_index not in assigned_clusters:
            track = ObjectTrack()
            track.add(cluster)
            active.append(track)


def _link_tracks(tracks: list[ObjectTrack]) -> list[ObjectTrack]:
    """Merge tracks of the same object that was hidden in between."""
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
    """Return the distance in m between the start of `after` and the prediction of `before`.

    Return None if the tracks cannot be of the same object.
    """
    gap = after.begin - before.end
    if not 0.0 < gap <= MAX_LINK_S:
        return None
    predicted_centers = [before.clusters[-1].center + before.velocity * gap]
    if float(np.hypot(*before.velocity)) < MAX_STOPPING_SPEED_M_S:
        predicted_centers.append(before.clusters[-1].center)
    distance = min(float(np.hypot(*(after.clusters[0].center - center))) for center in predicted_centers)
    return distance if distance <= LINK_DISTANCE_M + LINK_DISTANCE_PER_S_M * gap else None
