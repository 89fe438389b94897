"""Test of motion prediction against the ground truth, with pedestrians in a furnished house."""

import math
from pathlib import Path

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.records.trace import Moment
from simscen.loading.scenario import load_scenario
from simscen.run.lockstep import RobotUnderTest
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate
from simscen.stack.reference import ReferenceStack
from simscen.stack.validation.stack import CheckedStack

WORLDS = Path(__file__).parents[2] / "worlds"
HOUSE = """\
simscen: 1
world: house.world.yaml
robot: {pose: {x: 9.4, y: 7.3, yaw: 90 deg}}
stack: {profile: advanced}
goals: [{pose: {x: 6.0, y: 4.95, yaw: 0 deg}}, {pose: {x: 3.0, y: 3.0, yaw: 180 deg}}]
events:
  - name: two walk
    when: {time: 1 s}
    do:
      - {pedestrian: {name: anna, pose: {x: 1.0, y: 5.2}, goals: [[11.0, 5.2]]}}
      - {pedestrian: {name: bert, pose: {x: 3.0, y: 6.6}, goals: [[3.2, 5.0], [3.0, 3.2], [5.5, 3.0]]}}
time_limit: 40 s
pass: [{collisions: {max: 0, caused_by_robot: true}}]
"""


class TrackComparison:
    """A log that compares the predicted obstacles with the true pedestrians at each scan.

    position_errors_m, velocity_errors_m_s: errors of the predicted obstacles within 0.5 m of a pedestrian
    false_tracks: number of predicted obstacles without a pedestrian within 0.5 m
    turning_scans: number of scans at which the robot turns faster than 0.3 rad/s
    previous_poses: tick and pose of each pedestrian at the previous scan
    """

    def __init__(self, agent: RobotUnderTest) -> None:
        assert isinstance(agent.stack, CheckedStack) and isinstance(agent.stack.inner, ReferenceStack)
        (self.prediction,) = (part for name, part, _ in agent.stack.inner.components if name == "prediction")
        self.position_errors_m: list[float] = []
        self.velocity_errors_m_s: list[float] = []
        self.false_tracks, self.turning_scans = 0, 0
        self.previous_poses: dict[str, tuple[int, Pose2]] = {}

    def append(self, moment: Moment) -> None:
        if moment.truth is None or not any(reading.sensor == "lidar" for reading in moment.readings):
            return
        people = {name: pose.plane for name, pose in moment.truth.objects.items()}
        moving = self.prediction.moving_obstacles_in_frame(moment.tick, Pose2(0.0, 0.0))
        here = moment.truth.pose.plane
        c, s = math.cos(here.yaw), math.sin(here.yaw)
        centers, velocities = here.apply(moving.centers), moving.velocities @ np.array([[c, s], [-s, c]])
        self.turning_scans += abs(moment.truth.twist.wz) > 0.3
        for center, velocity in zip(centers, velocities, strict=True):
            gap, name = min((math.hypot(center[0] - pose.x, center[1] - pose.y), name) for name, pose in people.items())
            if gap > 0.5:
                self.false_tracks += 1
            elif name in self.previous_poses:
                previous_tick, pose = self.previous_poses[name]
                seconds = (moment.tick - previous_tick) / 240
                true_velocity = ((people[name].x - pose.x) / seconds, (people[name].y - pose.y) / seconds)
                self.position_errors_m.append(gap)
                self.velocity_errors_m_s.append(math.dist(velocity, true_velocity))
        self.previous_poses = {name: (moment.tick, pose) for name, pose in people.items()}

    def finish(self) -> None:
        pass


def test_pedestrians_are_tracked_to_centimeters_without_false_tracks(tmp_path: Path) -> None:
    file = tmp_path / "walkers.scenario.yaml"
    file.write_text(HOUSE)
    comparisons: list[TrackComparison] = []

    def attach(rig, logs):
        comparisons.append(TrackComparison(rig.robots[0]))
        return comparisons

    simulate(prepare(load_scenario(file, tmp_path, (WORLDS,))), 1, attach=attach)
    (comparison,) = comparisons
    assert comparison.turning_scans > 40  # false tracks of static objects appear mostly while the robot turns
    assert len(comparison.position_errors_m) > 60
    assert np.median(comparison.position_errors_m) < 0.03 and np.percentile(comparison.position_errors_m, 90) < 0.12
    assert np.median(comparison.velocity_errors_m_s) < 0.1 and np.percentile(comparison.velocity_errors_m_s, 90) < 0.4
    assert comparison.false_tracks <= 0.03 * len(comparison.position_errors_m)
