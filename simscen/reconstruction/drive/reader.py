"""Reads a log and converts its messages to a RecordedDrive."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from simscen.core.clock import NS_PER_SECOND
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.reconstruction.drive.goals import find_goals, goals_from_motion, trim_to_first_goal
from simscen.reconstruction.drive.log_messages import (
    MAX_CLOCK_DIFFERENCE_NS,
    LoggedMessage,
    LogMessages,
    PolygonMessage,
    adjust_clock_rate,
    clock_offset,
    collect_messages,
)
from simscen.reconstruction.drive.recorded_drive import (
    DEFAULT_LIDAR_HEIGHT_M,
    Mask,
    Polygon,
    RecordedDrive,
    Scans,
    TimedValues,
    no_values,
)
from simscen.record import topics
from simscen.record.foreign.raw_messages import UnusableLog, is_simscen_log, unusable_log_as_invalid_input
from simscen.record.foreign.tracks import is_twist_missing, velocity_from_poses
from simscen.record.foreign.transforms import TransformTree, UnknownTransform, is_upside_down
from simscen.record.messages.decode import ScanMessage, StampedPose

NO_TRUTH = "none"
"""Value of `truth` to ignore the ground truth of a log."""
TICK_RATE_HZ = 1000
"""Rate of the ticks to which times are rounded for the computation of velocities."""
ODOMETRY = "odometry"
"""Value of `RecordedDrive.pose_source` if the log has no pose of the robot in the map frame."""
MIN_POSES = 2
"""Minimum number of poses of a topic or transform that is used as the source of poses."""
MAX_VALUE = 1e6
"""Limit of valid coordinates, velocities, and covariances in m, rad, and s."""
MIN_RESOLUTION_M = 1e-6
"""Minimum edge length of the cells of a valid map."""
MIN_LIDAR_HEIGHT_M = 0.05
"""Minimum height of a lidar. A lower mount is raised to this height."""
MAX_FOOTPRINT_M = 5.0
"""Maximum coordinate of a usable footprint, in the base frame."""
_UNTIMED_ROLES = frozenset({"map", "tf_static", "footprint", "events"})
"""Roles whose messages can be logged at any time, so that they do not define the start and end of the drive."""


def read_drive(
    path: Path, truth: str | None = None, chosen_topics: Mapping[str, str] = MappingProxyType({}), robot: str = ""
) -> RecordedDrive:
    """Read the drive in an MCAP file or a rosbag2 folder, from the first goal on.

    Raises InvalidInput if the log is unusable.

    truth:          topic of the ground truth; "none" to ignore the ground truth; None to use the ground truth of a
        simscen log. In other logs, None means that there is no ground truth.
    chosen_topics:  topics by role such as "odom", for roles whose topic is not the default
    robot:          in a simscen log with several robots, the robot whose messages are read
    """
    with unusable_log_as_invalid_input(path):
        has_truth = truth is None and not path.is_dir() and is_simscen_log(path)
        if truth is not None and truth != NO_TRUTH:
            chosen_topics = {**chosen_topics, "truth": truth}
        messages = collect_messages(path, chosen_topics, has_truth, robot)
        return trim_to_first_goal(_DriveReader(path, messages).drive())


class _DriveReader:
    """Converts the messages of one log to a RecordedDrive and collects notes for the user."""

    def __init__(self, path: Path, messages: LogMessages) -> None:
        self._path, self._messages = path, messages
        self._notes = messages.notes
        adjust_clock_rate(messages)
        timed_messages = [
            message for role, logged in messages.by_role.items() if role not in _UNTIMED_ROLES for message in logged
        ]
        if not timed_messages:
            names = ", ".join(sorted(messages.topics)[:12]) or "none"
            raise UnusableLog("it has no messages of a drive", f"its topics: {names}; name others with --topic")
        has_events = topics.EVENTS.name in messages.topics
        self._start = 0 if has_events else min(message.log_time for message in timed_messages)
        self._stamp_start = self._start + clock_offset(messages)
        self._end = max(message.log_time for message in timed_messages)
        if not messages.is_complete:
            self._notes.append("what happened after its end, because it is truncated")

    def drive(self) -> RecordedDrive:
        """Return the entire drive, including the time before the first goal."""
        odometry = self._odometry()
        belief = self._signal("amcl_pose", 9, lambda pose: (*Pose3(*pose.pose).plane, *pose.covariance))
        poses, source, is_truth = self._best_poses(odometry, belief)

        def to_map(stamped: StampedPose, time: float) -> Pose2:
            pose = Pose3(*stamped.pose).plane
            if stamped.frame in ("map", ""):
                return pose
            robot_in_frame = self._robot_pose_in(stamped.frame, time, poses, odometry)
            robot_in_map = Pose2(*poses.poses_at(np.array([time]))[0].tolist())
            return robot_in_map.compose(robot_in_frame.between(pose))

        # Without poses in the map frame, the map, the belief, and goals in the map frame cannot be used.
        is_on_map = source != ODOMETRY or self._odom_frame == "map"
        goal_frames = {message.content.frame for message in self._messages.get("goal")}
        if is_on_map or (goal_frames and not goal_frames & {"map", ""}):
            goals = [*find_goals(self._messages, self._seconds, to_map, poses)]
        else:
            goals = [*goals_from_motion(poses)]
        if not goals:
            self._notes.append("a goal, because the robot got no goal and did not drive anywhere")
        return RecordedDrive(
            name=self._path.stem,
            duration=self._seconds(self._end),
            poses=poses,
            pose_source=source,
            has_true_poses=is_truth,
            belief=belief if is_on_map else no_values(9),
            corrections=self._poses_of_tf("map", self._odom_frame) or no_values(3),
            odometry=odometry,
            commands=self._signal("cmd_vel", 3, lambda twist: twist.values),
            turn_rates=self._signal("imu", 1, lambda imu: (imu.turn_rate,)),
            bumper=self._signal("bumper", 1, lambda is_pressed: (float(is_pressed),)),
            scans=self._scans(),
            map=self._map() if is_on_map else None,
            goals=tuple(
                goal if goal.name else replace(goal, name=f"goal-{number}") for number, goal in enumerate(goals, 1)
            ),
            footprint=self._footprint(poses, odometry),
            notes=tuple(self._notes),
        )

    def _seconds(self, logged: int) -> float:
        """Convert a log time in ns to s since the start of the drive."""
        return (logged - self._start) / NS_PER_SECOND

    def _times(self, role: str, messages: Sequence[LoggedMessage]) -> tuple[Array, Array]:
        """Return the times of measurement (n,) and the log times (n,) of messages, in s since the start of the drive.

        Raises UnusableLog if the clock of the stamps jumps by more than the duration of the log.
        """
        logged = np.array([message.log_time for message in messages], dtype=np.int64)
        stamps = np.array([message.stamp for message in messages], dtype=np.int64)
        is_stamped = stamps != 0
        jumps = np.abs(np.diff((stamps - logged)[is_stamped]))
        if (jumps > max(MAX_CLOCK_DIFFERENCE_NS, self._end - self._start)).any():
            seconds = jumps.max() / NS_PER_SECOND
            raise UnusableLog(f"the stamps of the topic for `{role}` jump by {seconds:.1f} s", "cut the log there")
        arrivals = (logged - self._start) / NS_PER_SECOND
        return np.where(is_stamped, (stamps - self._stamp_start) / NS_PER_SECOND, arrivals), arrivals

    def _signal(self, role: str, columns: int, row_of: Callable[[Any], Sequence[float]]) -> TimedValues:
        """Return the valid values of a role as a signal. `row_of` converts a decoded message to a row of values."""
        messages = self._messages.get(role)
        if not messages:
            return no_values(columns)
        times, arrivals = self._times(role, messages)
        rows = [tuple(row_of(message.content)) for message in messages]
        values = np.array(rows, dtype=np.float64).reshape(len(messages), columns)
        is_valid: Mask = np.all(np.abs(values) < MAX_VALUE, axis=1)  # also false for nan
        if not is_valid.all():
            self._notes.append(f"valid numbers in {int((~is_valid).sum())} messages of `{role}`, which are ignored")
        order = np.argsort(times, kind="stable")
        order = order[is_valid[order]]
        return TimedValues(times[order], values[order], arrivals[order])

    def _odometry(self) -> TimedValues:
        """Return the odometry. If all twists are zero although the robot moves, compute the twists from the poses."""
        signal = self._signal("odom", 6, lambda odom: (*Pose3(*odom.pose).plane, *(odom.twist or (0.0, 0.0, 0.0))))
        if not is_twist_missing(signal.values[:, 3:], signal.values[:, :3]):
            return signal
        self._notes.append("velocities in the odometry; they are computed from its poses")
        ticks, indices = np.unique(np.rint(signal.times * TICK_RATE_HZ).astype(np.int64), return_index=True)
        poses = signal.values[indices, :3]
        velocities = velocity_from_poses(ticks, poses, TICK_RATE_HZ)
        return TimedValues(signal.times[indices], np.column_stack((poses, velocities)), signal.arrivals[indices])

    def _best_poses(self, odometry: TimedValues, belief: TimedValues) -> tuple[TimedValues, str, bool]:
        """Return the best known poses in the map frame, their source in words, and whether they are a ground truth."""
        truth = self._signal("truth", 3, lambda truth: Pose3(*truth.pose).plane)
        if len(truth):
            return truth, "ground truth", True
        if self._messages.get("truth"):
            raise UnusableLog(f"the ground truth has no pose with valid coordinates (below {MAX_VALUE:g} m)")
        for base in self._base_frames:
            poses = self._poses_of_tf("map", base)
            if poses is not None:
                return poses, f"transform from map to {base}", False
        if len(belief) >= MIN_POSES and len(odometry) >= MIN_POSES:
            return _belief_along_odometry(belief, odometry), "/amcl_pose with the odometry in between", False
        if len(belief) >= MIN_POSES:
            return TimedValues(belief.times, belief.values[:, :3], belief.arrivals), "/amcl_pose", False
        odometry_of_tf = (self._poses_of_tf(self._odom_frame, base) for base in self._base_frames)
        best_odometry = odometry if len(odometry) >= MIN_POSES else next(filter(None, odometry_of_tf), None)
        if best_odometry is not None:
            self._notes.append("poses in a map; the odometry is used, and the map is built along it")
            values = best_odometry.values[:, :3]
            return TimedValues(best_odometry.times, values, best_odometry.arrivals), ODOMETRY, False
        types = sorted(self._messages.topics.items())
        names = [name for name, message_type in types if "Pose" in message_type or "Odometry" in message_type]
        candidates = f"; topics with poses: {', '.join(names[:12])}" if names else ""
        raise UnusableLog("it has no poses of the robot", f"name a topic with --topic odom=/TOPIC{candidates}")

    def _poses_of_tf(self, outer: str, inner: str) -> TimedValues | None:
        """Return the poses x, y, yaw of the frame `inner` in `outer`; None if /tf does not contain usable poses."""
        try:
            _, logged, stamped, poses = self._transforms.track(outer, inner)
        except UnknownTransform:
            return None
        except UnusableLog as error:
            self._notes.append(f"usable poses on tf {outer}:{inner}: {error}")
            return None
        if len(poses) < MIN_POSES:
            return None
        arrivals = (logged - self._start) / NS_PER_SECOND
        times = arrivals if stamped is None else (stamped.stamps - self._stamp_start) / NS_PER_SECOND
        order = np.argsort(times, kind="stable")
        planar = np.array([Pose3(*pose).plane for pose in poses[order].tolist()])
        return TimedValues(times[order], planar, arrivals[order])

    @cached_property
    def _transforms(self) -> TransformTree:
        """All transforms of the log."""
        tree = TransformTree()
        for role in ("tf_static", "tf"):
            for message in self._messages.get(role):
                tree.add(message.log_time, message.content, is_static=role == "tf_static")
        return tree

    def _scans(self) -> Scans | None:
        """Return the scans of the lidar frame with the most scans; None without valid scans."""
        messages = self._messages.get("scan")
        if not messages:
            return None
        frames = Counter(message.content.frame for message in messages)
        frame = min(frames, key=lambda name: (-frames[name], name))
        messages = [message for message in messages if message.content.frame == frame]
        beam_count = Counter(len(message.content.ranges) for message in messages).most_common(1)[0][0]
        times, arrivals = self._times("scan", messages)
        order = np.argsort(times, kind="stable")
        first: ScanMessage = next(message.content for message in messages if len(message.content.ranges) == beam_count)
        layout = first.angle_min, first.angle_increment, first.range_min, first.range_max
        has_valid_layout = first.angle_increment and np.isfinite(layout[:3]).all() and first.range_max > 0.0
        if beam_count < 2 or not has_valid_layout:
            self._notes.append(f"usable scans of `{frame}`, because their angles or range limits are invalid")
            return None
        measured = [messages[index].content.ranges for index in order.tolist()]
        is_malformed = np.array([len(values) != beam_count for values in measured])
        no_ranges = np.full(beam_count, np.nan)
        ranges = np.array([values if len(values) == beam_count else no_ranges for values in measured])
        mount, height, is_flipped = self._mount(frame)
        angles = first.angle_min + first.angle_increment * np.arange(beam_count, dtype=np.float64)
        angles = -angles if is_flipped else angles
        if angles[1] < angles[0]:  # the estimators expect ascending angles
            angles, ranges = angles[::-1], ranges[:, ::-1]
        limits = first.range_min, first.range_max
        return Scans(times[order], arrivals[order], ranges, angles, *limits, mount, height, is_malformed)

    def _mount(self, frame: str) -> tuple[Pose2, float, bool]:
        """Return the pose of the lidar on the base, its height in m, and whether it is upside down."""
        mount = self._transforms.sensor_mount(frame, self._base_frames[0])
        if mount is None:
            self._notes.append(f"the mount of the lidar `{frame}`; the lidar is assumed at the base")
            return Pose2(0.0, 0.0, 0.0), DEFAULT_LIDAR_HEIGHT_M, False
        return mount.plane, max(mount.z, MIN_LIDAR_HEIGHT_M), is_upside_down(mount)

    def _map(self) -> OccupancyGrid | None:
        """Return the last map; None without a valid map."""
        maps = self._messages.get("map")
        grid: OccupancyGrid | None = maps[-1].content if maps else None
        if grid is None:
            return None
        is_valid = MIN_RESOLUTION_M <= grid.resolution < np.inf and np.isfinite(grid.origin).all()
        if not is_valid or not grid.cells.size:
            self._notes.append("a usable map, because its map has no cells, or an invalid resolution or origin")
            return None
        # The message rounds the resolution to single precision.
        return OccupancyGrid(grid.cells, round(grid.resolution, 6), grid.origin)

    def _footprint(self, poses: TimedValues, odometry: TimedValues) -> Polygon:
        """Return the first footprint, in the base frame; () if the log has no usable footprint.

        Nav2 publishes the footprint in the frame of the local costmap. `poses` are the poses in the map frame.
        """
        messages = self._messages.get("footprint")
        if not messages:
            return ()
        polygon: PolygonMessage = messages[0].content
        corners = np.array(polygon.corners, dtype=np.float64).reshape(-1, 2)
        time = float(self._times("footprint", messages[:1])[0][0])
        corners = self._robot_pose_in(polygon.frame, time, poses, odometry).inverse().apply(corners)
        if len(corners) < 3 or not np.abs(corners).max() <= MAX_FOOTPRINT_M:  # also false for nan
            return ()
        return tuple((round(a, 3), round(b, 3)) for a, b in corners.tolist())

    @cached_property
    def _odom_frame(self) -> str:
        """Name of the frame of the odometry."""
        return next((message.content.frame for message in self._messages.get("odom")), "odom")

    @cached_property
    def _base_frames(self) -> tuple[str, ...]:
        """Possible names of the base frame, in the order in which they are tried: child frames of odometry first."""
        child_frames = (message.content.child for message in self._messages.get("odom") if message.content.child)
        return tuple(dict.fromkeys((*child_frames, "base_link", "base_footprint")))

    def _robot_pose_in(self, frame: str, time: float, poses: TimedValues, odometry: TimedValues) -> Pose2:
        """Return the pose of the robot in a frame at a time in s; in the map frame if the frame is unknown.

        `poses` are the poses in the map frame.
        """
        if frame in self._base_frames:
            return Pose2(0.0, 0.0)
        poses_of_tf = (self._poses_of_tf(frame, base) for base in self._base_frames)
        is_odom = len(odometry) and frame == self._odom_frame
        poses_in_frame = odometry if is_odom else next(filter(None, poses_of_tf), poses)
        return Pose2(*poses_in_frame.poses_at(np.array([time]))[0].tolist())


def _belief_along_odometry(belief: TimedValues, odometry: TimedValues) -> TimedValues:
    """Return poses in the map frame at the times of the odometry: the latest belief plus the odometry since then."""
    odometry_at_belief = odometry.poses_at(belief.times)
    corrections = [
        Pose2(*pose).compose(Pose2(*odom).inverse())
        for pose, odom in zip(belief.values[:, :3].tolist(), odometry_at_belief.tolist(), strict=True)
    ]
    indices = np.maximum(np.searchsorted(belief.times, odometry.times, side="right") - 1, 0)
    poses = [
        corrections[index].compose(Pose2(*pose))
        for index, pose in zip(indices.tolist(), odometry.values[:, :3].tolist(), strict=True)
    ]
    return TimedValues(odometry.times, np.array(poses), odometry.arrivals)
