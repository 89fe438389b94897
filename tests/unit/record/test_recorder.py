"""Tests of the topics, messages, and metadata of recorded logs, read with other MCAP libraries."""

import hashlib
import io
import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from moments import CASE, CLOCK, moments, sample_header
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability
from schemas_from_rosbags import humble

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.trace import Decision, Moment
from simscen.record.frame_names import RobotFrames
from simscen.record.publishers.sensors import SensorPublisher
from simscen.record.recorder import Recorder

HERE = Path(__file__).parent
RUN = list(moments(2.0))
LATCHED = {"/map", "/tf_static", "/robot_description", "/simscen/things", "/simscen/scene"}
TOPICS = LATCHED | {
    *("/clock", "/tf", "/scan", "/odom", "/imu", "/bumper", "/amcl_pose", "/particle_cloud", "/plan", "/local_plan"),
    "/particlecloud",
    *("/cmd_vel", "/goal_pose", "/ground_truth/odom", "/rosout", "/simscen/events", "/simscen/clearance"),
    *("/visual/odom", "/rear_lidar/scan", "/camera/image_raw", "/camera/depth/image_raw"),
}


def record(run: list[Moment], seed: int = 7) -> bytes:
    stream = io.BytesIO()
    recorder = Recorder(stream, CLOCK, sample_header(seed))
    for moment in run:
        recorder.append(moment)
    recorder.close(480, "{}")
    return stream.getvalue()


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    path.write_bytes(record(RUN))
    return path


