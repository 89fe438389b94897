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
"""Minimum fraction of free points that shows that an object has moved.

These are the first points of the object, through which beams pass later, or its points at the farthest position,
through which beams passed before."""
SEEN_FREE_FRACTION = 0.6
"""Minimum fraction of an object's points through which beams pass while the object is absent."""
COMPARED_CLUSTERS = 5
"""Number of clusters to compare at the start of a track, and where the track is farthest from the start."""
KEYFRAME_TOLERANCE_M, KEYFRAME_TOLERANCE_RAD = 0.05, math.radians(10)
"""Maximum distance and turn between a track and the interpolation of its keyframes."""
MAX_KEYFRAMES = 400
"""Approximate maximum number of keyframes of an object."""
MERGE_DISTANCE_M = 0.3
"""Maximum distance between the nearest hits of two tracks of the same standing object."""
MIN_CLUSTERS_STANDING = 10
"""Minimum number of clusters of a standing object."""
PART_MARGIN_M, PART_FRACTION = 0.15, 0.5
"""A track is part of a known object if more than PART_FRACTION of its clusters are at most PART_MARGIN_M from the
object."""
MIN_SIZE_M = 0.06
"""Minimum length of the longest side, or of the radius, of an object."""
MAX_OBJECT_SPEED_M_S = 4.0
"""Maximum speed of an object. Keyframes that require a higher speed are omitted."""


def find_objects(
    compared: ComparedScans, world: StaticWorld, has_true_poses: bool, robots: Sequence[FoundObject] = ()
) -> list[FoundObject]:
    """Return the other `robots`, and after them the objects that the scans show but the static world does not contain.

    The objects are named "moving object 1", "object 1", … in the order of their first appearance.
    """
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
    """Return whether an object moved. It did not move if only another side of the object became visible.

    `usable` are the indices of usable scans.
    """
    shape = fit_shape(track.clusters, is_moving=True)
    centers = shape.poses[:, :2]
    start = np.median(centers[:COMPARED_CLUSTERS], axis=0)
    distances = median_of_three(np.hypot(*(centers - start).T))
    farthest = int(np.argmax(distances))
    if float(distances[farthest]) < MIN_DISPLACEMENT_M:
        return False
    first_points = np.concatenate([cluster.points for cluster in track.clusters[:COMPARED_CLUSTERS]])
    begin = max(0, farthest - COMPARED_CLUSTERS // 2)
    far_points = np.concatenate([cluster.points for cluster in track.clusters[begin : begin + COMPARED_CLUSTERS]])
    first_scan, far_scan = track.clusters[0].scan, track.clusters[farthest].scan
    late_rows = usable[(usable >= far_scan - 2) & (usable <= far_scan + 20)]
    early_rows = usable[(usable >= first_scan - 5) & (usable <= first_scan + 3)]
    freed_later = fraction_seen_free(compared, first_points, late_rows)
    free_before = fraction_seen_free(compared, far_points, early_rows)
    return max(_median_fraction(freed_later), _median_fraction(free_before)) > MIN_FREED_FRACTION


def median_of_three(values: Array) -> Array:
    """Return the median (n,) of each value (n,) and its two neighbors."""
    if len(values) < 3:
        return values
    padded = np.concatenate((values[:1], values, values[-1:]))
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 3), axis=1)


def _median_fraction(fractions: Array) -> float:
    """Return the median of the fractions that are not nan; 0 if all fractions are nan."""
    return float(np.nanmedian(fractions)) if np.isfinite(fractions).any() else 0.0


def _merge_tracks(tracks: list[ObjectTrack], compared: ComparedScans, usable: Indices) -> list[ObjectTrack]:
    """Merge tracks of the same standing object."""
    merged: list[ObjectTrack] = []
    for track in tracks:
        earlier = next((candidate for candidate in merged if _is_same(candidate, track, compared, usable)), None)
        if earlier is None:
            merged.append(ObjectTrack([*track.clusters]))
        else:
            earlier.clusters = sorted([*earlier.clusters, *track.clusters], key=lambda cluster: cluster.time)
    return merged


def _is_same(earlier: ObjectTrack, later: ObjectTrack, compared: ComparedScans, usable: Indices) -> bool:
    """Return whether two tracks touch and belong to an object that did not disappear between them."""
    a, b = (np.concatenate([cluster.points for cluster in track.clusters]) for track in (earlier, later))
    a, b = a[:: max(1, len(a) // 200)], b[:: max(1, len(b) // 200)]
    if float(np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)).min()) > MERGE_DISTANCE_M:
        return False
    first, last = earlier.clusters[-1].scan, later.clusters[0].scan
    rows = usable[(usable > first) & (usable < last)]
    return not len(rows) or _median_fraction(fraction_seen_free(compared, b, rows)) < SEEN_FREE_FRACTION


