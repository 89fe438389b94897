"""Tests of `simscen localize` on logs of real recorders: rosbag2 folders, unusual mounts and clocks, invalid data."""

import json
import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the rosbags package is not installed")
from rosbags.rosbag2 import StoragePlugin

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
sys.path.insert(0, str(Path(__file__).parent))
from foreign_logs import BEGIN, LATENCY, SECOND, STORE, Message, T, header, pose, write_bag, write_mcap
from recorded_drives import drive, ranges_at, write_map

from simscen.core.geometry import Pose2

OPTIONS = ("--map", "room.yaml", "--robot", "turtlebot")
ROLL = math.pi


def transform(child: str, parent: str, x: float, yaw: float, roll: float = 0.0) -> Any:
    """Return a tf2_msgs/TFMessage with one transform: fixed-axis roll, then yaw."""
    half_roll, half_yaw = roll / 2, yaw / 2
    rotation = T["geometry_msgs/msg/Quaternion"](
        x=math.sin(half_roll) * math.cos(half_yaw),
        y=math.sin(half_roll) * math.sin(half_yaw),
        z=math.cos(half_roll) * math.sin(half_yaw),
        w=math.cos(half_roll) * math.cos(half_yaw),
    )
    relative_pose = T["geometry_msgs/msg/Transform"](
        translation=T["geometry_msgs/msg/Vector3"](x=x, y=0.0, z=0.2), rotation=rotation
    )
    stamped_transform = T["geometry_msgs/msg/TransformStamped"](
        header=header(BEGIN, parent), child_frame_id=child, transform=relative_pose
    )
    return T["tf2_msgs/msg/TFMessage"](transforms=[stamped_transform])


def drive_log(
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0),
    base: str = "base_link",
    stamp: Callable[[int], int] = lambda time: time,
    frame: str = "laser",
    every: int = 1,
) -> list[Message]:
    """Return the drive as messages: /odom, /scan of a lidar at `mount` (x, yaw, roll), and the true poses /gt."""
    forward, mount_yaw, roll = mount
    messages = [Message("/tf_static", BEGIN, transform("laser", base, forward, mount_yaw, roll))]
    for t, (x, y, yaw), odom in drive()[::every]:
        time = BEGIN + round(t * SECOND)
        messages.append(Message("/odom", time + LATENCY, odometry(stamp(time), odom, base)))
        messages.append(Message("/gt", time + LATENCY, stamped(stamp(time), (x, y, yaw))))
        lidar_pose = (x + forward * math.cos(yaw), y + forward * math.sin(yaw), yaw + mount_yaw)
        ranges = ranges_at(*lidar_pose)
        messages.append(Message("/scan", time + LATENCY, scan(stamp(time), ranges[::-1] if roll else ranges, frame)))
    return messages


