"""Tests of logs that cannot be reconstructed, or only in part: errors, notes, and remaining files."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
import foreign_logs as logs
from logged_drive import GOAL, messages

from simscen.cli.main import app
from simscen.core.errors import InvalidInput, UsageError
from simscen.loading.scenario import load_scenario
from simscen.reconstruction import scenario_from_log as scenario_module
from simscen.reconstruction.drive.reader import read_drive
from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Return the bag of a drive with a map and a goal."""
    return logs.write_bag(tmp_path_factory.mktemp("drive") / "bag", messages())


def test_poses_with_an_invalid_orientation_are_named(tmp_path):
    recorded = logs.drive()
    orientations = [entry.message.pose.orientation for entry in recorded if entry.topic == "/mocap"][3:5]
    for orientation in orientations:
        orientation.w = 0.0
    drive = read_drive(logs.write_mcap(tmp_path / "a.mcap", recorded), "/mocap")
    assert "2 poses on /mocap, whose orientation is invalid" in drive.notes
    assert len(drive.poses.times) > 190
    for entry in recorded:
        if entry.topic == "/mocap":
            entry.message.pose.orientation.w = 0.0
    with pytest.raises(InvalidInput, match="all messages of /mocap have an invalid orientation"):
        read_drive(logs.write_mcap(tmp_path / "b.mcap", recorded), "/mocap")


def test_a_log_without_poses_is_refused_with_a_hint(tmp_path):
    only_scans = [entry for entry in messages() if entry.topic == "/scan"]
    with pytest.raises(InvalidInput, match="no poses of the robot") as error:
        read_drive(logs.write_bag(tmp_path / "bag", only_scans))
    assert "--topic" in error.value.problems[0].hint


def test_log_without_scans_lists_what_could_not_be_reconstructed(tmp_path):
    messages_without_scans = [entry for entry in messages() if entry.topic != "/scan"]
    bag = logs.write_bag(tmp_path / "bag", messages_without_scans)
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    assert reconstruction.contents.estimated.objects == []
    assert any("no scans" in unknown for unknown in reconstruction.contents.unknowns)


@pytest.mark.parametrize(
    ("truth", "topics", "text"),
    [
        ("/mocap", {}, "it has no topic /mocap"),
        ("map:base_link", {}, "it has no topic map:base_link"),
        ("/scan", {}, "/scan is a sensor_msgs/msg/LaserScan, expected nav_msgs/msg/Odometry or"),
        (None, {"scan": "/front"}, "it has no topic /front"),
        (None, {"odom": "/amcl_pose"}, "expected nav_msgs/msg/Odometry"),
    ],
)
def test_topics_that_the_user_names_must_have_usable_messages(truth, topics, text, bag):
    with pytest.raises(InvalidInput, match=text):
        read_drive(bag, truth, topics)


def test_a_ground_truth_far_from_the_origin_is_refused(tmp_path):
    """UTM coordinates are up to 10,000 km."""
    recorded = messages()
    for entry in recorded:
        if entry.topic == "/odom":
            entry.message.pose.pose.position.y += 3e6
    with pytest.raises(InvalidInput, match="no pose with valid coordinates"):
        read_drive(logs.write_bag(tmp_path / "bag", recorded), "/odom")


