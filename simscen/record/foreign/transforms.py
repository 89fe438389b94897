"""Poses of frames in other frames, from the transforms on /tf and /tf_static of a log."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.records.trace import Ticks
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.timebase import StampedMessages, check_recorder_clock
from simscen.record.messages.decode import StampedPose


@dataclass
class _Link:
    """Transforms of a frame, one for each message.

    parent:     name of the parent frame
    logged:     times of logging in ns
    stamps:     stamps in ns
    poses:      poses of the frame in the parent frame: x, y, z and a quaternion x, y, z, w
    is_static:  False if any message was on /tf
    """

    parent: str
    logged: list[int] = field(default_factory=list)
    stamps: list[int] = field(default_factory=list)
    poses: list[tuple[float, ...]] = field(default_factory=list)
    is_static: bool = True

    def times(self, use_log_time: bool) -> Ticks:
        """Return the times of logging or the stamps as an array."""
        return np.array(self.logged if use_log_time else self.stamps, dtype=np.int64)


class TransformTrack(NamedTuple):
    """Poses of a frame in another frame over time, in the order of logging.

    source:   text with the two frames, for messages to the user
    logged:   times of logging (n,) in ns
    stamped:  stamps; None if the times of logging are used instead
    poses:    x, y, z and a quaternion x, y, z, w (n, 7)
    """

    source: str
    logged: Ticks
    stamped: StampedMessages | None
    poses: Array


_BASE_FRAMES = ("base_link", "base_footprint")


class UnknownTransform(UnusableLog):
    """tf does not contain the transform between two frames. The message states the reason."""


class TransformTree:
    """All transforms of a log, as a tree of frames."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}

    def add(self, logged: int, links: list[StampedPose], is_static: bool) -> None:
        """Add the transforms of one message on /tf, or on /tf_static if `is_static`.

        `logged` is the time of logging in ns. If the parent of a frame changes, its previous transforms are dropped.
        """
        for transform in links:
            link = self._links.get(transform.child)
            if link is None or link.parent != transform.frame:
                link = self._links[transform.child] = _Link(transform.frame)
            link.is_static &= is_static
            link.logged.append(logged)
            link.stamps.append(transform.stamp)
            link.poses.append(transform.pose)

    @property
    def child_frames(self) -> Collection[str]:
        """All frames that have a parent frame."""
        return self._links.keys()

    def track(self, outer: str, inner: str, use_log_time: bool = False) -> TransformTrack:
        """Return the poses of the frame `inner` in `outer`. Raises UnknownTransform, or UnusableLog.

        Each message of the dynamic transform nearest to `inner` yields one pose. For all other transforms, the latest
        message at this time counts, without interpolation. Times are stamps, or times of logging if `use_log_time` or
        if all stamps are zero.
        """
        chain = self._chain(outer, inner)
        dynamic_links = [link for link in chain if not link.is_static]
        if not dynamic_links:
            raise UnknownTransform(f"tf between {outer} and {inner} never changes")
        nearest = dynamic_links[0]
        source = f"tf {outer}:{inner}"
        check_recorder_clock(source, nearest.logged, nearest.stamps)
        use_log_time = use_log_time or not any(any(link.stamps) for link in dynamic_links)
        start = max(int(link.times(use_log_time).min()) for link in dynamic_links)
        order = np.argsort(nearest.logged, kind="stable")
        order = order[nearest.times(use_log_time)[order] >= start]
        if not len(order):
            raise UnknownTransform(f"tf never connects {outer} and {inner} at the same time")
        times, logged = nearest.times(use_log_time)[order], nearest.times(use_log_time=True)[order]
        poses = np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(order), 1))
        for link in chain:
            poses = _compose(_latest_poses(link, times, use_log_time), poses)
        return TransformTrack(source, logged, None if use_log_time else StampedMessages(source, logged, times), poses)

    def sensor_mount(self, frame: str, base: str) -> Pose3 | None:
        """Return the pose of a sensor's frame on the frame `base`, or else on base_link or base_footprint.

        Return None if no transforms connect the frames. For a static transform, the latest message counts. For a
        transform on /tf, where some robots publish the mounts of their sensors, the first message counts.
        """
        pose, visited, pose_on_base_link = Pose3(), set(), None
        while frame != base:
            if pose_on_base_link is None and frame.rpartition("/")[2] in _BASE_FRAMES:
                pose_on_base_link = pose
            if frame not in self._links or frame in visited:
                return pose_on_base_link
            visited.add(frame)
            link = self._links[frame]
            pose, frame = Pose3(*link.poses[-1 if link.is_static else 0]).compose(pose), link.parent
        return pose

    def _chain(self, outer: str, inner: str) -> list[_Link]:
        """Return the transforms from `inner` up to `outer`. Raises UnknownTransform if `inner` is not below `outer`."""
        chain = self._links_to_ancestor(inner, outer)
        if chain is not None:
            return chain
        if self._links_to_ancestor(outer, inner) is not None:
            raise UnknownTransform(f"in tf, {outer} is below {inner}; write {inner}:{outer}")
        frames = ", ".join(sorted({*self._links, *(link.parent for link in self._links.values())})) or "none"
        raise UnknownTransform(f"tf does not connect {outer} with {inner}; frames: {frames}")

    def _links_to_ancestor(self, frame: str, ancestor: str) -> list[_Link] | None:
        """Return the transforms from `frame` up to `ancestor`; None if `ancestor` is not above `frame`."""
        links: list[_Link] = []
        while frame != ancestor:
            link = self._links.get(frame)
            if link is None or link in links:
                return None
            links.append(link)
            frame = link.parent
        return links


def _latest_poses(link: _Link, times: Ticks, use_log_time: bool) -> Array:
    """Return the latest poses (n, 7) of a link at `times` (n,), which are times of logging or stamps.

    Before the first message of the link, the first pose counts. For a static link, the last pose counts at all times.
    """
    link_times, poses = link.times(use_log_time), np.array(link.poses)
    order = np.argsort(link_times, kind="stable")
    if link.is_static:
        return np.tile(poses[order[-1]], (len(times), 1))
    indices = np.searchsorted(link_times[order], times, side="right") - 1
    latest: Array = poses[order][np.maximum(indices, 0)]
    return latest


def _compose(outer: Array, inner: Array) -> Array:
    """Return the composition of poses (n, 7), row by row. Each row of `inner` is a pose in the frame at `outer`."""
    ax, ay, az, aw = outer[:, 3:].T
    bx, by, bz, bw = inner[:, 3:].T
    rotations = np.column_stack(
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    )
    axis, w = outer[:, 3:6], outer[:, 6:7]
    cross = 2 * np.cross(axis, inner[:, :3])
    rotated = inner[:, :3] + w * cross + np.cross(axis, cross)
    return np.column_stack((outer[:, :3] + rotated, rotations))


def is_upside_down(mount: Pose3) -> bool:
    """Return whether the z axis of a lidar points down, so that its beams turn clockwise as seen from above."""
    return 1 - 2 * (mount.qx * mount.qx + mount.qy * mount.qy) < 0