def odometry(time: int, at: tuple[float, float, float], base: str) -> Any:
    pose_estimate = T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(*at), covariance=np.zeros(36))
    zero = T["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
    twist = T["geometry_msgs/msg/TwistWithCovariance"](
        twist=T["geometry_msgs/msg/Twist"](linear=zero, angular=zero), covariance=np.zeros(36)
    )
    return T["nav_msgs/msg/Odometry"](header=header(time, "odom"), child_frame_id=base, pose=pose_estimate, twist=twist)


def stamped(time: int, at: tuple[float, float, float], frame: str = "map") -> Any:
    return T["geometry_msgs/msg/PoseStamped"](header=header(time, frame), pose=pose(*at))


def scan(time: int, ranges: Iterable[float], frame: str, first: float = -math.pi / 2) -> Any:
    return T["sensor_msgs/msg/LaserScan"](
        header=header(time, frame), angle_min=first, angle_max=math.pi / 2, angle_increment=math.pi / 180,
        time_increment=0.0, scan_time=0.1, range_min=0.05, range_max=15.0,
        ranges=np.array(ranges, dtype=np.float32), intensities=np.zeros(0, dtype=np.float32),
    )  # fmt: skip


WITHOUT_SETTLING = """
stack: {localizer: {type: scan_matching_amcl, settling_distance: 0}}
pass: [{localization_error: {rmse: 10 cm}}]
"""
"""All scans have full weight from the start, so that the mount of the lidar determines the error."""


def localized(simscen, *arguments: str) -> dict[str, Any]:
    """Return the JSON output of `simscen localize` for a valid log, with stderr as `err`."""
    result = simscen("localize", *arguments, *OPTIONS, "--reference", "/gt", "--json")
    assert result.code == 0, result.err
    output: dict[str, Any] = json.loads(result.out)
    return output | {"err": result.err}


def test_all_kinds_of_ros_logs_give_the_same_errors(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    messages = drive_log()
    write_mcap(tmp_path / "drive.mcap", messages)
    write_mcap(tmp_path / "unordered.mcap", [*messages[::2], *messages[1::2]])
    write_bag(tmp_path / "sqlite", messages)
    write_bag(tmp_path / "mcap", messages, StoragePlugin.MCAP)
    write_bag(tmp_path / "compressed", messages, compress="message")
    outputs = [localized(simscen, log) for log in ("drive.mcap", "unordered.mcap", "sqlite", "mcap", "compressed")]
    assert outputs[0]["scans"] == 150
    assert outputs[0]["error"]["max"] < 0.2
    assert outputs[0]["lost"] == []
    assert all(output["error_over_time"] == outputs[0]["error_over_time"] for output in outputs)


def link(child: str, parent: str, time: int, at: Pose2) -> Any:
    """Return a tf2_msgs/TFMessage with one planar transform."""
    relative_pose = T["geometry_msgs/msg/Transform"](
        translation=T["geometry_msgs/msg/Vector3"](x=at.x, y=at.y, z=0.0), rotation=pose(*at).orientation
    )
    stamped_transform = T["geometry_msgs/msg/TransformStamped"](
        header=header(time, parent), child_frame_id=child, transform=relative_pose
    )
    return T["tf2_msgs/msg/TFMessage"](transforms=[stamped_transform])


def tf_drive_log() -> Iterable[Message]:
    """Yield the drive with tf (map → odom → base_link) instead of /odom and /gt."""
    for message in drive_log():
        if message.topic in ("/tf_static", "/scan"):
            yield message
    for t, true_pose, odom in drive():
        time, at = BEGIN + round(t * SECOND), Pose2(*odom)
        yield Message("/tf", time + LATENCY - 2, link("odom", "map", time, Pose2(*true_pose).compose(at.inverse())))
        yield Message("/tf", time + LATENCY - 1, link("base_link", "odom", time, at))


def test_odometry_and_reference_can_be_tf_frames(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_bag(tmp_path / "topics", drive_log())
    write_bag(tmp_path / "tf", sorted(tf_drive_log(), key=lambda entry: entry.time))
    by_topics = localized(simscen, "topics")
    result = simscen("localize", "tf", *OPTIONS, "--odom", "odom:base_link", "--reference", "map:base_link", "--json")
    by_tf = json.loads(result.out)
    assert by_tf["scans"] == by_topics["scans"]
    assert by_tf["error"] == pytest.approx(by_topics["error"], abs=1e-6)
    result = simscen("localize", "tf", *OPTIONS, "--odom", "odom:base", "--reference", "map:base_link")
    assert result.code == 2
    assert "tf does not connect odom with base; frames: base_link, laser, map, odom" in result.err


def test_frames_with_an_unusable_clock_have_a_hint_that_fits_the_command(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    links = [Message("/tf", BEGIN + k * SECOND, link("base_link", "odom", BEGIN, Pose2(0.1 * k, 0))) for k in range(9)]
    write_bag(tmp_path / "tf", [*links, *(message for message in drive_log() if message.topic == "/scan")])
    result = simscen("localize", "tf", *OPTIONS, "--odom", "odom:base_link")
    assert result.code == 2
    assert "do not advance" in result.err and "name a topic instead of two frames" in result.err
    assert "--time log" not in result.err  # simscen localize has no such option


def test_start_is_initialpose_without_a_reference(simscen, tmp_path: Path) -> None:
    """The pose on /initialpose can be published later than the start of the log."""
    write_map(tmp_path)
    messages = [message for message in drive_log() if message.topic != "/gt"]
    t, true_pose, _ = drive()[60]
    time = BEGIN + round(t * SECOND)
    pose_estimate = T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(*true_pose), covariance=np.zeros(36))
    initial_pose = T["geometry_msgs/msg/PoseWithCovarianceStamped"](header=header(time, "map"), pose=pose_estimate)
    unstamped = replace(initial_pose, header=header(0, "map"))
    write_bag(tmp_path / "stamped", [*messages, Message("/initialpose", time + LATENCY, initial_pose)])
    write_bag(tmp_path / "unstamped", [*messages, Message("/initialpose", time + LATENCY, unstamped)])
    write_bag(tmp_path / "without", messages)
    x, y, _ = drive()[-1][1]
    for log in ("stamped", "unstamped"):
        result = simscen("localize", log, *OPTIONS, "--json")
        assert json.loads(result.out)["end"][:2] == pytest.approx([x, y], abs=0.15), log
    assert simscen("localize", "without", *OPTIONS).code == 2


@pytest.mark.parametrize(
    ("mount", "base"),
    [((0.25, 0.0, 0.0), "base_link"), ((0.1, 2.0, 0.0), "chassis"), ((-0.2, 0.5, ROLL), "robot1/base_footprint")],
    ids=["in front", "rotated, with another base frame", "upside down"],
)
@pytest.mark.parametrize("topic", ["/tf_static", "/tf"])
def test_lidar_mount_is_read_from_tf(
    simscen, tmp_path: Path, mount: tuple[float, float, float], base: str, topic: str
) -> None:
    write_map(tmp_path)
    log = drive_log(mount, base)
    write_bag(
        tmp_path / "bag", [replace(entry, topic=topic) if entry.topic == "/tf_static" else entry for entry in log]
    )
    (tmp_path / "stack.yaml").write_text(WITHOUT_SETTLING)
    output = localized(simscen, "bag", "--scenario", "stack.yaml")
    assert output["error"]["max"] < 0.2
    assert "note:" not in output["err"]


Layout = tuple[float, float, int]
"""First angle, increment, and number of beams."""
DEGREE, SIDE = math.pi / 180, math.pi / 2


def log_with_layout(
    layout: Layout, change: Callable[[np.ndarray], Iterable[float]] = lambda ranges: ranges
) -> list[Message]:
    """Return the drive with the scans of a lidar with another beam layout."""
    first, step, count = layout
    angles, entries, poses = first + step * np.arange(count), [], iter(drive())
    for entry in drive_log():
        if entry.topic == "/scan":
            ranges = change(np.array(ranges_at(*next(poses)[1], angles)))
            message = scan(
                entry.message.header.stamp.sec * SECOND + entry.message.header.stamp.nanosec, ranges, "laser"
            )
            message = replace(message, angle_min=first, angle_increment=step, angle_max=angles[-1])
            entries.append(replace(entry, message=message))
        else:
            entries.append(entry)
    return entries


def with_invalid(ranges: np.ndarray) -> np.ndarray:
    """Return the ranges with a quarter of the beams invalid, in each form that drivers use."""
    ranges[::4] = np.resize([0.0, math.nan, math.inf, -1.0, 1e30], len(ranges[::4]))
    return ranges


@pytest.mark.parametrize(
    ("layout", "change"),
    [
        ((-SIDE, DEGREE / 2, 361), lambda ranges: ranges),
        ((SIDE, -DEGREE / 2, 361), lambda ranges: ranges),
        ((SIDE, -DEGREE, 181), with_invalid),
        ((0.0, DEGREE, 360), with_invalid),
    ],
    ids=["361 beams", "361 beams clockwise", "clockwise, a quarter invalid", "360 degrees from the front"],
)
def test_all_beam_layouts_are_read(
    simscen, tmp_path: Path, layout: Layout, change: Callable[[np.ndarray], np.ndarray]
) -> None:
    write_map(tmp_path)
    write_mcap(tmp_path / "drive.mcap", log_with_layout(layout, change))
    (tmp_path / "stack.yaml").write_text(WITHOUT_SETTLING)
    output = localized(simscen, "drive.mcap", "--scenario", "stack.yaml")
    assert output["error"]["max"] < 0.2
    assert output["error"]["median"] < 0.06  # odometry alone: 0.21 m
    assert "note:" not in output["err"]


def test_empty_scans_are_reported(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    blind = log_with_layout((-SIDE, DEGREE, 181), lambda ranges: np.zeros(len(ranges)))
    write_mcap(tmp_path / "drive.mcap", blind)
    assert "150 of 150 scans have no range" in localized(simscen, "drive.mcap")["err"]


def test_lidar_without_mount_is_reported(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_mcap(tmp_path / "drive.mcap", drive_log(frame="velodyne"))
    output = localized(simscen, "drive.mcap")
    assert "tf does not connect 'velodyne' and 'base_link'" in output["err"]
    assert output["error"]["max"] < 0.2


def test_missing_stamps_are_replaced_by_log_times(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_mcap(tmp_path / "drive.mcap", drive_log(stamp=lambda _: 0))
    output = localized(simscen, "drive.mcap")
    assert "all stamps are zero" in output["err"]
    assert output["error"]["max"] < 0.2


def test_reference_in_another_frame_is_reported(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    changed = [
        replace(entry, message=replace(entry.message, header=header(entry.time - LATENCY, "mocap")))
        if entry.topic == "/gt"
        else entry
        for entry in drive_log(every=3)
    ]
    write_mcap(tmp_path / "drive.mcap", changed)
    assert "/gt is in the frame 'mocap'" in localized(simscen, "drive.mcap")["err"]


def test_invalid_poses_are_skipped_and_counted(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    messages = drive_log()
    for k, x in ((60, math.nan), (90, math.inf), (120, 1e300)):
        for entry in (messages[3 * k + 1], messages[3 * k + 2]):
            inner = entry.message.pose.pose if entry.topic == "/odom" else entry.message.pose
            inner.position.x = x
    write_mcap(tmp_path / "drive.mcap", messages)
    output = localized(simscen, "drive.mcap")
    assert "/odom: 3 poses with invalid coordinates" in output["err"]
    assert "/gt: 3 poses with invalid coordinates" in output["err"]
    assert output["error"]["max"] < 0.3


def test_poses_with_an_invalid_orientation_are_skipped_and_counted(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    messages = drive_log()
    for k in (60, 90):
        messages[3 * k + 2].message.pose.orientation.w = 0.0
        messages[3 * k + 2].message.pose.orientation.z = 0.0
    write_mcap(tmp_path / "drive.mcap", messages)
    output = localized(simscen, "drive.mcap")
    assert "/gt: messages with an invalid orientation are ignored (2)" in output["err"]
    assert output["error"]["max"] < 0.3


def test_scans_with_another_clock_are_rejected(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    other = [
        replace(entry, message=scan(5 * SECOND, entry.message.ranges, "laser")) if entry.topic == "/scan" else entry
        for entry in drive_log(every=10)
    ]
    write_mcap(tmp_path / "drive.mcap", other)
    result = simscen("localize", "drive.mcap", *OPTIONS, "--start", "1,0.8,0")
    assert result.code == 2
    assert "no scan was measured while there was odometry" in result.err


def test_ignored_readings_are_reported(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    looped = drive_log()
    write_mcap(tmp_path / "drive.mcap", [*looped, *looped[1:31]])
    assert "10 of 160 odometry readings are not newer" in localized(simscen, "drive.mcap")["err"]


@pytest.mark.parametrize(
    ("change", "expected_text"),
    [
        (
            lambda entry: replace(entry, message=scan(entry.time, [1.0], "laser", math.nan)),
            "has invalid angles or range limits",
        ),
        (lambda entry: replace(entry, message=replace(entry.message, angle_increment=0.0)), "its angle_increment is 0"),
        (
            lambda entry: replace(entry, message=stamped(entry.time, (0, 0, 0))),
            "/scan is a geometry_msgs/msg/PoseStamped",
        ),
        (lambda entry: replace(entry, topic="/front/scan"), "it has no scans"),
    ],
    ids=["NaN angles", "equal angles", "another type", "another topic"],
)
def test_missing_scans_are_reported_with_the_existing_topics(
    simscen, tmp_path: Path, change: Callable[[Message], Message], expected_text: str
) -> None:
    write_map(tmp_path)
    write_mcap(
        tmp_path / "drive.mcap", [change(entry) if entry.topic == "/scan" else entry for entry in drive_log(every=15)]
    )
    result = simscen("localize", "drive.mcap", *OPTIONS, "--reference", "/gt")
    assert result.code == 2
    assert expected_text in result.err
    assert "Traceback" not in result.err


@pytest.mark.parametrize(
    "text",
    [
        "odom,1e300,0,0,0\nscan,1e300,0,0.1,0.1,9,1\n",
        "odom,0,1e200,0,0\nscan,0,0,0.1,0.1,9,1\n",
        "odom,0,0,0,0\nscan,inf,0,0.1,0.1,9,1\n",
        "odom,0,0,0,0\nscan,0,nan,0.1,0.1,9,1\n",
        "odom,0,0,0\x000,0\n",
        "odom," + "1" * 200_000 + ",0,0,0\n",
        '"odom\n' * 3,
        "mount,1,2\n",
        "",
    ],
)
def test_invalid_csv_log_is_rejected(simscen, tmp_path: Path, text: str) -> None:
    write_map(tmp_path)
    Path("bad.csv").write_text(text)
    result = simscen("localize", "bad.csv", *OPTIONS, "--start", "1,1,0")
    assert result.code == 2
    assert "bad.csv" in result.err
    assert "Traceback" not in result.err


def test_truncated_log_is_noted(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    whole = write_mcap(tmp_path / "cut.mcap", drive_log(), chunk_size=10_000)
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    assert "note: the log is truncated\n" in localized(simscen, "cut.mcap")["err"]


def test_messages_that_are_not_cdr_are_refused(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    write_mcap(tmp_path / "json.mcap", drive_log(), encoding="json")
    result = simscen("localize", "json.mcap", *OPTIONS, "--start", "1,0.8,0")
    assert (result.code, "is encoded as json, not as CDR" in result.err) == (2, True)


def test_every_truncated_log_gives_figures_or_an_error(simscen, tmp_path: Path) -> None:
    write_map(tmp_path)
    whole = write_mcap(tmp_path / "drive.mcap", drive_log(every=15)).read_bytes()
    for share in (0.0, 0.02, 0.3, 0.6, 0.95, 0.999):
        Path("cut.mcap").write_bytes(whole[: int(share * len(whole))])
        result = simscen("localize", "cut.mcap", *OPTIONS, "--start", "1,0.8,0")
        assert result.code in (0, 2), (share, result.err)
        assert "Traceback" not in result.err


def test_messages_match_their_definitions() -> None:
    """The tested messages must be those that a recorder writes."""
    for entry in drive_log(every=50):
        assert STORE.deserialize_cdr(
            STORE.serialize_cdr(entry.message, entry.message.__msgtype__), entry.message.__msgtype__
        )
