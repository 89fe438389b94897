"""Tests of URDF output: a robot that is read back from its URDF is the same."""

import math
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from simulation_helpers import robot_spec

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.sim.body.from_spec import build_robot_body
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.writer import to_urdf


@pytest.mark.parametrize("name", ["turtlebot", "amr", "jackal"])
def test_robot_read_back_from_its_urdf_is_the_same(tmp_path, name):
    spec = robot_spec(name)
    body = build_robot_body(spec)
    (tmp_path / "robot.urdf").write_text(to_urdf(body))
    urdf_fields = {"body": None, "mass": None, "urdf": "robot.urdf"}
    read_back = build_robot_body(spec.model_copy(update=urdf_fields), tmp_path / "x.robot.yaml", [tmp_path])
    assert read_back.mass == pytest.approx(body.mass)
    assert [(w.x, w.y, w.radius) for w in read_back.wheels] == [
        pytest.approx((w.x, w.y, w.radius), abs=1e-6) for w in body.wheels
    ]
    assert read_back.chassis.center == pytest.approx(body.chassis.center, abs=1e-6)
    assert read_back.footprint == pytest.approx(np.array(body.footprint), abs=1e-6)
    for original, solid in zip(body.hull, read_back.hull, strict=True):
        points = solid.pose.apply(hull_points(solid.shape))
        assert original.pose.apply(hull_points(original.shape)) == pytest.approx(points, abs=1e-6)


def test_omnidirectional_robot_from_urdf_touches_the_ground_and_drives_sideways(tmp_path, simulate):
    spec = robot_spec("omni")
    (tmp_path / "robot.urdf").write_text(to_urdf(build_robot_body(spec)))
    urdf_fields = {"body": None, "mass": None, "urdf": "robot.urdf"}
    body = build_robot_body(spec.model_copy(update=urdf_fields), tmp_path / "x.robot.yaml", [tmp_path])
    assert min((s.pose.apply(hull_points(s.shape))[:, 2]).min() for s in body.hull) == pytest.approx(0.0)
    simulation = simulate(body, drive=(0.0, 0.3, 0.0))
    simulation.step(480)
    assert simulation.truth().twist == pytest.approx((0.0, 0.3, 0.0), abs=1e-6)


@pytest.mark.parametrize("pitch", [-math.pi / 2, -0.4, 0.0, 1.5, math.pi / 2])
@pytest.mark.parametrize(("roll", "yaw"), [(0.0, 0.0), (0.5, 0.0), (0.0, -1.2), (-2.8, 2.9)])
def test_orientation_of_a_shape_is_kept_at_every_pitch(roll, pitch, yaw):
    body = build_robot_body(robot_spec("turtlebot"))
    tilted = Solid(Box((0.1, 0.2, 0.3)), Pose3.from_rpy(0.0, 0.0, 0.5, roll, pitch, yaw), "mast")
    root = ET.fromstring(to_urdf(replace(body, hull=(tilted,))))
    rpy = [float(word) for word in root.find("link/collision/origin").get("rpy").split()]
    assert Pose3.from_rpy(0.0, 0.0, 0.0, *rpy).rotation() == pytest.approx(tilted.pose.rotation(), abs=1e-6)
