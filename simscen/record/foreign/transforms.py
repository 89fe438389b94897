"""Where a frame is in another one, out of the transforms of a log."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.records.trace import Ticks
from simscen.record.foreign.messages import StampedPose
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.timebase import StampedMessages
from simscen.record.localization_logs.rows import Triple


@dataclass
class _Link:
    """Where a frame is in its parent."""

    parent: str
    logged: list[int] = field(default_factory=list)
    stamps: list[int] = field(default_factory=list)
    poses: list[tuple[float, ...]] = field(default_factory=list)
    static: bool = False


class TransformTree:
    """The links of /tf and /tf_static by child frame."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}

    def add(self, logged: int, links: list[StampedPose], static: bool) -> None:
        """Take in one message. A frame that gets another parent counts from then on as that one's."""
        for posed in links:
            link = self._links.get(posed.child)
            if link is None or link.parent != posed.frame:
                link = self._links[posed.child] = _Link(posed.frame, static=static)
            link.logged.append(logged)
            link.stamps.append(posed.stamp)
            link.poses.append(posed.pose)

    def between(self, outer: str, inner: str) -> tuple[StampedMessages, Array] | str:
        """Where `inner` is in `outer`, (n, 7), whenever the innermost link that moves was told; or why that is unknown.

        Links further out keep their value from one message to the next, as tf2 without interpolation.
        """
        chain = self._chain(outer, inner)
        if isinstance(chain, str):
            return chain
        moving = next((link for link in chain if not link.static), None)
        if moving is None:
            return f"tf between {outer} and {inner} never changes"
        times = np.array(moving.stamps, dtype=np.int64)
        begin = max(min(link.stamps) for link in chain if not link.static)
        kept = times >= begin
        poses = np.tile([0.0, 0, 0, 0, 0, 0, 1], (int(kept.sum()), 1))
        for link in chain:
            poses = _compose(_latest_poses(link, times[kept]), poses)
        if not kept.any():
            return f"tf never connects {outer} and {inner} at one time"
        logged = np.array(moving.logged, dtype=np.int64)[kept]
        return StampedMessages(f"tf {outer}:{inner}", logged, times[kept]), poses

    def _chain(self, outer: str, inner: str) -> list[_Link] | str:
        """The links from `inner` outwards."""
        chain: list[_Link] = []
        frame = inner
        while frame != outer:
            link = self._links.get(frame)
            if link is None or link in chain:
                known = ", ".join(sorted({*self._links, *(one.parent for one in self._links.values())})) or "none"
                return f"tf does not connect {outer} with {inner}; frames: {known}"
            chain.append(link)
            frame = link.parent
        return chain


def _latest_poses(link: _Link, times: Ticks) -> Array:
    """The newest pose of a link at each of `times`."""
    stamps, poses = np.array(link.stamps, dtype=np.int64), np.array(link.poses)
    order = np.argsort(stamps, kind="stable")
    newest = np.searchsorted(stamps[order], times, side="right") - 1
    held: Array = poses[order][len(order) - 1 if link.static else np.maximum(newest, 0)]
    return np.tile(held, (len(times), 1)) if held.ndim == 1 else held


def _compose(outer: Array, inner: Array) -> Array:
    """outer ∘ inner of poses (n, 7)."""
    ax, ay, az, aw = outer[:, 3:].T
    bx, by, bz, bw = inner[:, 3:].T
    turned = np.column_stack(
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    )
    axis, w = outer[:, 3:6], outer[:, 6:7]
    across = 2 * np.cross(axis, inner[:, :3])
    moved = inner[:, :3] + w * across + np.cross(axis, across)
    return np.column_stack((outer[:, :3] + moved, turned))


_BASES = ("base_link", "base_footprint")


class LidarMount(NamedTuple):
    """x, y, yaw of a lidar on the base, and whether it hangs upside down, so that it counts angles the other way."""

    pose: Triple
    hangs: bool


def lidar_mount(frame: str, base: str, links: Mapping[str, StampedPose]) -> LidarMount | None:
    """Where `frame` is on the frame that odometry moves, else on what is called base_link; None where none says so."""
    pose, seen, nearest = Pose3(0, 0, 0, 0, 0, 0, 1), set(), None
    while True:
        if frame == base:
            return _planar_mount(pose)
        if nearest is None and frame.rpartition("/")[2] in _BASES:
            nearest = _planar_mount(pose)
        if frame not in links or frame in seen:
            return nearest
        seen.add(frame)
        link = links[frame]
        pose, frame = Pose3(*link.pose).compose(pose), link.frame


def _planar_mount(pose: Pose3) -> LidarMount:
    qx, qy, qz, qw = pose.quaternion
    x, y, _ = pose.position
    yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    return LidarMount((x, y, yaw), 1 - 2 * (qx * qx + qy * qy) < 0)


LoggedMessage = tuple[int, int, Any]
"""When a message was logged in ns, its place in the log, and what it says."""


def parse_frame_pair(name: str) -> tuple[str, str] | None:
    """The two frames of `map:base_link`, outer first; None for the name of a topic."""
    outer, colon, inner = name.partition(":")
    return (outer, inner) if colon and not name.startswith("/") else None


@dataclass
class TransformMessages:
    """The transforms of a log, and its messages by when they were logged."""

    transforms: TransformTree = field(default_factory=TransformTree)
    orders: dict[int, int] = field(default_factory=dict)

    def add(self, logged: int, order: int, links: list[StampedPose], static: bool) -> None:
        """Take in one message."""
        self.transforms.add(logged, links, static)
        self.orders[logged] = order

    def between(self, outer: str, inner: str) -> list[LoggedMessage]:
        """Where `inner` was in `outer`. Raises Unusable where nothing tells."""
        found = self.transforms.between(outer, inner)
        if isinstance(found, str):
            raise UnusableLog(found)
        times, poses = found
        return [
            (logged, self.orders[logged], StampedPose(stamp, outer, tuple(pose), child=inner))
            for logged, stamp, pose in zip(times.logged.tolist(), times.stamps.tolist(), poses.tolist(), strict=True)
        ]