@pytest.fixture(scope="module")
def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """All messages by topic, with their log times, decoded by rosbags."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path], default_typestore=humble()) as reader:
        for connection, time, data in reader.messages():
            found.setdefault(connection.topic, []).append((time, reader.deserialize(data, connection.msgtype)))
    return found


def test_rosbags_decodes_every_topic(read: dict[str, list[tuple[int, Any]]]) -> None:
    assert set(read) == TOPICS


def test_sensors_with_equal_ros_names_have_different_topics() -> None:
    sensors = {"front": "Bump", "left bumper": "Bump", "left_bumper": "Bump", "a b": "Image", "a.b": "Image"}
    publisher = SensorPublisher(None, CLOCK, None, {}, sensors, RobotFrames())  # type: ignore[arg-type]
    assert [(sensor, topic.name) for sensor, topic in publisher.sensor_topics] == [
        ("front", "/bumper"),
        ("left bumper", "/left_bumper/bumper"),
        ("left_bumper", "/left_bumper_2/bumper"),
        ("a b", "/a_b/image_raw"),
        ("a b", "/a_b/depth/image_raw"),
        ("a.b", "/a_b_2/image_raw"),
        ("a.b", "/a_b_2/depth/image_raw"),
    ]


def test_mcap_ros2_decodes_every_message(path: Path) -> None:
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        topics = Counter(channel.topic for _, channel, _, _ in reader.iter_decoded_messages())
        summary = reader.get_summary()
    assert set(topics) == TOPICS
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == topics.total()


def test_only_topics_for_late_subscribers_are_transient_local(path: Path) -> None:
    with AnyReader([path], default_typestore=humble()) as reader:
        for connection in reader.connections:
            (profile,) = connection.ext.offered_qos_profiles
            expected = QosDurability.TRANSIENT_LOCAL if connection.topic in LATCHED else QosDurability.VOLATILE
            assert profile.durability is expected


def test_type_hashes_equal_those_of_ros(path: Path) -> None:
    store = humble()
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        name = summary.schemas[channel.schema_id].name
        assert channel.metadata["topic_type_hash"] == store.hash_rihs01(name)


def test_truth_is_logged_exactly(read: dict[str, list[tuple[int, Any]]]) -> None:
    for (time, message), moment in zip(read["/ground_truth/odom"], RUN, strict=True):
        assert moment.truth is not None
        pose = message.pose.pose
        assert time == moment.tick * 10**9 // 240
        assert (message.header.frame_id, message.child_frame_id) == ("map", "base_link_truth")
        assert (pose.position.x, pose.position.y, pose.orientation.w) == moment.truth.pose[:2] + moment.truth.pose[6:]
        assert (message.twist.twist.linear.x, message.twist.twist.angular.z) == moment.truth.twist[::2]


def test_scans_have_their_ranges_frame_and_acquisition_time(read: dict[str, list[tuple[int, Any]]]) -> None:
    scans = [r for m in RUN for r in m.readings if isinstance(r, Scan) and r.sensor == "lidar"]
    for (_, message), scan in zip(read["/scan"], scans, strict=True):
        assert np.array_equal(message.ranges, scan.ranges.astype(np.float32))
        assert message.header.frame_id == "lidar"
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == scan.tick * 10**9 // 240


def test_the_frames_form_one_tree_under_map(read: dict[str, list[tuple[int, Any]]]) -> None:
    links = [t for topic in ("/tf", "/tf_static") for _, message in read[topic] for t in message.transforms]
    parents = {t.child_frame_id: t.header.frame_id for t in links}
    assert parents == {
        "odom": "map",
        "base_link": "odom",
        "base_link_truth": "map",
        **dict.fromkeys(("camera", "lidar", "rear lidar"), "base_link"),
        **dict.fromkeys(("object/cart", "object/a box"), "map"),
    }
    assert {t.child_frame_id for t in read["/tf_static"][-1][1].transforms} == {"camera", "lidar", "rear lidar"}


def test_logged_map_equals_the_map_of_the_robot(read: dict[str, list[tuple[int, Any]]]) -> None:
    ((time, message),) = read["/map"]
    grid = sample_header().map
    assert grid is not None
    assert time == 0
    assert (message.info.height, message.info.width) == grid.shape
    assert np.array_equal(message.data.reshape(grid.shape), grid.cells)


def test_accepted_goal_is_published_at_its_pose(read: dict[str, list[tuple[int, Any]]]) -> None:
    ((_, message),) = read["/goal_pose"]
    assert (message.pose.position.x, message.pose.position.y) == CASE.goals[0].pose[:2]


def test_particles_are_logged_at_2_hz(read: dict[str, list[tuple[int, Any]]]) -> None:
    assert [time for time, _ in read["/particle_cloud"]] == [n * 500_000_000 for n in range(5)]
    assert len(read["/particle_cloud"][0][1].particles) == 500


def test_equal_runs_give_equal_bytes() -> None:
    digests = {hashlib.sha256(record(list(moments(1.0)))).hexdigest() for _ in range(3)}
    assert len(digests) == 1


def test_equal_runs_give_equal_bytes_in_any_process() -> None:
    code = "import hashlib, test_recorder as t; print(hashlib.sha256(t.record(t.RUN)).hexdigest())"
    digests = set()
    for salt in ("1", "2"):
        env = {**os.environ, "PYTHONHASHSEED": salt}
        run = subprocess.run(
            [sys.executable, "-c", code], check=True, cwd=HERE, env=env, capture_output=True, text=True
        )
        digests.add(run.stdout.strip())
    assert digests == {hashlib.sha256(record(RUN)).hexdigest()}


def test_sensors_cannot_publish_on_truth_topics() -> None:
    odometry = [Odometry(name, 0, Pose2(1.0, 2.0), STOP) for name in ("wheels", "ground_truth", "2nd wheels")]
    summary = make_reader(io.BytesIO(record([Moment(0, None, tuple(odometry), Decision(STOP))]))).get_summary()
    assert summary is not None
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/odom", "/sensor_ground_truth/odom", "/sensor_2nd_wheels/odom"} <= topics
    assert "/ground_truth/odom" not in topics


def test_reference_page_lists_every_topic() -> None:
    page = (HERE.parents[2] / "docs" / "reference" / "mcap.md").read_text()
    for topic in TOPICS - {"/rear_lidar/scan", "/visual/odom"}:
        assert f"`{topic.replace('/camera', '/NAME')}`" in page, topic


def test_different_seeds_give_different_logs() -> None:
    assert record(RUN[:5], seed=7) != record(RUN[:5], seed=8)


def test_log_has_its_final_name_only_when_complete(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap", CLOCK, sample_header()) as recorder:
        recorder.append(RUN[0])
        assert [p.name for p in tmp_path.iterdir()] == ["run.partial.mcap"]
        recorder.close(0)
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]


def test_a_full_disk_is_reported(tmp_path: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full")
    (tmp_path / "run.partial.mcap").symlink_to(full)
    with pytest.raises(RunError, match=r"no space left writing .*run\.partial\.mcap") as caught:
        Recorder(tmp_path / "run.mcap", CLOCK, sample_header())
    assert caught.value.kind == "output"


def test_missing_folder_is_reported(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"cannot write .*: No such file"):
        Recorder(tmp_path / "no" / "run.mcap", CLOCK, sample_header())


def test_external_stack_has_a_metadata_record() -> None:
    stream = io.BytesIO()
    Recorder(stream, CLOCK, sample_header(7)).close(0, stack={"name": "mine"})
    log = stream.getvalue()
    records = [(record.name, record.metadata) for record in make_reader(io.BytesIO(log)).iter_metadata()]
    assert records[1] == ("simscen.stack", {"name": "mine"})
    ((name, end),) = records[2:]
    assert (name, end["tick"]) == ("simscen.end", "0")
    assert end["messages:/map"] == "1"


def with_filtered_odometry(run: list[Moment]) -> list[Moment]:
    """Return the same run with a stack whose filtered odometry is 1 m ahead."""
    moments_with_filter = []
    for moment in run:
        wheels = [each for each in moment.readings if isinstance(each, Odometry) and each.sensor == "wheels"]
        filtered = tuple(replace(each, pose=Pose2(each.pose.x + 1.0, *each.pose[1:])) for each in wheels)
        moments_with_filter.append(replace(moment, decision=replace(moment.decision, odometry=filtered)))
    return moments_with_filter


def test_filtered_odometry_of_the_stack_defines_the_odom_transform(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(record(with_filtered_odometry(RUN)))
    with AnyReader([path], default_typestore=humble()) as reader:
        messages = [(each.topic, reader.deserialize(data, each.msgtype)) for each, _, data in reader.messages()]
    wheels, filtered = ([m for topic, m in messages if topic == name] for name in ("/odom", "/odometry/filtered"))
    links = [t for topic, m in messages if topic == "/tf" for t in m.transforms if t.child_frame_id == "base_link"]
    assert len(wheels) == len(filtered) == len(links)
    for wheel, fused, link in zip(wheels, filtered, links, strict=True):
        assert (fused.header.frame_id, fused.child_frame_id) == ("odom", "base_link")
        assert fused.header.stamp == link.header.stamp
        assert fused.pose.pose.position.x == link.transform.translation.x == wheel.pose.pose.position.x + 1.0
