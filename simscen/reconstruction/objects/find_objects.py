"""Finds moving and standing objects that are not on the map, from the clusters of the scans."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.drive.recorded_drive import Indices, Polygon
from simscen.reconstruction.objects.clusters import fraction_seen_free, scan_clusters, usable_scans
from simscen.reconstruction.objects.found_object import FoundObject, Keyframe
from simscen.reconstruction.objects.shapes import ObjectShape, fit_shape
from simscen.reconstruction.objects.tracks import ObjectTrack, track_objects
from simscen.reconstruction.reasons import Reason
from simscen.reconstruction.static_world import StaticWorld, offset_poses

MIN_DISPLACEMENT_M = 0.4
"""Minimum displacement of a moving object."""
MIN_FREED_FRACTION = 0.5
"""Minimum fraction of points that shows that an object has moved: of its first points, through which beams pass later,
or of its points at the farthest position, through which beams passed before."""
SEEN_FREE_FRACTION = 0.6
"""Minimum fraction of an object's points through which beams pass while the object is absent."""
COMPARED_CLUSTERS = 5
"""Number of clusters to compare at the start of a track, and where the track is farthest from the start."""
KEYFRAME_TOLERANCE_M, KEYFRAME_TOLERANCE_RAD, MAX_KEYFRAMES = 0.05, math.radians(10), 400
"""Maximum distance and turn between a track and its keyframes, and approximate maximum number of keyframes."""
MERGE_DISTANCE_M = 0.3
"""Maximum distance between the nearest hits of two tracks of the same standing object."""
MIN_CLUSTERS_STANDING = 10
"""Minimum number of clusters of a standing object."""
PART_MARGIN_M, PART_FRACTION = 0.15, 0.5
"""A track is part of a known object if more than PART_FRACTION of its clusters are within PART_MARGIN_M of it."""
MIN_SIZE_M = 0.06
"""Minimum length of the longest side, or of the radius, of an object."""
MAX_OBJECT_SPEED_M_S = 4.0
"""Maximum speed of an object. Keyframes that require a higher speed are omitted."""


def find_objects(
    compared: ComparedScans, world: StaticWorld, has_true_poses: bool, robots: Sequence[FoundObject] = ()
) -> list[FoundObject]:
    """Return the other `robots`, then the objects that the scans show and the static world does not contain."""
    tracks = track_objects(scan_clusters(compared, world, has_true_poses))
    usable = np.flatnonzero(usable_scans(compared))
    moving = [track for track in tracks if _has_moved(compared, track, usable)]
    standing = _merge_tracks([track for track in tracks if track not in moving], compared, usable)
    moving.sort(key=lambda track: (-len(track.clusters), track.begin))
    found: list[FoundObject] = [*robots]
    for track in moving:
        if not any(_is_part(track, thing) for thing in found):
            found.append(_object_of_track(compared, track, usable, is_moving=True))
    known = [*found]
    for track in standing:
        if len(track.clusters) >= MIN_CLUSTERS_STANDING and not any(_is_part(track, thing) for thing in known):
            found.append(_object_of_track(compared, track, usable, is_moving=False))
    found = [thing for thing in found[len(robots) :] if max(thing.size) >= MIN_SIZE_M]
    found.sort(key=lambda thing: (thing.keyframes[0][0], *thing.keyframes[0][1:3]))
    counts: Counter[str] = Counter()
    for index, thing in enumerate(found):
        kind = "moving object" if thing.is_moving else "object"
        counts[kind] += 1
        found[index] = replace(thing, name=f"{kind} {counts[kind]}")
    return [*robots, *found]


