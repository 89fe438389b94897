"""Odometry, scans and a reference from the messages of ROS 2."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

from simscen.core.geometry import Pose3
from simscen.record import topics
from simscen.record.foreign import messages
from simscen.record.foreign.bagfolder import messages_of
from simscen.record.foreign.mcapfile import Raw
from simscen.record.foreign.sensedrows import Range, Rows, Stamped, Triple
from simscen.record.foreign.unusable import Unusable
from simscen.record.simtime import SECOND

_SCAN, _TRANSFORMS = "sensor_msgs/msg/LaserScan", "tf2_msgs/msg/TFMessage"
_BASES = ("base_link", "base_footprint")


def ros_rows(path: Path, odometry: str, scan: str, reference: str | None) -> Rows:
    """The rows of an MCAP file or a rosbag2 folder, in the order of logging, at the times of their headers.

    Without a `reference`, the truth of simscen's own logs is one. The lidar's mount is what /tf_static says.
    """
    truth = reference or topics.TRUTH.name
    wanted = {odometry, scan, truth, topics.TF_STATIC.name}
    stream, rows, links = messages_of(path, wanted), Rows(), {}
    scans: list[tuple[int, str, int, Any]] = []
    for order, raw in enumerate(stream):
        if raw.topic not in wanted:
            continue
        if raw.topic == topics.TF_STATIC.name:
            links.update({one.child: one for one in _read(raw, {_TRANSFORMS: messages.transforms})})
            continue
        if raw.topic == scan:
            one = _read(raw, {_SCAN: messages.laser_scan})
            scans.append((one.stamp, one.frame, order, one))
        if raw.topic == odometry:
            rows.odometry.append(_stamped(_read(raw, messages.POSES), order))
        if raw.topic == truth:
            rows.truth.append(_stamped(_read(raw, messages.POSES), order))
    for stamp, frame, order, one in scans:
        layout = (one.angle_min, one.angle_increment, one.range_min, one.range_max)
        rows.scans.append(Range(stamp / SECOND, order, one.ranges, layout, _mount(frame, links)))
    if reference is not None and not rows.truth:
        raise Unusable(f"it has no messages on {reference}", _told(stream.topics))
    rows.hint = _told(stream.topics)
    return rows


def _told(known: dict[str, str]) -> str:
    return f"its topics: {', '.join(sorted(known)[:12]) or 'none'}; name others with --odom, --scan and --reference"


def _read(raw: Raw, readers: dict[str, Any]) -> Any:
    if raw.encoding != "cdr" or raw.type not in readers:
        raise Unusable(f"{raw.topic} is a {raw.type or 'type without a name'}, expected {' or '.join(readers)}")
    try:
        return readers[raw.type](raw.data)
    except (struct.error, ValueError, OverflowError) as error:
        raise Unusable(f"a message of {raw.topic} cannot be read as {raw.type}: {error}") from error


def _stamped(posed: messages.Posed, order: int) -> Stamped:
    return Stamped(posed.stamp / SECOND, order, _plane(posed.pose))


def _plane(pose: messages.Numbers) -> Triple:
    x, y, _, qx, qy, qz, qw = pose
    return x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))


def _mount(frame: str, links: dict[str, messages.Posed]) -> Triple:
    """Where a lidar is on the base, by the chain of static transforms; at its origin where they do not say."""
    pose, seen = Pose3(0, 0, 0, 0, 0, 0, 1), set()
    while frame in links and frame not in _BASES and frame not in seen:
        seen.add(frame)
        link = links[frame]
        pose, frame = Pose3(*link.pose).compose(pose), link.frame
    if frame not in _BASES:
        return 0.0, 0.0, 0.0
    return _plane((*pose.position, *pose.quaternion))