@pytest.mark.parametrize(("name", "content"), [
    ("missing.mcap", None),
    ("text.mcap", b"not a log"),
    ("empty.mcap", b""),
    ("ros1.bag", b"#ROSBAG V2.0\n"),
])  # fmt: skip
def test_an_unusable_log_ends_with_exit_code_2_and_leaves_no_file(name, content, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    target = tmp_path / "new.scenario.yaml"
    result = CliRunner().invoke(app, ["new", "--from-log", str(tmp_path / name), "--out", str(target)])
    assert isinstance(result.exception, InvalidInput) or result.exit_code == 2
    assert not target.exists()


def with_nan(entry):
    entry.message.pose.pose.position.x = math.nan


def without_stamp(entry):
    entry.message.header.stamp = logs.stamp_of(0)


def without_beams(entry):
    entry.message.ranges = np.zeros(0, dtype=np.float32)


def with_one_direction(entry):
    entry.message.angle_increment = 0.0


def with_nan_angles(entry):
    entry.message.angle_min = math.nan


def with_nan_limit(entry):
    entry.message.range_max = math.nan


def without_resolution(entry):
    entry.message.info.resolution = 0.0


@pytest.mark.parametrize(
    ("topic", "change", "changes_all", "text"),
    [
        ("/odom", with_nan, False, "valid numbers in 1 messages of `odom`, which are ignored"),
        ("/amcl_pose", with_nan, True, "messages of `amcl_pose`, which are ignored"),
        ("/odom", without_stamp, False, ""),
        ("/scan", without_beams, True, "usable scans of `lidar`, because their angles"),
        ("/scan", with_one_direction, True, "usable scans of `lidar`, because their angles"),
        ("/scan", with_nan_angles, True, "usable scans of `lidar`, because their angles"),
        ("/scan", with_nan_limit, True, "usable scans of `lidar`, because their angles"),
        ("/map", without_resolution, True, "a usable map, because its map has no cells"),
    ],
)
def test_a_log_with_invalid_messages_gives_a_valid_scenario(topic, change, changes_all, text, tmp_path):
    recorded = messages()
    topic_messages = [entry for entry in recorded if entry.topic == topic]
    for entry in topic_messages if changes_all else topic_messages[30:31]:
        change(entry)
    bag = logs.write_bag(tmp_path / "bag", recorded)
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    load_scenario(reconstruction.file, tmp_path)
    assert any(text in unknown for unknown in reconstruction.contents.unknowns)
    (goal_found,) = reconstruction.contents.goals
    # Without a pose in the map frame, the goal is where the odometry ends.
    goal, tolerance = ((GOAL[0] - 1.0, GOAL[1] - 3.0), 0.2) if topic == "/amcl_pose" else (GOAL, 0.1)
    assert math.dist(goal_found.pose[:2], goal) < tolerance


def test_a_clock_that_jumps_by_more_than_the_drive_is_refused(tmp_path):
    recorded = messages()
    odometry_messages = [entry for entry in recorded if entry.topic == "/odom"]
    odometry_messages[30].message.header.stamp = logs.stamp_of(logs.BEGIN + 10**8 * logs.SECOND)
    with pytest.raises(InvalidInput, match="the stamps of the topic for `odom` jump by 99999998"):
        read_drive(logs.write_bag(tmp_path / "bag", recorded))


def test_a_drive_across_a_country_needs_a_map(tmp_path):
    distant = [replace(entry, message=logs.odometry(entry.time, "odom", 1e4 * k, 0.5)) for k, entry in enumerate(
        entry for entry in messages() if entry.topic == "/odom"
    )]  # fmt: skip
    distant[-1].message.pose.pose.position.y = 1e5
    bag = logs.write_bag(tmp_path / "bag", distant)
    with pytest.raises(InvalidInput, match="too much to build a map"):
        scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())


@pytest.mark.parametrize("existing", ["site_map.yaml", "site_map.pgm", "site.robot.yaml"])
def test_existing_files_are_never_overwritten(existing, tmp_path):
    bag = logs.write_bag(tmp_path / "bag", messages(with_map=False))
    (tmp_path / existing).write_text("mine")
    arguments = ["new", "--from-log", str(bag), "--out", str(tmp_path / "site")]
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, UsageError)
    assert f"{existing} already exists" in str(result.exception)
    assert (tmp_path / existing).read_text() == "mine"
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(["bag", existing])


def test_an_invalid_log_leaves_no_map_and_no_robot_file(tmp_path, monkeypatch):
    def fail(*_):
        raise InvalidInput([])

    monkeypatch.setattr(scenario_module, "run_estimators", fail)
    bag = logs.write_bag(tmp_path / "bag", messages(with_map=False))
    with pytest.raises(InvalidInput):
        scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    assert [file.name for file in tmp_path.iterdir()] == ["bag"]