def object_of_robot(name: str, outline: Polygon, times: Array, poses: Array) -> FoundObject:
    """Return another robot as a box around `outline` that moves along `poses` x, y, yaw (n, 3).

    The outline is in the frame of the robot. The poses are in the map frame, at `times` (n,) in s.
    """
    corners = np.array(outline)
    low, high = corners.min(axis=0), corners.max(axis=0)
    centers = offset_poses(poses, Pose2(*((low + high) / 2).tolist()))
    length, width = np.round(high - low, 2).tolist()
    keyframes = tuple(keyframes_of(ObjectShape((length, width), times, centers)))
    reason = Reason("its true poses in the log", float(times[0]), float(times[-1]))
    return FoundObject(name, (length, width), keyframes, None, None, reason, is_robot=True)


def _has_moved(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> bool:
    """Return whether an object moved, and not only its visible side. `usable` are the indices of valid scans."""
    shape = fit_shape(track.clusters, is_moving=True)
    centers = shape.poses[:, :2]
    start = np.median(centers[:COMPARED_CLUSTERS], axis=0)
    away = np.hypot(*(centers - start).T)
    far = int(np.argmax(median_of_three(away)))
    if float(median_of_three(away)[far]) < MIN_DISPLACEMENT_M:
        return False
    first = np.concatenate([cluster.points for cluster in track.clusters[:COMPARED_CLUSTERS]])
    near = max(0, far - COMPARED_CLUSTERS // 2)
    last = np.concatenate([cluster.points for cluster in track.clusters[near : near + COMPARED_CLUSTERS]])
    rows_late = usable[(usable >= track.clusters[far].scan - 2) & (usable <= track.clusters[far].scan + 20)]
    rows_early = usable[(usable >= track.clusters[0].scan - 5) & (usable <= track.clusters[0].scan + 3)]
    freed, was_free = (
        fraction_seen_free(compared, points, rows) for points, rows in ((first, rows_late), (last, rows_early))
    )
    return max(_median_fraction(freed), _median_fraction(was_free)) > MIN_FREED_FRACTION


def median_of_three(values: Array) -> Array:
    """Return the median (n,) of each value (n,) and its two neighbors."""
    if len(values) < 3:
        return values
    padded = np.concatenate((values[:1], values, values[-1:]))
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 3), axis=1)


def _median_fraction(fractions: Array) -> float:
    """Return the median of the fractions that are not nan; 0 if all are."""
    return float(np.nanmedian(fractions)) if np.isfinite(fractions).any() else 0.0


def _merge_tracks(tracks: list[ObjectTrack], compared: ComparedScans, usable: Indices) -> list[ObjectTrack]:
    """Merge tracks of the same standing object."""
    merged: list[ObjectTrack] = []
    for track in tracks:
        same = next((earlier for earlier in merged if _is_same(earlier, track, compared, usable)), None)
        if same is None:
            merged.append(ObjectTrack([*track.clusters]))
        else:
            same.clusters = sorted([*same.clusters, *track.clusters], key=lambda cluster: cluster.time)
    return merged


def _is_same(earlier: ObjectTrack, later: ObjectTrack, compared: ComparedScans, usable: Indices) -> bool:
    """Return whether two tracks touch and belong to an object that did not disappear between them."""
    a, b = (np.concatenate([cluster.points for cluster in track.clusters]) for track in (earlier, later))
    a, b = a[:: max(1, len(a) // 200)], b[:: max(1, len(b) // 200)]
    if float(np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)).min()) > MERGE_DISTANCE_M:
        return False
    first, last = earlier.clusters[-1].scan, later.clusters[0].scan
    between = usable[(usable > first) & (usable < last)]
    return not len(between) or _median_fraction(fraction_seen_free(compared, b, between)) < SEEN_FREE_FRACTION


def _is_part(track: ObjectTrack, thing: FoundObject) -> bool:
    """Return whether most clusters of a track are at the position of the object `thing` at the same time."""
    times = np.array([cluster.time for cluster in track.clusters])
    centers = np.array([cluster.center for cluster in track.clusters])
    inside = np.hypot(*(centers - thing.poses_at(times)[:, :2]).T) < thing.radius + PART_MARGIN_M
    present = (times >= thing.keyframes[0][0] - 0.5) & (times <= thing.keyframes[-1][0] + 0.5)
    return float(np.mean(inside & present)) > PART_FRACTION


