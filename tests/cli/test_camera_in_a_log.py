"""Test of a run with camera and bumper, whose log is read by the ROS reader."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

ROBOT = """\
simscen: 1
name: looker
mass: 2 kg
body: [{cylinder: [0.2, 0.1], z: 0.03}]
radius: 0.2
drive: {type: differential, wheel_radius: 0.033, wheel_separation: 0.28}
limits: {linear: 0.5, angular: 2, linear_acceleration: 1, angular_acceleration: 3}
sensors:
  lidar: {lidar: {rate: 10 Hz, mount: {z: 0.5}}}
  odom: {odometry: {}}
  front: {camera: {rate: 5 Hz, width: 64, height: 48, field_of_view: 60 deg, mount: {x: 0.1, z: 0.2}}}
  ring: {bumper: {rate: 40 Hz}}
"""
SCENARIO = """\
simscen: 1
world:
  simscen: 1
  walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]], height: 2}]
robot: {model: looker.robot.yaml, pose: {x: 1, y: 2}}
goals: [{pose: {x: 4, y: 2}, timeout: 30 s}]
events:
  - {when: {travelled: 1 m}, do: {spawn: {name: box, box: [0.2, 0.4, 0.1], ahead: [0.35, 0], mass: 0.2}}}
pass: [{collisions: {max: 10}}]
"""


@pytest.mark.slow
def test_log_contains_correct_images_and_bumper_readings(tmp_path: Path) -> None:
    (tmp_path / "looker.robot.yaml").write_text(ROBOT)
    (tmp_path / "a.scenario.yaml").write_text(SCENARIO)
    command = [sys.executable, "-m", "simscen.cli.main", "run", "a.scenario.yaml", "--out", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (log,) = (tmp_path / "out").rglob("run.mcap")
    with AnyReader([log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        read = {topic: [] for topic in ("/front/image_raw", "/front/depth/image_raw", "/bumper")}
        for connection, time, data in reader.messages():
            if connection.topic in read:
                read[connection.topic].append((time, reader.deserialize(data, connection.msgtype)))

    times = np.array([time for time, _ in read["/front/image_raw"]]) / 1e9
    assert np.allclose(np.diff(times), 0.2, atol=1e-6)
    color, depth = read["/front/image_raw"][0][1], read["/front/depth/image_raw"][0][1]
    assert (color.encoding, color.width, color.height, len(color.data)) == ("rgb8", 64, 48, 64 * 48 * 3)
    assert (depth.encoding, depth.header.frame_id) == ("32FC1", "front")
    meters = np.frombuffer(depth.data.tobytes(), dtype=np.float32).reshape(48, 64)
    focal = 32 / math.tan(math.radians(30))
    assert np.allclose(meters[22:26, 20:44], 5.95 - 1.1, atol=0.05), "the wall, before the lens at x = 1.1 m"
    assert np.allclose(meters[-1], 0.2 * focal / 23.5, rtol=0.03), "the floor, 20 cm below the lens"

    pressed = [message.data for _, message in read["/bumper"]]
    assert any(pressed), "it drove into a box that its lidar cannot see"
    assert not all(pressed)
