"""Tests of poses and angles against matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simscen.core.geometry import Pose2, Pose3, wrap

angles = st.floats(-10, 10)
lengths = st.floats(-100, 100)
poses = st.builds(Pose2, lengths, lengths, angles)


def matrix(pose: Pose2) -> np.ndarray:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array([[c, -s, pose.x], [s, c, pose.y], [0, 0, 1]])


@given(poses, poses)
def test_composition_is_matrix_multiplication(a, b):
    assert np.allclose(matrix(a.compose(b)), matrix(a) @ matrix(b), atol=1e-9)


@given(poses)
def test_composition_with_the_inverse_is_the_identity(pose):
    assert np.allclose(matrix(pose.inverse()), np.linalg.inv(matrix(pose)), atol=1e-9)


@given(poses, poses)
def test_between_returns_the_relative_pose(a, b):
    assert np.allclose(matrix(a.compose(a.between(b))), matrix(b), atol=1e-7)


@given(st.floats(-1e3, 1e3))
def test_wrapped_angle_is_equivalent_and_in_range(angle):
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(angles, angles, angles)
def test_roll_pitch_yaw_are_rotations_about_fixed_axes(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    assert np.allclose(Pose3.from_rpy(0, 0, 0, roll, pitch, yaw).rotation(), about_z @ about_y @ about_x, atol=1e-9)


@given(lengths, lengths, lengths, angles, angles, angles)
def test_a_pose_in_space_composed_with_its_inverse_is_the_identity(x, y, z, roll, pitch, yaw):
    pose = Pose3.from_rpy(x, y, z, roll, pitch, yaw)
    assert np.allclose(pose.compose(pose.inverse()).position, 0, atol=1e-9)
    assert np.allclose(pose.compose(pose.inverse()).rotation(), np.eye(3), atol=1e-9)