def _object_of_track(compared: ComparedScans, track: ObjectTrack, usable: Indices, is_moving: bool) -> FoundObject:
    """Return the object of a track, still without a name."""
    shape = fit_shape(track.clusters, is_moving)
    keyframes = keyframes_of(shape) if is_moving else [_keyframe(shape, 0)]
    appear_time = _appearance(compared, track, usable)
    disappear_time = _disappearance(compared, track, usable)
    if disappear_time is not None and is_moving:
        disappear_time = max(disappear_time, keyframes[-1][0] + 0.01)
    seen = f"seen in {len(track.clusters)} scans"
    if is_moving:
        length = float(np.hypot(*np.diff(shape.poses[:, :2], axis=0).T).sum())
        text = f"{seen}, moved {length:.1f} m"
    else:
        text = f"{seen} at one place, and not on the map"
    confidence = "high" if len(track.clusters) >= 20 else "medium"
    reason = Reason(text, track.begin, track.end, confidence)
    return FoundObject("", shape.size, tuple(keyframes), appear_time, disappear_time, reason)


def _appearance(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return the time in s at which the object appeared; None if no earlier scan shows that its first place is free."""
    points = np.concatenate([cluster.points for cluster in track.clusters[:3]])
    before = usable[usable < track.clusters[0].scan]
    if not len(before):
        return None
    shares = fraction_seen_free(compared, points, before)
    free = before[np.nan_to_num(shares, nan=0.0) > SEEN_FREE_FRACTION]
    return float(compared.scans.times[free[-1] + 1]) if len(free) else None


def _disappearance(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return the time in s at which the object disappeared; None if no later scan shows that its last place is free."""
    points = np.concatenate([cluster.points for cluster in track.clusters[-3:]])
    after = usable[usable > track.clusters[-1].scan]
    if not len(after):
        return None
    free = np.nan_to_num(fraction_seen_free(compared, points, after), nan=0.0) > SEEN_FREE_FRACTION
    twice = free & np.append(free[1:], free[-1])
    return float(compared.scans.times[after[np.argmax(twice)]]) if twice.any() else None


def _keyframe(shape: ObjectShape, index: int) -> Keyframe:
    x, y, yaw = shape.poses[index].tolist()
    return float(shape.times[index]), x, y, yaw


def keyframes_of(shape: ObjectShape) -> list[Keyframe]:
    """Return few keyframes whose linear interpolation approximates the poses of a shape (Douglas-Peucker)."""
    times, poses = shape.times, shape.poses.copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    scale = np.array([1.0, 1.0, KEYFRAME_TOLERANCE_M / KEYFRAME_TOLERANCE_RAD])
    kept, parts = {0, len(times) - 1}, [(0, len(times) - 1)]
    while parts and len(kept) < MAX_KEYFRAMES:
        first, last = parts.pop()
        if last - first < 2:
            continue
        share = (times[first : last + 1] - times[first]) / max(times[last] - times[first], 1e-9)
        line = poses[first] + share[:, None] * (poses[last] - poses[first])
        errors = np.linalg.norm((poses[first : last + 1] - line) * scale, axis=1)
        worst = int(np.argmax(errors))
        if errors[worst] > KEYFRAME_TOLERANCE_M:
            kept.add(first + worst)
            parts += [(first, first + worst), (first + worst, last)]
    frames = [_keyframe(shape, index) for index in sorted(kept)]
    slow = frames[:1]
    for frame in frames[1:]:
        step = frame[0] - slow[-1][0]
        if step > 1e-6 and math.dist(frame[1:3], slow[-1][1:3]) <= MAX_OBJECT_SPEED_M_S * step:
            slow.append(frame)
    return slow
