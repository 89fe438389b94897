"""Tests of scenarios that are reconstructed from the logs of real robots, written with rosbags."""

import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_drives as drives
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
import foreign_logs as logs
from logged_drive import GOAL, LIDAR_SILENT, messages, odometry, walk
from rosbags.rosbag2 import StoragePlugin

from simscen.cli.main import app
from simscen.loading.files.single_files import load_robot_file
from simscen.loading.scenario import load_scenario
from simscen.reconstruction import scenario_from_log as scenario_module
from simscen.reconstruction.drive.goals import BEND_SOURCE, STOP_SOURCE, goals_from_motion
from simscen.reconstruction.drive.reader import read_drive
from simscen.reconstruction.drive.recorded_drive import no_values
from simscen.reconstruction.reasons import FoundFault, Reason
from simscen.reconstruction.scenario.robot_file import observed_limits, write_robot_file
from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log
from simscen.reconstruction.static_world import (
    StaticWorld,
    beam_ends,
    lidar_poses,
    map_from_scans,
    world_from_map,
)
from simscen.worlds.maps.ros_map import save_map


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Return the bag of a drive with a map and a goal."""
    return logs.write_bag(tmp_path_factory.mktemp("drive") / "bag", messages())


@pytest.mark.sample(1)
@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_bag_becomes_a_scenario_with_its_goal_person_and_outage(plugin, tmp_path):
    bag = logs.write_bag(tmp_path / "bag", messages(with_person=True), plugin)
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    loaded = load_scenario(reconstruction.file, tmp_path)
    assert loaded.robot.path.name == "site.robot.yaml"
    assert reconstruction.contents.start.distance(drives.Pose2(1.0, 3.0)) < 0.1
    (goal,) = reconstruction.contents.goals
    assert math.dist(goal.pose[:2], GOAL) < 0.1
    (person,) = [thing for thing in reconstruction.contents.estimated.objects if thing.is_moving]
    frames = np.array(person.keyframes)
    true_positions = np.array([walk(time) for time in frames[:, 0].tolist()])
    assert float(np.sqrt(np.mean(np.sum((frames[:, 1:3] - true_positions) ** 2, axis=1)))) < 0.3
    (fault,) = [fault for fault in reconstruction.contents.estimated.faults if fault.target == "lidar"]
    assert (fault.kind, fault.begin) == ("off", pytest.approx(LIDAR_SILENT[0], abs=0.15))
    assert fault.duration == pytest.approx(1.5, abs=0.2)


def test_without_a_map_the_walls_are_built_from_the_scans(tmp_path):
    bag = logs.write_bag(tmp_path / "bag", messages(with_map=False))
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    load_scenario(reconstruction.file, tmp_path)
    occupied = np.argwhere(reconstruction.static_world.grid.cells == 100)
    wall_distances = drives.room().distance_to_walls(reconstruction.static_world.grid.center_of(occupied))
    assert len(occupied) > 200
    assert np.percentile(wall_distances, 95) < 0.15


@pytest.mark.parametrize("frame", ["odom", "map", "base_link", "unknown"])
def test_the_footprint_is_read_far_from_the_origin(frame, tmp_path):
    """The local costmap of Nav2 publishes it in its global frame, which is the odometry by default."""
    corners, (x, y, yaw) = [(0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3)], (40.0, -30.0, 2.0)
    T, recorded = logs.T, []
    for time in range(logs.BEGIN, logs.BEGIN + 5 * logs.SECOND, logs.SECOND):
        recorded.append(logs.Message("/odom", time, odometry(time, x, y, yaw)))
        recorded.append(logs.Message("/tf", time, logs.link(time, "map", "base_link", 7.0, 8.0, 1.0)))
    stamp = {"odom": (x, y, yaw), "base_link": (0.0, 0.0, 0.0)}.get(frame, (7.0, 8.0, 1.0))
    points = [T["geometry_msgs/msg/Point32"](a, b, 0.0) for a, b in drives.Pose2(*stamp).apply(np.array(corners))]
    polygon = T["geometry_msgs/msg/PolygonStamped"](
        header=logs.header(logs.BEGIN, frame), polygon=T["geometry_msgs/msg/Polygon"](points=points)
    )
    recorded.append(logs.Message("/local_costmap/published_footprint", logs.BEGIN, polygon))
    footprint = read_drive(logs.write_bag(tmp_path / "bag", recorded)).footprint
    assert np.allclose(footprint, corners, atol=0.001)


@pytest.mark.slow
def test_the_user_can_give_the_map(tmp_path):
    save_map(drives.room().grid, tmp_path / "office.yaml")
    bag = logs.write_bag(tmp_path / "bag", messages(with_map=False))
    arguments = ["new", "--from-log", str(bag), "--out", str(tmp_path / "site"), "--map", str(tmp_path / "office.yaml")]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert load_scenario(tmp_path / "site.scenario.yaml", tmp_path).world.path.name == "office.yaml"


@pytest.mark.parametrize("frame", ["odom", "base_link"])
def test_a_goal_can_be_in_another_frame_than_the_map(frame, tmp_path):
    """At the time of the goal, the robot is at the origin of the odometry, at (1, 3) on the map."""
    recorded = messages()
    for entry in recorded:
        if entry.topic == "/goal_pose":
            entry.message.header.frame_id, entry.message.pose = frame, logs.pose(GOAL[0] - 1.0, GOAL[1] - 3.0)
    (goal,) = read_drive(logs.write_bag(tmp_path / "bag", recorded)).goals
    assert math.dist(goal.pose[:2], GOAL) < 0.1


@pytest.mark.parametrize("as_tf", [False, True])
def test_without_a_pose_in_the_map_frame_map_and_goal_in_this_frame_are_not_used(as_tf, tmp_path):
    """The odometry begins at (0, 0), the robot at (1, 3) on the map."""
    recorded = [entry for entry in messages() if entry.topic != "/amcl_pose"]
    if as_tf:
        for number, entry in enumerate(recorded):
            if entry.topic == "/odom":
                x, y = entry.message.pose.pose.position.x, entry.message.pose.pose.position.y
                turn = entry.message.pose.pose.orientation
                transform = logs.link(entry.time - 5_000_000, "odom", "base_link", x, y, 2 * math.atan2(turn.z, turn.w))
                recorded[number] = replace(entry, topic="/tf", message=transform)
    bag = logs.write_bag(tmp_path / "bag", recorded)
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    assert reconstruction.drive.map is None and reconstruction.contents.estimated.objects == []
    (goal,) = reconstruction.contents.goals
    end = reconstruction.drive.poses.values[-1]
    assert math.dist(goal.pose[:2], end[:2]) < 0.01
    assert reconstruction.contents.start.distance(drives.Pose2(0.0, 0.0)) < 0.1


def test_a_robot_that_stands_still_has_no_goal(tmp_path):
    recorded = [
        replace(entry, message=logs.odometry(entry.time, "odom", 0.0, 0.0))
        for entry in messages()
        if "odom" in entry.topic
    ]
    drive = read_drive(logs.write_bag(tmp_path / "bag", recorded))
    assert not drive.goals
    assert "a goal, because the robot got no goal and did not drive anywhere" in drive.notes


def test_without_goals_the_end_of_the_motion_is_the_goal(tmp_path):
    bag = logs.write_bag(tmp_path / "bag", messages(with_goal=False))
    drive = read_drive(bag)
    (goal,) = drive.goals
    assert goal.pose.distance(drives.Pose2(*drives.poses(np.array([drives.DURATION_S - 0.05]))[0].tolist())) < 0.1


def test_a_drive_without_stops_has_goals_where_its_path_bends():
    times = np.arange(0.0, 20.0, 0.1)
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.1)]
    path = np.column_stack([np.interp(times, [0, 5, 10, 15, 19.9], column) for column in zip(*corners, strict=True)])
    goals = list(goals_from_motion(drives.signal(times, np.column_stack((path, np.zeros(len(times)))))))
    np.testing.assert_allclose([goal.pose[:2] for goal in goals], corners[1:], atol=0.05)
    assert [goal.end_time for goal in goals] == pytest.approx([5, 10, 15, 19.9], abs=0.1)
    assert [goal.source for goal in goals] == [BEND_SOURCE] * 3 + [STOP_SOURCE]


def test_the_mount_of_the_lidar_can_be_on_tf(tmp_path):
    moved = [replace(entry, topic="/tf") if entry.topic == "/tf_static" else entry for entry in messages()]
    drive = read_drive(logs.write_bag(tmp_path / "bag", moved))
    assert not any("mount" in note for note in drive.notes)


def test_scans_of_another_topic_are_used_with_a_note(tmp_path):
    recorded = [replace(entry, topic="/front/scan") if entry.topic == "/scan" else entry for entry in messages()]
    drive = read_drive(logs.write_bag(tmp_path / "bag", recorded))
    assert len(drive.scans) > 50
    assert "scans on /scan; the scans on /front/scan are used, see --topic scan=/TOPIC" in drive.notes


def upside_down(entry):
    if entry.topic == "/tf_static":
        entry.message.transforms[0].transform.rotation = logs.T["geometry_msgs/msg/Quaternion"](
            x=1.0, y=0.0, z=0.0, w=0.0
        )
    if entry.topic == "/scan":
        entry.message.ranges = np.roll(
            entry.message.ranges[::-1], 1
        )  # the first beam points backward and has no mirror image


def clockwise(entry):
    if entry.topic == "/scan":
        entry.message.angle_min, entry.message.angle_increment = math.pi, -entry.message.angle_increment
        entry.message.ranges = np.roll(entry.message.ranges[::-1], 1)


@pytest.mark.parametrize("change", [upside_down, clockwise])
def test_scans_of_a_lidar_that_turns_clockwise_hit_the_walls(change, tmp_path):
    changed = messages()
    for entry in changed:
        change(entry)
    drive = read_drive(logs.write_bag(tmp_path / "bag", changed))
    ends = beam_ends(lidar_poses(drive, drive.scans), drive.scans.angles, drive.scans.ranges)[drive.scans.is_hit()]
    assert np.median(drives.room().distance_to_walls(ends)) < 0.1
    assert np.all(np.diff(drive.scans.angles) > 0)


def test_a_fault_that_does_not_fit_the_sensor_is_only_mentioned(tmp_path, monkeypatch):
    slowed = FoundFault("odom", "slow", {"rate": "400 Hz"}, reason=Reason("too slow", 1.0, 2.0))
    run_estimators = scenario_module.run_estimators
    monkeypatch.setattr(
        scenario_module,
        "run_estimators",
        lambda *arguments: replace(footprint := run_estimators(*arguments), faults=[*footprint.faults, slowed]),
    )
    bag = logs.write_bag(tmp_path / "bag", messages())
    reconstruction = scenario_from_log(bag, tmp_path / "site.scenario.yaml", ReconstructionOptions())
    load_scenario(reconstruction.file, tmp_path)
    assert [fault.kind for fault in reconstruction.contents.estimated.faults] == ["off"]
    assert any("too slow" in unknown for unknown in reconstruction.contents.unknowns)


def test_the_assumed_robot_fits_where_it_drove(tmp_path):
    """The wall stands 0.3 m beside the path; where the robot drove, the map is free although its poses drift."""
    times = np.arange(0.0, 8.0, 0.1)
    stamp = np.column_stack((1.0 + 0.5 * times, np.full(len(times), 0.35), np.zeros(len(times))))
    ranges = drives.room().ranges_from(stamp, drives.ANGLES, 12.0)
    ranges[70:] -= 0.28
    scans = replace(drives.scans(), times=times, arrivals=times, ranges=ranges, is_malformed=np.zeros(len(times), bool))
    drive = drives.drive(scans, poses=drives.signal(times, stamp))
    walls = StaticWorld(world_from_map(map_from_scans(drive), "map"), drives.HEIGHT)
    nearest = float(walls.distance_to_walls(stamp[:, :2]).min())
    assert nearest >= 0.15
    file = tmp_path / "a.robot.yaml"
    written = write_robot_file(drive, file, 0.01, nearest - 0.05)
    radius = float(re.search(r"radius: ([\d.]+)", file.read_text()).group(1))
    assert 0.1 <= radius < nearest
    assert any(f"a radius of {radius} m" in unknown for unknown in written.unknowns)


def test_the_speed_limits_of_a_log_of_transforms_are_those_of_its_poses():
    speed, turn_rate = observed_limits(drives.drive(odometry=no_values(6), commands=no_values(3)))
    assert speed == pytest.approx(1.05 * drives.SPEED_M_S, abs=0.02)
    assert turn_rate == 0.5


def test_the_speed_limit_is_from_the_ground_truth_and_the_commands():
    plain = drives.drive(commands=no_values(3))
    fast = replace(plain, odometry=replace(plain.odometry, values=3 * plain.odometry.values))
    assert observed_limits(fast)[0] == pytest.approx(1.05 * drives.SPEED_M_S, abs=0.02)


@pytest.mark.parametrize(
    ("count", "step", "beams", "view"),
    [
        (181, math.radians(1), 181, math.pi),
        (360, math.radians(1), 360, 2 * math.pi),
        (5521, math.radians(0.05), 4096, math.radians(276)),
        (7200, math.radians(0.05), 4096, 2 * math.pi),
    ],
)
def test_the_lidar_of_the_robot_file_has_the_directions_of_the_log(count, step, beams, view, tmp_path):
    angles = step * (np.arange(count) - (count - 1) / 2)
    measured = replace(drives.scans(), angles=angles, ranges=np.ones((len(drives.scans()), count)))
    file = tmp_path / "a.robot.yaml"
    write_robot_file(drives.drive(measured), file, 0.01, 1.0)
    lidar = load_robot_file(str(file), tmp_path).robot.spec.sensors["lidar"].lidar
    assert (lidar.beams, lidar.field_of_view) == (beams, pytest.approx(view, abs=1e-4))


def test_velocities_of_odometry_without_twists_are_computed_from_its_poses(tmp_path):
    recorded = messages()
    for entry in recorded:
        if entry.topic == "/odom":
            entry.message.twist.twist = logs.twist(0.0)
    drive = read_drive(logs.write_bag(tmp_path / "bag", recorded))
    assert float(np.median(drive.odometry.values[:, 3])) == pytest.approx(drives.SPEED_M_S, abs=0.01)
    assert any("velocities in the odometry" in note for note in drive.notes)
    assert observed_limits(drive)[0] == pytest.approx(1.05 * drives.SPEED_M_S, abs=0.03)


def plan_and_statuses(begin: float, end: float) -> list[logs.Message]:
    """Return a plan to GOAL, and the statuses of its action: executing at `begin`, succeeded at `end`, in s."""
    goal = logs.T["geometry_msgs/msg/PoseStamped"](header=logs.header(logs.BEGIN, "map"), pose=logs.pose(*GOAL))
    plan = logs.T["nav_msgs/msg/Path"](header=logs.header(logs.BEGIN, "map"), poses=[goal, goal])
    first, last = (logs.BEGIN + round(time * logs.SECOND) for time in (begin, end))
    topic = "/navigate_to_pose/_action/status"
    statuses = [logs.Message(topic, stamp, logs.statuses((1, logs.BEGIN, s))) for stamp, s in ((first, 2), (last, 4))]
    return [logs.Message("/plan", first, plan), *statuses]


def test_goals_come_from_the_ends_of_plans_and_the_status_of_the_action(tmp_path):
    recorded = messages(with_goal=False)
    recorded += plan_and_statuses(0.1, 11.0)
    drive = read_drive(logs.write_bag(tmp_path / "bag", sorted(recorded, key=lambda entry: entry.time)))
    (goal,) = drive.goals
    assert math.dist(goal.pose[:2], GOAL) < 0.01
    assert (goal.status, goal.end_time) == ("reached", pytest.approx(11.0, abs=0.2))


def test_a_drive_starts_when_its_first_plan_does_even_if_the_robot_is_stuck(tmp_path):
    """The robot has the goal 10 s before it moves."""
    recorded = messages(with_goal=False, idle=10.0)
    recorded += plan_and_statuses(0.01, 21.0)
    drive = read_drive(logs.write_bag(tmp_path / "bag", sorted(recorded, key=lambda entry: entry.time)))
    assert drive.begin == 0.0
    assert drive.duration == pytest.approx(10.0 + drives.DURATION_S, abs=0.2)


def test_log_before_the_first_goal_is_ignored(tmp_path):
    drive = read_drive(logs.write_bag(tmp_path / "bag", messages(idle=5.0)))
    assert drive.goals[0].sent_time == 0.0
    assert drive.duration == pytest.approx(drives.DURATION_S, abs=0.2)
    assert any("before the first goal" in note for note in drive.notes)


def test_the_topic_of_the_ground_truth_can_have_another_role(bag):
    drive = read_drive(bag, "/odom")
    assert drive.has_true_poses
    assert len(drive.odometry) == len(drive.poses) > 100


def test_stamps_of_a_simulator_in_slow_motion_are_no_delays(tmp_path):
    """The log times are of the wall clock. Five seconds of the wall clock are one second of simulated time."""
    recorded = messages(with_goal=False)
    slowed = [
        replace(entry, time=10**18 + 5 * (entry.time - logs.BEGIN))
        for entry in [
            *recorded,
            *(replace(entry, topic="/cmd_vel", message=logs.twist(0.5)) for entry in recorded[::10]),
        ]
    ]
    reconstruction = scenario_from_log(
        logs.write_bag(tmp_path / "bag", sorted(slowed, key=lambda entry: entry.time)),
        tmp_path / "site.scenario.yaml",
        ReconstructionOptions(),
    )
    assert reconstruction.drive.duration == pytest.approx(drives.DURATION_S, abs=0.1)
    assert reconstruction.drive.commands.times[-1] == pytest.approx(drives.DURATION_S, abs=0.5)
    assert {fault.kind for fault in reconstruction.contents.estimated.faults} == {"off"}
    assert "delays of messages, because stamps advance 0.200 s per second of log time" in reconstruction.drive.notes


def test_the_base_can_have_another_name(tmp_path):
    """The poses of a mapper such as slam_toolbox are only on /tf, between frames that the odometry names."""
    recorded = []
    for entry in messages():
        if entry.topic == "/odom":
            stamp = entry.message.pose.pose.position
            entry.message.header.frame_id, entry.message.child_frame_id = "r1/odom", "r1/chassis"
            recorded.append(
                replace(entry, topic="/tf", message=logs.link(entry.time, "r1/odom", "r1/chassis", stamp.x, stamp.y))
            )
            recorded.append(replace(entry, topic="/tf", message=logs.link(entry.time, "map", "r1/odom", 1.0, 3.0)))
        recorded.append(entry)
    drive = read_drive(logs.write_bag(tmp_path / "bag", [entry for entry in recorded if entry.topic != "/amcl_pose"]))
    assert drive.pose_source == "transform from map to r1/chassis"
    assert len(drive.corrections) > 100
