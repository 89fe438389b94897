"""Objects that are not on the map, moving or standing, from the clusters of scans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.drive.recorded_drive import Indices, Polygon
from simscen.reconstruction.objects.clusters import fraction_seen_free, scan_clusters, usable_scans
from simscen.reconstruction.objects.found_object import FoundObject, Keyframe
from simscen.reconstruction.objects.shapes import ObjectShape, fit_shape
from simscen.reconstruction.objects.tracks import ObjectTrack, track_objects
from simscen.reconstruction.reasons import Reason
from simscen.reconstruction.static_world import StaticWorld

MIN_DISPLACEMENT_M = 0.4
"""Distance that an object must move to count as moving."""
MIN_FREED_FRACTION = 0.5
"""Share of an earlier outline that must be seen free later, or of a later one that was free earlier."""
SEEN_FREE_FRACTION = 0.6
"""Share of the points of an object that beams must pass to show that it is not there."""
COMPARED_CLUSTERS = 5
"""Number of clusters at the start and at the end of a track that are compared."""
KEYFRAME_TOLERANCE_M, KEYFRAME_TOLERANCE_RAD, MAX_KEYFRAMES = 0.05, math.radians(10), 400
"""Largest distance and turn between a track and its keyframes, and largest number of keyframes."""
MERGE_DISTANCE_M = 0.3
"""Distance between the hits of two tracks below which they may be of the same standing object."""
MIN_CLUSTERS_STANDING = 10
"""Number of clusters that a standing object needs."""
PART_MARGIN_M, PART_FRACTION = 0.15, 0.5
"""A track belongs to a moving object if this share of its clusters is within this distance of it."""
MIN_SIZE_M = 0.06
"""Longest side, or radius, below which an object is ignored."""
MAX_OBJECT_SPEED_M_S = 4.0
"""Keyframes that an object would reach only at a higher speed are errors of its track."""


def find_objects(
    compared: ComparedScans, world: StaticWorld, has_true_poses: bool, robots: Sequence[FoundObject] = ()
) -> list[FoundObject]:
    """Return the objects that the scans show and the static world does not have, and the other `robots`."""
    tracks = track_objects(scan_clusters(compared, world, has_true_poses))
    usable = np.flatnonzero(usable_scans(compared))
    moving = [track for track in tracks if _moves(compared, track, usable)]
    standing = _merged([track for track in tracks if track not in moving], compared, usable)
    moving.sort(key=lambda track: (-len(track.clusters), track.begin))
    found: list[FoundObject] = [*robots]
    for track in moving:
        if not any(_is_part(track, thing) for thing in found):
            found.append(_found(compared, track, usable, moves=True))
    known = [*found]
    for track in standing:
        if len(track.clusters) >= MIN_CLUSTERS_STANDING and not any(_is_part(track, thing) for thing in known):
            found.append(_found(compared, track, usable, moves=False))
    found = [thing for thing in found[len(robots) :] if max(thing.size) >= MIN_SIZE_M]
    found.sort(key=lambda thing: (thing.keyframes[0][0], *thing.keyframes[0][1:3]))
    kinds = {True: "moving object", False: "object"}
    counts = {True: 0, False: 0}
    named = []
    for thing in found:
        counts[thing.is_moving] += 1
        named.append(replace(thing, name=f"{kinds[thing.is_moving]} {counts[thing.is_moving]}"))
    return [*robots, *named]


def object_along(name: str, outline: Polygon, times: Array, poses: Array) -> FoundObject:
    """Return a box around an outline in the frame of poses x, y, yaw (n, 3), which are known at `times` (n,) in s."""
    corners = np.array(outline)
    low, high = corners.min(axis=0), corners.max(axis=0)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = ((low + high) / 2).tolist()
    centers = np.column_stack((poses[:, 0] + c * x - s * y, poses[:, 1] + s * x + c * y, poses[:, 2]))
    length, width = np.round(high - low, 2).tolist()
    keyframes = tuple(simplified(ObjectShape((length, width), times, centers)))
    reason = Reason("its true poses in the log", float(times[0]), float(times[-1]))
    return FoundObject(name, (length, width), keyframes, None, None, reason, is_robot=True)


def _moves(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> bool:
    """Return whether an object moved, and not only the part of it that was visible."""
    shape = fit_shape(track.clusters, moves=True)
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
    return max(_largest(freed), _largest(was_free)) > MIN_FREED_FRACTION


def median_of_three(values: Array) -> Array:
    """Return the medians (n,) over three neighbors of values (n,)."""
    if len(values) < 3:
        return values
    padded = np.concatenate((values[:1], values, values[-1:]))
    result: Array = np.median(np.lib.stride_tricks.sliding_window_view(padded, 3), axis=1)
    return result


def _largest(shares: Array) -> float:
    return float(np.nanmedian(shares)) if np.isfinite(shares).any() else 0.0


def _merged(tracks: list[ObjectTrack], compared: ComparedScans, usable: Indices) -> list[ObjectTrack]:
    """Return the tracks of standing objects, with those of one object joined."""
    merged: list[ObjectTrack] = []
    for track in tracks:
        same = next((earlier for earlier in merged if _is_same(earlier, track, compared, usable)), None)
        if same is None:
            merged.append(ObjectTrack([*track.clusters]))
        else:
            same.clusters = sorted([*same.clusters, *track.clusters], key=lambda cluster: cluster.time)
    return merged


def _is_same(earlier: ObjectTrack, later: ObjectTrack, compared: ComparedScans, usable: Indices) -> bool:
    """Return whether two tracks of standing objects touch, and the place was not free in between."""
    a, b = (np.concatenate([cluster.points for cluster in track.clusters]) for track in (earlier, later))
    a, b = a[:: max(1, len(a) // 200)], b[:: max(1, len(b) // 200)]
    if float(np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)).min()) > MERGE_DISTANCE_M:
        return False
    first, last = earlier.clusters[-1].scan, later.clusters[0].scan
    between = usable[(usable > first) & (usable < last)]
    return not len(between) or _largest(fraction_seen_free(compared, b, between)) < SEEN_FREE_FRACTION


def _is_part(track: ObjectTrack, thing: FoundObject) -> bool:
    """Return whether most clusters of a track are where a moving object is at their times."""
    frames = np.array(thing.keyframes)
    times = np.array([cluster.time for cluster in track.clusters])
    centers = np.array([cluster.center for cluster in track.clusters])
    at = np.column_stack([np.interp(times, frames[:, 0], frames[:, axis]) for axis in (1, 2)])
    reach = thing.size[0] if thing.is_cylinder else math.hypot(*thing.size) / 2
    inside = np.hypot(*(centers - at).T) < reach + PART_MARGIN_M
    present = (times >= frames[0, 0] - 0.5) & (times <= frames[-1, 0] + 0.5)
    return float(np.mean(inside & present)) > PART_FRACTION


def _found(compared: ComparedScans, track: ObjectTrack, usable: Indices, moves: bool) -> FoundObject:
    shape = fit_shape(track.clusters, moves)
    keyframes = simplified(shape) if moves else [_keyframe(shape, 0)]
    appears = _appearance(compared, track, usable)
    disappears = _disappearance(compared, track, usable)
    if disappears is not None and moves:
        disappears = max(disappears, keyframes[-1][0] + 0.01)
    seen = f"seen in {len(track.clusters)} scans"
    if moves:
        length = float(np.hypot(*np.diff(shape.poses[:, :2], axis=0).T).sum())
        text = f"{seen}, moved {length:.1f} m"
    else:
        text = f"{seen} at one place, and not on the map"
    confidence = "high" if len(track.clusters) >= 20 else "medium"
    reason = Reason(text, track.begin, track.end, confidence)
    return FoundObject("", shape.size, tuple(keyframes), appears, disappears, reason)


def _appearance(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return when the object appeared; None if its place was never seen free before it was seen there."""
    points = np.concatenate([cluster.points for cluster in track.clusters[:3]])
    before = usable[usable < track.clusters[0].scan]
    if not len(before):
        return None
    shares = fraction_seen_free(compared, points, before)
    free = before[np.nan_to_num(shares, nan=0.0) > SEEN_FREE_FRACTION]
    return float(compared.scans.times[free[-1] + 1]) if len(free) else None


def _disappearance(compared: ComparedScans, track: ObjectTrack, usable: Indices) -> float | None:
    """Return when the object disappeared; None if its place is not seen free afterwards."""
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


def simplified(shape: ObjectShape) -> list[Keyframe]:
    """Return the keyframes between which linear interpolation gives the poses within the tolerances."""
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
