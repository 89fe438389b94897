"""Reader of localization logs in ROS 2 formats: MCAP files and rosbag2 folders."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.clock import NS_PER_SECOND
from simscen.core.geometry import Pose3
from simscen.record import topics
from simscen.record.foreign.options import parse_frame_pair
from simscen.record.foreign.raw_messages import (
    InvalidPose,
    RawMessage,
    UnusableLog,
    invalid_pose_notes,
    open_messages,
)
from simscen.record.foreign.transforms import TransformTree, UnknownTransform, is_upside_down
from simscen.record.localization_logs.rows import (
    MAX_COORDINATE_M,
    LocalizationRows,
    PoseRow,
    ScanRow,
    all_within,
)
from simscen.record.messages.decode import POSE_DECODERS, StampedPose, laser_scan, transforms

INITIAL_POSE_TOPIC = "/initialpose"
"""Topic of the initial pose for AMCL."""

LoggedMessage = tuple[int, int, Any]
"""Time of logging in ns, index in the order of logging, and decoded message."""


@dataclass
class _Messages:
    """Decoded messages of a log.

    Attributes:
        odometry: Messages on the topic of the odometry.
        scans: Messages on the topic of the scans.
        truth: Messages on the topic of the reference poses.
        initial_poses: Messages on INITIAL_POSE_TOPIC.
        transforms: All transforms.
        tf_indices: Index of the message with transforms, by its time of logging in ns.
        topics: Message types of all topics, by topic.
        is_complete: False if the log is truncated.
        notes: Remarks for the user.
    """

    odometry: list[LoggedMessage] = field(default_factory=list)
    scans: list[LoggedMessage] = field(default_factory=list)
    truth: list[LoggedMessage] = field(default_factory=list)
    initial_poses: list[LoggedMessage] = field(default_factory=list)
    transforms: TransformTree = field(default_factory=TransformTree)
    tf_indices: dict[int, int] = field(default_factory=dict)
    topics: dict[str, str] = field(default_factory=dict)
    is_complete: bool = True
    notes: list[str] = field(default_factory=list)

    def sort_by_time(self) -> None:
        """Sort all messages by the time of logging, and assign new indices: an MCAP file may have any order.

        Messages of the same time keep their order.
        """
        all_messages = (self.odometry, self.scans, self.truth, self.initial_poses)
        times = [*self.tf_indices.items(), *((time, index) for messages in all_messages for time, index, _ in messages)]
        new_indices = {index: new_index for new_index, (_, index) in enumerate(sorted(times))}
        for messages in all_messages:
            messages[:] = sorted((time, new_indices[index], message) for time, index, message in messages)
        self.tf_indices = {time: new_indices[index] for time, index in self.tf_indices.items()}

    def poses_from_tf(self, outer: str, inner: str) -> list[LoggedMessage]:
        """Return the poses of the frame `inner` in `outer` as messages. Raises UnusableLog if the poses are unknown."""
        try:
            _, times, stamped, poses = self.transforms.track(outer, inner)
        except UnknownTransform:
            raise
        except UnusableLog as error:  # replace its hint, which is about the options of `simscen judge`
            hint = "name a topic instead of two frames, or cut the log where its clock was set"
            raise UnusableLog(str(error), hint) from error
        stamps = [0] * len(times) if stamped is None else stamped.stamps.tolist()
        return [
            (time, self.tf_indices[time], StampedPose(stamp, outer, tuple(pose), child=inner))
            for time, stamp, pose in zip(times.tolist(), stamps, poses.tolist(), strict=True)
        ]


def read_rosbag_rows(path: Path, odometry: str, scan: str, reference: str | None) -> LocalizationRows:
    """Read an MCAP file or a rosbag2 folder. Raises UnusableLog if messages cannot be used.

    The times of rows are stamps. If all stamps of a topic are zero, the times of all rows are times of logging instead.
    The mount of the lidar is read from /tf_static or /tf.

    odometry:   topic, or pair of frames on /tf such as `odom:base_link`
    scan:       topic
    reference:  topic or pair of frames of the reference poses; None for the ground truth in a log of simscen
    """
    messages = _collect_messages(path, odometry, scan, reference or topics.TRUTH.name)
    if frames := parse_frame_pair(odometry):
        messages.odometry = messages.poses_from_tf(*frames)
    if reference is not None and (frames := parse_frame_pair(reference)):
        messages.truth = messages.poses_from_tf(*frames)
    names = ", ".join(sorted(messages.topics)[:12]) or "none"
    rows = LocalizationRows(hint=f"its topics: {names}; name others with --odom, --scan and --reference")
    if reference is not None and not messages.truth:
        raise UnusableLog("; ".join((f"it has no messages on {reference}", *messages.notes)), rows.hint)
    rows.notes += messages.notes
    if not messages.is_complete:
        rows.notes.append("the log is truncated")
    truth = reference or topics.TRUTH.name
    by_topic = {odometry: messages.odometry, scan: messages.scans, truth: messages.truth}
    unstamped = [topic for topic, logged in by_topic.items() if logged and not any(m.stamp for *_, m in logged)]
    if unstamped:
        names = ", ".join(unstamped)
        rows.notes.append(f"{names}: all stamps are zero, so the times of logging are used for all topics")
    use_log_time = bool(unstamped)
    rows.odometry += _pose_rows(odometry, messages.odometry, use_log_time, rows.notes)
    rows.truth += _pose_rows(truth, messages.truth, use_log_time, rows.notes)
    rows.initial_poses += _pose_rows(INITIAL_POSE_TOPIC, messages.initial_poses, use_log_time, rows.notes)
    rows.scans += _scan_rows(scan, messages, use_log_time, rows.notes)
    truth_frames = sorted({pose.frame for *_, pose in messages.truth if pose.frame != "map"})
    if truth_frames:
        rows.notes.append(f"{truth} is in the frame {', '.join(truth_frames)!r}, which is used as the map frame")
    return rows


def _collect_messages(path: Path, odometry: str, scan: str, truth: str) -> _Messages:
    """Return the decoded messages on three topics, INITIAL_POSE_TOPIC, /tf, and /tf_static, in the order of logging."""
    stream = open_messages(path, {odometry, scan, truth, topics.TF.name, topics.TF_STATIC.name, INITIAL_POSE_TOPIC})
    messages = _Messages()
    invalid_poses: Counter[str] = Counter()
    for index, raw in enumerate(stream):
        try:
            _add_message(messages, index, raw, odometry, scan, truth)
        except InvalidPose:
            invalid_poses[raw.topic] += 1
    messages.topics, messages.is_complete = stream.topics, stream.is_complete
    messages.notes += invalid_pose_notes(invalid_poses)
    messages.sort_by_time()
    return messages


def _add_message(messages: _Messages, index: int, raw: RawMessage, odometry: str, scan: str, truth: str) -> None:
    """Decode the message with this index in the log, and add it to `messages`. Raises InvalidPose or UnusableLog."""
    if raw.topic in (topics.TF_STATIC.name, topics.TF.name):
        links = raw.decode({topics.TF.type: transforms})
        messages.transforms.add(raw.time, links, is_static=raw.topic == topics.TF_STATIC.name)
        messages.tf_indices[raw.time] = index
    elif raw.topic == INITIAL_POSE_TOPIC:
        messages.initial_poses.append((raw.time, index, raw.decode(POSE_DECODERS)))
    elif raw.topic == scan:
        messages.scans.append((raw.time, index, raw.decode({topics.SCAN_TYPE: laser_scan})))
    elif raw.topic in (odometry, truth):
        pose = raw.time, index, raw.decode(POSE_DECODERS)
        messages.odometry += [pose] if raw.topic == odometry else []
        messages.truth += [pose] if raw.topic == truth else []


def _time_in_seconds(logged: int, message: Any, use_log_time: bool) -> float:
    return (logged if use_log_time else message.stamp) / NS_PER_SECOND


def _pose_rows(
    topic: str, messages: Iterable[LoggedMessage], use_log_time: bool, notes: list[str]
) -> Iterator[PoseRow]:
    """Yield the valid poses. Add a note with the number of invalid poses to `notes`."""
    invalid = 0
    for logged, index, message in messages:
        if all_within(message.pose, MAX_COORDINATE_M):
            yield PoseRow(_time_in_seconds(logged, message, use_log_time), index, Pose3(*message.pose).plane)
        else:
            invalid += 1
    if invalid:
        notes.append(f"{topic}: {invalid} poses with invalid coordinates are ignored")


def _scan_rows(topic: str, messages: _Messages, use_log_time: bool, notes: list[str]) -> Iterator[ScanRow]:
    """Yield the scans. Mirror the scans of a lidar that is mounted upside down. Add problems with tf to `notes`."""
    base = next((pose.child for *_, pose in messages.odometry if pose.child), "")
    mounts: dict[str, Pose3 | None] = {}
    for logged, index, scan in messages.scans:
        layout = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
        if any(math.isnan(value) for value in layout) or not all_within(layout[:2], MAX_COORDINATE_M):
            raise UnusableLog(f"a scan of {topic} has invalid angles or range limits: {layout}")
        if scan.frame not in mounts:
            mounts[scan.frame] = messages.transforms.sensor_mount(scan.frame, base)
            if mounts[scan.frame] is None:
                frames = f"{scan.frame!r} and {base or 'base_link'!r}"
                notes.append(f"tf does not connect {frames}; the lidar is assumed to be at the base")
        mount, ranges = mounts[scan.frame] or Pose3(), scan.ranges
        if is_upside_down(mount):
            ranges = ranges[::-1]
            layout = (-(scan.angle_min + (len(ranges) - 1) * scan.angle_increment), *layout[1:])
        yield ScanRow(_time_in_seconds(logged, scan, use_log_time), index, ranges, layout, mount.plane)
