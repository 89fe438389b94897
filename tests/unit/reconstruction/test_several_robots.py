"""Tests of reconstructing one robot of a log with several robots. The other robots become moving objects."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
import foreign_logs as logs

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.loading.scenario import load_scenario
from simscen.reconstruction.drive.log_messages import collect_messages
from simscen.reconstruction.drive.run_description import checked_robot_name
from simscen.reconstruction.objects.find_objects import object_of_robot
from simscen.reconstruction.scenario.given_parts import GivenFiles
from simscen.reconstruction.scenario_from_log import ReconstructionOptions, scenario_from_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [9, 0], [9, 5], [0, 5], [0, 0]]}]}
robots:
  red: {pose: {x: 1, y: 1}, goals: [{pose: {x: 2.5, y: 1}}]}
  blue: {pose: {x: 8, y: 4, yaw: 180 deg}, goals: [{pose: {x: 6, y: 4}}]}
time_limit: 20 s
pass: [goals_reached: {}]
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("robots")
    (folder / "two.scenario.yaml").write_text(SCENARIO)
    simulate(prepare(load_scenario(folder / "two.scenario.yaml", folder)), log=folder / "two.mcap")
    return folder / "two.mcap"


def test_the_scenario_has_the_chosen_robot_and_the_other_one_as_a_moving_object(log, tmp_path):
    reconstruction = scenario_from_log(
        log, tmp_path / "red.scenario.yaml", ReconstructionOptions(files=GivenFiles(robot="red"), root=log.parent)
    )
    assert reconstruction.contents.start.distance(Pose2(1.0, 1.0)) < 0.01
    (goal,) = reconstruction.contents.goals
    assert goal.pose.distance(Pose2(2.5, 1.0)) < 0.01
    (blue,) = reconstruction.contents.estimated.objects
    assert blue.name == "blue" and blue.is_moving and blue.pedestrian is None
    x, y, _ = blue.poses_at(np.array([0.0]))[0]
    assert (x, y) == pytest.approx((8.0, 4.0), abs=0.05)
    assert load_scenario(reconstruction.file, tmp_path).spec.robot.model == "turtlebot"


@pytest.mark.parametrize("name", ["", "green"])
def test_a_robot_of_the_log_must_be_chosen(log, name):
    with pytest.raises(InvalidInput, match="its robots are: blue, red"):
        checked_robot_name(log, name)


def test_the_box_of_a_robot_is_around_its_footprint():
    times = np.array([0.0, 1.0])
    poses = np.array([[1.0, 1.0, np.pi / 2], [1.0, 3.0, np.pi / 2]])
    box = object_of_robot("cart", ((-0.2, -0.3), (0.6, -0.3), (0.6, 0.3), (-0.2, 0.3)), times, poses)
    assert box.size == (0.8, 0.6)
    assert box.keyframes[0] == pytest.approx((0.0, 1.0, 1.2, np.pi / 2))


def test_a_robot_without_a_lidar_does_not_get_the_scans_of_another_one(log):
    assert len(collect_messages(log, {}, robot="blue").get("scan")) > 10
    assert collect_messages(log, {}, robot="blu").get("scan") == []


@pytest.mark.parametrize("robot", ["a", "s", "robot"])
def test_topics_are_those_of_the_robot_whatever_its_name(robot, tmp_path):
    recorded = [replace(entry, topic=f"/{robot}{entry.topic}") for entry in logs.drive(2.0)]
    collected = collect_messages(logs.write_mcap(tmp_path / "log.mcap", recorded), {"truth": "/mocap"}, robot=robot)
    assert {role for role in ("odom", "amcl_pose", "scan", "cmd_vel", "truth") if not collected.get(role)} == set()
    topics = {"odom": f"/{robot}/odom", "truth": f"/{robot}/mocap"}
    collected_by_topic = collect_messages(tmp_path / "log.mcap", topics, robot=robot)
    assert collected_by_topic.get("odom") and collected_by_topic.get("truth")
