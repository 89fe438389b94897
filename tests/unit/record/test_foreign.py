"""Tests of reading logs of real robots."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_logs import (
    BEGIN,
    CHUNKED,
    SECOND,
    SPEED,
    STORE,
    UNINDEXED,
    Message,
    drive,
    link,
    odometry,
    stamped_pose,
    statuses,
    write_bag,
    write_mcap,
)  # fmt: skip
from rosbags.rosbag2 import StoragePlugin

from simscen.core.errors import InvalidInput
from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Evidence
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import ForeignLog, read_foreign_log
from simscen.record.foreign.tracks import velocity_from_poses

MOCAP = ForeignLogOptions(truth="/mocap")
WRITERS: dict[str, Callable[[Path, list[Message]], Path]] = {
    "sqlite": lambda path, messages: write_bag(path / "bag", messages),
    "sqlite, files compressed": lambda path, messages: write_bag(path / "bag", messages, compress="file"),
    "sqlite, messages compressed": lambda path, messages: write_bag(path / "bag", messages, compress="message"),
    "rosbag2 of mcap": lambda path, messages: write_bag(path / "bag", messages, StoragePlugin.MCAP),
    "rosbag2 of mcap, messages compressed": lambda path, messages: write_bag(
        path / "bag", messages, StoragePlugin.MCAP, "message"
    ),
    "mcap without chunks or index": lambda path, messages: write_mcap(path / "a.mcap", messages, **UNINDEXED),
    **{
        f"mcap {name}": lambda path, messages, options=options: write_mcap(path / "a.mcap", messages, **options)  # type: ignore[misc]
        for name, options in CHUNKED.items()
    },
}


@pytest.mark.parametrize("writer", WRITERS)
def test_every_container_gives_the_same_trace(tmp_path: Path, writer: str) -> None:
    log = read_foreign_log(WRITERS[writer](tmp_path, drive()), MOCAP)
    trace = log.trace
    assert not log.notes
    assert (trace.tick_rate, trace.seconds(trace.end)) == (1000, pytest.approx(10.0, abs=0.1))
    assert len(trace.truth) == len(trace.odometry) == len(trace.command) == 201
    assert len(trace.belief) == len(trace.scans) == 21
    np.testing.assert_allclose(trace.truth.values[:, 0], SPEED * trace.truth.ticks / 1000, atol=0.02)
    np.testing.assert_allclose(trace.velocity.values, np.tile([SPEED, 0, 0], (201, 1)), atol=1e-6)
    np.testing.assert_allclose(trace.belief.values[:, 3:], np.tile([0.01, 0, 0, 0.01, 0, 0.01], (21, 1)))
    assert [event.kind for event in trace.events] == [EventKind.RUN_ENDED]
    assert not log.coverage.partial
    assert set(Evidence) - set(log.coverage.missing) == {
        Evidence.TRUTH, Evidence.VELOCITY, Evidence.BELIEF, Evidence.COVARIANCE, Evidence.ALIGNMENT,
        Evidence.SCANS, Evidence.COMMANDS,
    }  # fmt: skip


def test_missing_ground_truth_is_reported_with_possible_topics(
    read: Callable[..., ForeignLog],
) -> None:
    log = read(drive(), ForeignLogOptions())
    assert len(log.trace.truth) == 0
    assert log.coverage.missing[Evidence.TRUTH] == (
        "no ground truth: name a topic, or two frames such as map:base_link, with --truth; "
        "topics with poses: /amcl_pose, /mocap, /odom"
    )
    assert "no topic /vicon" in read(drive(), ForeignLogOptions(truth="/vicon")).coverage.missing[Evidence.TRUTH]


def test_transform_between_two_frames_can_be_the_ground_truth(read: Callable[..., ForeignLog]) -> None:
    """map ← odom is constant between messages, odom ← base moves, base ← marker is static."""
    messages = drive()
    for k in range(201):
        stamp = BEGIN + k * SECOND // 20
        messages.append(Message("/tf", stamp, link(stamp, "odom", "base_link", SPEED * k / 20)))
    for time, offset in ((BEGIN, 1.0), (BEGIN + 5 * SECOND, 2.0)):
        messages.append(Message("/tf", time, link(time, "map", "odom", 0.0, offset, 1.5707963)))
    messages.append(Message("/tf_static", BEGIN, link(0, "/base_link", "/marker", 0.25)))
    trace = read(messages, ForeignLogOptions(truth="map:marker")).trace
    x, y, yaw = trace.truth.values.T
    np.testing.assert_allclose(x, 0.0, atol=1e-6)
    offset = np.where(trace.truth.ticks < 5000, 1.0, 2.0)
    np.testing.assert_allclose(y, offset + 0.25 + SPEED * trace.truth.ticks / 1000, atol=2e-3)
    np.testing.assert_allclose(yaw, np.pi / 2, atol=1e-6)
    missing = read(messages, ForeignLogOptions(truth="map:wheel")).coverage.missing[Evidence.TRUTH]
    assert missing == "tf does not connect map with wheel; frames: base_link, map, marker, odom"
    reversed_frames = read(messages, ForeignLogOptions(truth="marker:map")).coverage.missing[Evidence.TRUTH]
    assert reversed_frames == "in tf, marker is below map; write map:marker"


def test_a_transform_that_is_static_until_a_localizer_starts_is_dynamic(read: Callable[..., ForeignLog]) -> None:
    messages = [Message("/tf_static", BEGIN, link(BEGIN, "map", "odom", 0.0))]
    for k in range(201):
        stamp = BEGIN + k * SECOND // 20
        messages.append(Message("/tf", stamp, link(stamp, "odom", "base_link", SPEED * k / 20)))
    stamp = BEGIN + 5 * SECOND
    messages.append(Message("/tf", stamp, link(stamp, "map", "odom", 0.0, 2.0)))
    trace = read(messages, ForeignLogOptions(truth="map:base_link")).trace
    np.testing.assert_allclose(trace.truth.values[:, 1], np.where(trace.truth.ticks < 5000, 0.0, 2.0))


def test_ground_truth_in_another_frame_is_not_compared_with_the_map(read: Callable[..., ForeignLog]) -> None:
    log = read(drive(mocap="vicon"))
    assert "frame `vicon`, the map frame is `map`" in log.coverage.missing[Evidence.ALIGNMENT]
    assert Evidence.TRUTH not in log.coverage.missing
    same = read(drive(mocap="vicon"), ForeignLogOptions(truth="/mocap", same_frame=True))
    assert Evidence.ALIGNMENT not in same.coverage.missing


def test_gap_in_the_ground_truth_is_partial_coverage(read: Callable[..., ForeignLog]) -> None:
    gap = (BEGIN + 4 * SECOND, BEGIN + 6 * SECOND)
    log = read([entry for entry in drive() if entry.topic != "/mocap" or not gap[0] < entry.time < gap[1]])
    assert log.coverage.partial[Evidence.TRUTH].startswith("/mocap has no message from t = 3.9")
    late = read([entry for entry in drive() if entry.topic != "/mocap" or entry.time > gap[1]])
    assert late.coverage.partial[Evidence.TRUTH].startswith("/mocap has no message from t = 0.00 s to 6.0")


def test_an_age_of_scans_that_no_sample_of_the_ground_truth_shows_is_partial_coverage(
    read: Callable[..., ForeignLog],
) -> None:
    """Without any message for 0.9 s, no sample of the ground truth has a scan that is older than 0.5 s."""
    gap = (BEGIN + 4.03 * SECOND, BEGIN + 4.99 * SECOND)
    log = read([entry for entry in drive() if not gap[0] < entry.time < gap[1]])
    assert list(log.coverage.partial) == [Evidence.SCANS]
    assert "no scan from t = 4.00 s to 5.00 s" in log.coverage.partial[Evidence.SCANS]
    without_scans_only = read(
        [entry for entry in drive() if entry.topic != "/scan" or not gap[0] < entry.time < gap[1]]
    )
    assert not without_scans_only.coverage.partial


def test_belief_that_starts_after_a_meter_is_partial_coverage(read: Callable[..., ForeignLog]) -> None:
    log = read([entry for entry in drive() if entry.topic != "/amcl_pose" or entry.time > BEGIN + 2 * SECOND])
    assert log.coverage.partial[Evidence.BELIEF].startswith("/amcl_pose starts at t = 2.0")


def test_velocity_is_computed_from_poses_if_all_twists_are_zero(read: Callable[..., ForeignLog]) -> None:
    stamps = [BEGIN + k * SECOND // 20 for k in range(201)]
    messages = [Message("/gps", t, odometry(t, "map", SPEED * k / 20, 0.0)) for k, t in enumerate(stamps)]
    log = read(messages, ForeignLogOptions(truth="/gps"))
    assert log.notes == [
        "/gps: all twists are zero although the robot moves, so velocities are computed from the poses"
    ]
    np.testing.assert_allclose(log.trace.velocity.values[:, 0], SPEED, atol=1e-6)


def test_velocities_beside_a_gap_are_not_averaged_over_the_gap() -> None:
    """A robot drives along an arc at 1 m/s, and brakes at 1 m/s² in a gap of the poses, which are at 50 Hz."""
    times = np.delete(np.arange(0, 4001, 20), slice(100, 145))
    speed = 1 - np.clip(times / 1000 - 2.0, 0.0, 1.0)
    path = np.where(times <= 2000, times / 1000, 2.0 + (1 - speed**2) / 2)
    poses = np.column_stack((np.sin(path), 1 - np.cos(path), path))
    velocities = velocity_from_poses(times, poses, 1000)
    is_standing, is_driving = times >= 3000, times <= 2000
    np.testing.assert_allclose(velocities[is_driving], np.tile([1.0, 0.0, 1.0], (is_driving.sum(), 1)), atol=0.06)
    np.testing.assert_allclose(velocities[is_standing], 0.0, atol=0.03)


def test_a_robot_that_is_faster_in_a_gap_does_not_seem_slower() -> None:
    times = np.delete(np.arange(0, 4001, 20), slice(101, 125))
    poses = np.column_stack((np.where(times <= 2000, 0.0, 2.0), np.zeros((len(times), 2))))
    assert velocity_from_poses(times, poses, 1000)[:, 0].max() == pytest.approx(2.0 / 0.5)


def test_velocities_of_rare_and_single_samples_are_averaged_over_longer_times() -> None:
    for times in (np.arange(0, 9000, 500), np.array([0, 20, 40, 700, 720, 740, 1400])):
        poses = np.column_stack((times / 2000, np.zeros((len(times), 2))))
        velocities = velocity_from_poses(times, poses, 1000)
        np.testing.assert_allclose(velocities, np.tile([0.5, 0.0, 0.0], (len(times), 1)), atol=1e-9)


@pytest.mark.parametrize("size", [0.2, 0.5, 0.9, 0.995])
def test_truncated_log_has_no_end(tmp_path: Path, size: float) -> None:
    file = write_mcap(tmp_path / "a.mcap", drive(), **UNINDEXED)
    data = file.read_bytes()
    file.write_bytes(data[: int(len(data) * size)])
    log = read_foreign_log(file, MOCAP)
    assert not log.trace.events
    assert log.notes == ["the log is truncated, so no criterion can pass"]


def test_a_log_of_ros_1_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    assert refused(drive(), profile="ros1").startswith("SC804 it is a log of ROS 1 (")
    assert refused(drive(), profile="", encoding="ros1").startswith("SC804 it is a log of ROS 1 (")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(InvalidInput, match="it is a bag of ROS 1"):
        read_foreign_log(tmp_path / "a.bag", MOCAP)


def test_topic_of_another_type_is_ignored_with_a_note(read: Callable[..., ForeignLog]) -> None:
    renamed = [replace(entry, topic="/amcl_pose") for entry in drive() if entry.topic == "/scan"]
    log = read([*(entry for entry in drive() if entry.topic != "/amcl_pose"), *renamed])
    assert log.coverage.missing[Evidence.BELIEF].startswith("/amcl_pose is a sensor_msgs/msg/LaserScan, expected ")


def test_messages_that_are_not_cdr_are_ignored_with_a_note(refused: Callable[..., str]) -> None:
    assert "/mocap is encoded as json, not as CDR" in refused(drive(), encoding="json")


def test_poses_with_an_invalid_orientation_are_ignored(tmp_path: Path) -> None:
    """A tracking system that has lost the robot sends zeros."""
    messages = drive()
    invalid = [k for k, entry in enumerate(messages) if entry.topic == "/mocap"][40:44]
    for k in invalid:
        messages[k] = replace(messages[k], message=replace_orientation(messages[k].message))
    log = read_foreign_log(write_mcap(tmp_path / "a.mcap", messages), MOCAP)
    assert len(log.trace.truth) == 201 - 4
    assert list(log.notes) == ["/mocap: messages with an invalid orientation are ignored (4)"]


def test_messages_that_do_not_match_their_type_are_refused(refused: Callable[..., str]) -> None:
    only = [entry for entry in drive() if entry.topic == "/mocap"]
    cut = refused(only, change=lambda data: data[:40])
    assert "message 1 of /mocap cannot be read as geometry_msgs/msg/PoseStamped" in cut
    assert "longer than its type" in refused(only, change=lambda data: data + bytes(8))
    assert "not plain CDR" in refused(only, change=lambda data: b"\x28\xb5\x2f\xfd" + data[4:])
    zero = [Message("/mocap", BEGIN, replace_orientation(stamped_pose(BEGIN, "map", 0.0)))]
    assert "all messages of /mocap have an invalid orientation" in refused(zero)


def replace_orientation(message: Any) -> Any:
    """Return the message with an orientation of zeros."""
    orientation = STORE.types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=0.0)
    pose = STORE.types["geometry_msgs/msg/Pose"](position=message.pose.position, orientation=orientation)
    return STORE.types["geometry_msgs/msg/PoseStamped"](header=message.header, pose=pose)


def test_big_endian_messages_are_read(tmp_path: Path) -> None:
    messages = [entry for entry in drive() if entry.topic == "/mocap"]
    little = read_foreign_log(write_mcap(tmp_path / "l.mcap", messages), MOCAP)
    big = [
        bytes(STORE.serialize_cdr(entry.message, entry.message.__msgtype__, little_endian=False)) for entry in messages
    ]
    big_endian = iter(big)
    log = read_foreign_log(write_mcap(tmp_path / "b.mcap", messages, change=lambda _: next(big_endian)), MOCAP)
    assert np.array_equal(log.trace.truth.values, little.trace.truth.values)


def test_log_without_known_topics_is_refused_with_a_list_of_its_topics(refused: Callable[..., str]) -> None:
    error = refused([replace(entry, topic="/robot1" + entry.topic) for entry in drive()])
    assert error.startswith("SC804 it has no messages that can be judged (its topics: /robot1/amcl_pose, ")
    other = refused([], ForeignLogOptions())
    assert "its topics: none" in other


def test_topics_may_have_other_names(read: Callable[..., ForeignLog]) -> None:
    names = {name: f"/robot1/{name}" for name in ("odom", "amcl_pose", "scan", "cmd_vel")}
    log = read(
        [replace(entry, topic="/robot1" + entry.topic) for entry in drive()], ForeignLogOptions("/robot1/mocap", names)
    )
    assert len(log.trace.belief) == 21 and len(log.trace.truth) == 201


def test_action_status_gives_goal_results(read: Callable[..., ForeignLog]) -> None:
    topic = "/navigate_to_pose/_action/status"
    messages = [
        *drive(),
        Message(topic, BEGIN + 1 * SECOND, statuses((9, BEGIN - SECOND, 4), (1, BEGIN + SECOND, 1))),
        Message(topic, BEGIN + 4 * SECOND, statuses((9, BEGIN - SECOND, 4), (1, BEGIN + SECOND, 4))),
        Message(topic, BEGIN + 5 * SECOND, statuses((1, BEGIN + SECOND, 4), (2, BEGIN + 5 * SECOND, 2))),
        Message(topic, BEGIN + 8 * SECOND, statuses((2, BEGIN + 5 * SECOND, 6))),
    ]
    log = read(messages, ForeignLogOptions(truth="/mocap", goals=("shelf", "dock")))
    events = [(str(event.kind), event.name, round(log.trace.seconds(event.tick))) for event in log.trace.events]
    assert events == [
        ("goal.accepted", "shelf", 1), ("goal.reached", "shelf", 4), ("goal.accepted", "dock", 5),
        ("goal.failed", "dock", 8), ("navigation.ended", "FAILED", 8), ("run.ended", "the recording ends", 10),
    ]  # fmt: skip
    with_one_goal = read(messages, ForeignLogOptions(truth="/mocap", goals=("shelf",)))
    assert with_one_goal.coverage.missing[Evidence.NAVIGATION] == "the log has 2 goals, the scenario 1 goal"


ACCEPTED_AT, ENDED_AT = (1, 5, 7), (4, 6, 9)
"""Times in s at which three goals are accepted and end."""


@pytest.mark.parametrize(
    ("final_states", "results"),
    [
        ((4, 4, 4), [("SUCCEEDED", 9)]),
        ((4, 4, 6), [("FAILED", 9)]),
        ((6, 4, 4), [("FAILED", 9)]),
        ((6, 4, 5), [("CANCELED", 9)]),
        ((5, 4, 4), [("CANCELED", 4), ("SUCCEEDED", 9)]),
        ((6, 5, 4), [("CANCELED", 6), ("SUCCEEDED", 9)]),
    ],
)
def test_navigation_with_a_failed_goal_has_failed(
    read: Callable[..., ForeignLog], final_states: tuple[int, ...], results: list[tuple[str, int]]
) -> None:
    topic = "/navigate_to_pose/_action/status"
    messages = drive()
    for number, (start, end, state) in enumerate(zip(ACCEPTED_AT, ENDED_AT, final_states, strict=True)):
        accepted = BEGIN + start * SECOND
        messages.append(Message(topic, accepted, statuses((number, accepted, 2))))
        messages.append(Message(topic, BEGIN + end * SECOND, statuses((number, accepted, state))))
    log = read(messages, ForeignLogOptions(truth="/mocap", goals=("a", "b", "c")))
    ended = log.trace.of_kind(EventKind.NAVIGATION_ENDED)
    assert [(event.name, round(log.trace.seconds(event.tick))) for event in ended] == results


def test_error_for_a_bag_without_rosbags_states_the_install_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = write_bag(tmp_path / "bag", drive(1.0))
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(InvalidInput) as raised:
        read_foreign_log(bag, MOCAP)
    assert raised.value.problems[0].hint == "pip install 'rosbags>=0.10,<1'"


@pytest.mark.parametrize("damage", ["cut", "empty", "no metadata", "not yaml"])
def test_a_damaged_bag_is_reported_without_a_traceback(tmp_path: Path, damage: str) -> None:
    bag = write_bag(tmp_path / "bag", drive())
    (database,) = bag.glob("*.db3")
    match damage:
        case "cut":
            database.write_bytes(database.read_bytes()[:5000])
        case "empty":
            database.write_bytes(b"")
        case "no metadata":
            (bag / "metadata.yaml").unlink()
        case "not yaml":
            (bag / "metadata.yaml").write_text("[")
    with pytest.raises(InvalidInput) as raised:
        read_foreign_log(bag, MOCAP)
    assert raised.value.problems[0].code in ("SC800", "SC804")
