"""Odometry, scans and a reference from the messages of ROS 2."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.record import topics
from simscen.record.foreign import messages
from simscen.record.foreign.raw_messages import RawMessage, UnusableLog, open_messages
from simscen.record.foreign.transforms import (
    LidarMount,
    LoggedMessage,
    TransformMessages,
    lidar_mount,
    parse_frame_pair,
)
from simscen.record.localization_logs.rows import (
    MAX_COORDINATE_M,
    LocalizationRows,
    PoseRow,
    ScanRow,
    Triple,
    all_within,
)
from simscen.record.simtime import NS_PER_SECOND

_SCAN, _TRANSFORMS = "sensor_msgs/msg/LaserScan", "tf2_msgs/msg/TFMessage"
INITIAL_POSE_TOPIC = "/initialpose"
"""Where RViz and robots tell AMCL where it is."""


@dataclass
class _Messages:
    """The messages that matter."""

    odometry: list[LoggedMessage] = field(default_factory=list)
    scans: list[LoggedMessage] = field(default_factory=list)
    truth: list[LoggedMessage] = field(default_factory=list)
    initial: list[LoggedMessage] = field(default_factory=list)
    links: dict[str, messages.StampedPose] = field(default_factory=dict)
    tf: TransformMessages = field(default_factory=TransformMessages)
    topics: dict[str, str] = field(default_factory=dict)


def read_rosbag_rows(path: Path, odometry: str, scan: str, reference: str | None) -> LocalizationRows:
    """The rows of an MCAP file or a rosbag2 folder, in the order of logging, at the times of their headers.

    Without a `reference`, the truth of simscen's own logs is one. The lidar's mount is what /tf_static says. Odometry
    and reference are those of a topic, or of two frames as `odom:base_link` what /tf says.
    """
    heard = _collect_messages(path, odometry, scan, reference or topics.TRUTH.name)
    if frames := parse_frame_pair(odometry):
        heard.odometry = heard.tf.between(*frames)
    if reference is not None and (frames := parse_frame_pair(reference)):
        heard.truth = heard.tf.between(*frames)
    known = f"its topics: {', '.join(sorted(heard.topics)[:12]) or 'none'}"
    rows = LocalizationRows(hint=f"{known}; name others with --odom, --scan and --reference")
    if reference is not None and not heard.truth:
        raise UnusableLog(f"it has no messages on {reference}", rows.hint)
    named = {odometry: heard.odometry, scan: heard.scans, reference or topics.TRUTH.name: heard.truth}
    unstamped = [topic for topic, said in named.items() if said and not any(one.stamp for *_, one in said)]
    if unstamped:
        rows.notes.append(f"{', '.join(unstamped)}: its stamps are all zero; all times are those of logging")
    by_log = bool(unstamped)
    rows.odometry += _poses(odometry, heard.odometry, by_log, rows.notes)
    rows.truth += _poses(reference or "the truth", heard.truth, by_log, rows.notes)
    rows.initial += _poses(INITIAL_POSE_TOPIC, heard.initial, by_log, rows.notes)
    rows.scans += _scans(scan, heard, by_log, rows.notes)
    others = sorted({one.frame for *_, one in heard.truth if one.frame != "map"})
    if others:
        rows.notes.append(f"{reference} is told in frame {', '.join(others)!r}; it is taken for that of the map")
    return rows


def _collect_messages(path: Path, odometry: str, scan: str, truth: str) -> _Messages:
    told = any(map(parse_frame_pair, (odometry, truth)))
    wanted = {odometry, scan, truth, topics.TF_STATIC.name, INITIAL_POSE_TOPIC, *([topics.TF.name] if told else [])}
    stream, heard = open_messages(path, wanted), _Messages()
    for order, raw in enumerate(stream):
        if raw.topic in (topics.TF_STATIC.name, topics.TF.name):
            links, static = _read(raw, {_TRANSFORMS: messages.transforms}), raw.topic == topics.TF_STATIC.name
            heard.tf.add(raw.time, order, links, static)
            heard.links.update({one.child: one for one in links if static})
        elif raw.topic == INITIAL_POSE_TOPIC:
            heard.initial.append((raw.time, order, _read(raw, messages.POSES)))
        elif raw.topic == scan:
            heard.scans.append((raw.time, order, _read(raw, {_SCAN: messages.laser_scan})))
        elif raw.topic in (odometry, truth):
            said = (raw.time, order, _read(raw, messages.POSES))
            heard.odometry += [said] if raw.topic == odometry else []
            heard.truth += [said] if raw.topic == truth else []
    heard.topics = stream.topics
    return heard


def _read(raw: RawMessage, readers: dict[str, Any]) -> Any:
    if raw.encoding != "cdr" or raw.type not in readers:
        raise UnusableLog(f"{raw.topic} is a {raw.type or 'type without a name'}, expected {' or '.join(readers)}")
    try:
        return readers[raw.type](raw.data)
    except (struct.error, ValueError, OverflowError) as error:
        raise UnusableLog(f"a message of {raw.topic} cannot be read as {raw.type}: {error}") from error


def _time(logged: int, said: Any, by_log: bool) -> float:
    return (logged if by_log else said.stamp) / NS_PER_SECOND


def _poses(topic: str, said: Iterable[LoggedMessage], by_log: bool, notes: list[str]) -> Iterator[PoseRow]:
    """Where something was; what is no place is left out."""
    left_out = 0
    for logged, order, one in said:
        if all_within(one.pose, MAX_COORDINATE_M):
            yield PoseRow(_time(logged, one, by_log), order, planar_pose(one.pose))
        else:
            left_out += 1
    if left_out:
        notes.append(f"{topic}: {left_out} poses are not numbers, or no place that there is; they are left out")


def _scans(topic: str, heard: _Messages, by_log: bool, notes: list[str]) -> Iterator[ScanRow]:
    """Scans as a lidar would have taken them that is the right way up."""
    base = next((one.child for *_, one in heard.odometry if one.child), "")
    mounts: dict[str, LidarMount | None] = {}
    for logged, order, one in heard.scans:
        layout = (one.angle_min, one.angle_increment, one.range_min, one.range_max)
        if any(math.isnan(value) for value in layout) or not all_within(layout[:2], MAX_COORDINATE_M):
            raise UnusableLog(f"a scan of {topic} says that its angles and ranges are {layout}")
        if one.frame not in mounts:
            mounts[one.frame] = lidar_mount(one.frame, base, heard.links)
            if mounts[one.frame] is None:
                told = f"/tf_static does not say where {one.frame!r} is on {base or 'base_link'!r}"
                notes.append(f"{told}: the lidar is taken to be at its origin")
        pose, hangs = mounts[one.frame] or LidarMount((0.0, 0.0, 0.0), False)
        ranges = one.ranges
        if hangs:
            ranges = ranges[::-1]
            layout = (-(one.angle_min + (len(ranges) - 1) * one.angle_increment), *layout[1:])
        yield ScanRow(_time(logged, one, by_log), order, ranges, layout, pose)


def planar_pose(pose: messages.Numbers) -> Triple:
    """x, y and yaw of x, y, z and a unit quaternion."""
    x, y, _, qx, qy, qz, qw = pose
    return x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