def _is_part(track: ObjectTrack, thing: FoundObject) -> bool:
    """Return whether most clusters of a track are hits on the object `thing`, by position and time."""
    times = np.array([cluster.time for cluster in track.clusters])
    centers = np.array([cluster.center for cluster in track.clusters])
    is_inside = np.hypot(*(centers - thing.poses_at(times)[:, :2]).T) < thing.radius + PART_MARGIN_M
    is_present = (times >= thing.keyframes[0][0] - 0.5) & (times <= thing.keyframes[-1][0] + 0.5)
    return float(np.mean(is_inside & is_present)) > PART_FRACTION


def _object_of_track(compared: ComparedScans, track: ObjectTrack, usable: Indices, is_moving: bool) -> FoundObject:
    """Return the object of a track. Its name is still empty."""
    shape = fit_shape(track.clusters, is_moving)
    keyframes = keyframes_of(shape) if is_moving else [_keyframe(shape, 0)]
    appear_time = _appear_time(compared, track, usable)
    disappear_time = _disappear_time(compared, track, usable)
    if disappear_time is not None and is_moving:
        disappear_time = max(disappear_time, keyframes[-1][0] + 0.01)
    text = f"seen in {len(track.clusters)} scans"
    if is_moving:
        length = float(np.hypot(*np.diff(shape.poses[:, :2], axis=0).T).sum())
        text += f", moved {length:.1f} m"
    else:
        text += " at one place, and not on the map"
    confidence = "high" if len(track.clusters) >= 20 else "medium"
    reason = Reason(text, track.begin, track.end, confidence)
    return FoundObject("", shape.size, tuple(keyframes), appear_time, disappear_time, reason)


def _appear_time(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return the time in s at which the object appeared; None if no earlier scan shows that its first place is free."""
    points = np.concatenate([cluster.points for cluster in track.clusters[:3]])
    earlier_rows = usable[usable < track.clusters[0].scan]
    if not len(earlier_rows):
        return None
    fractions = fraction_seen_free(compared, points, earlier_rows)
    free_rows = earlier_rows[np.nan_to_num(fractions, nan=0.0) > SEEN_FREE_FRACTION]
    return float(compared.scans.times[free_rows[-1] + 1]) if len(free_rows) else None


def _disappear_time(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return the time in s at which the object disappeared; None if it stayed.

    It disappeared if two successive later scans show that its last place is free.
    """
    points = np.concatenate([cluster.points for cluster in track.clusters[-3:]])
    later_rows = usable[usable > track.clusters[-1].scan]
    if not len(later_rows):
        return None
    is_free = np.nan_to_num(fraction_seen_free(compared, points, later_rows), nan=0.0) > SEEN_FREE_FRACTION
    is_free_twice = is_free & np.append(is_free[1:], is_free[-1])
    return float(compared.scans.times[later_rows[np.argmax(is_free_twice)]]) if is_free_twice.any() else None


def _keyframe(shape: ObjectShape, index: int) -> Keyframe:
    """Return the pose of a shape with this index as a keyframe."""
    x, y, yaw = shape.poses[index].tolist()
    return float(shape.times[index]), x, y, yaw


def keyframes_of(shape: ObjectShape) -> list[Keyframe]:
    """Return keyframes whose linear interpolation approximates the poses of a shape.

    The Douglas-Peucker algorithm selects the keyframes. Keyframes that require more than MAX_OBJECT_SPEED_M_S are
    omitted.
    """
    times, poses = shape.times, shape.poses.copy()
    poses[:, 2] = np.unwrap(poses[:, 2])
    scale = np.array([1.0, 1.0, KEYFRAME_TOLERANCE_M / KEYFRAME_TOLERANCE_RAD])
    selected, parts = {0, len(times) - 1}, [(0, len(times) - 1)]
    while parts and len(selected) < MAX_KEYFRAMES:
        first, last = parts.pop()
        if last - first < 2:
            continue
        fractions = (times[first : last + 1] - times[first]) / max(times[last] - times[first], 1e-9)
        line = poses[first] + fractions[:, None] * (poses[last] - poses[first])
        errors = np.linalg.norm((poses[first : last + 1] - line) * scale, axis=1)
        worst = int(np.argmax(errors))
        if errors[worst] > KEYFRAME_TOLERANCE_M:
            selected.add(first + worst)
            parts += [(first, first + worst), (first + worst, last)]
    candidates = [_keyframe(shape, index) for index in sorted(selected)]
    keyframes = candidates[:1]
    for keyframe in candidates[1:]:
        step = keyframe[0] - keyframes[-1][0]
        if step > 1e-6 and math.dist(keyframe[1:3], keyframes[-1][1:3]) <= MAX_OBJECT_SPEED_M_S * step:
            keyframes.append(keyframe)
    return keyframes
