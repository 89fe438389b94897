"""Tests of searches over poses."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2, wrap
from simscen.stack.planners.pose_search import search_poses

BOUNDS = (-5.0, -5.0, 5.0, 5.0)


def always_free(x, y, yaw):
    return True


@pytest.mark.parametrize("yaw", [math.pi, -math.pi, 0.0])
def test_any_heading_can_be_a_goal(yaw):
    """Headings of OMPL are in [-π, π), and headings of simscen in (-π, π]. For a goal at π, OMPL would wait forever."""
    poses = search_poses("rrt_connect", "reeds_shepp", 0.8, BOUNDS, Pose2(0, 0), Pose2(1, 1, yaw), always_free, 1, 2000)
    assert poses is not None
    assert poses[-1][:2] == pytest.approx((1, 1), abs=1e-6)
    assert wrap(poses[-1].yaw - yaw) == pytest.approx(0, abs=1e-6)


def test_no_search_if_start_or_goal_is_invalid():
    checked = []

    def is_free(x, y, yaw):
        checked.append((x, y, yaw))
        return x < 1

    for start, goal in ((Pose2(0, 0), Pose2(2, 2)), (Pose2(2, 2), Pose2(0, 0)), (Pose2(0, 0), Pose2(9, 0))):
        poses = search_poses("rrt_connect", "reeds_shepp", 0.8, BOUNDS, start, goal, is_free, 1, 20_000)
        assert poses is None
    assert len(checked) <= 6


@pytest.mark.parametrize("space", ["dubins", "reeds_shepp"])
def test_arcs_keep_the_turning_radius_and_only_reeds_shepp_paths_reverse(space):
    poses = search_poses("rrt_connect", space, 0.8, BOUNDS, Pose2(0, 0), Pose2(0, 1, math.pi), always_free, 3, 2000)
    assert poses is not None
    points = np.array(poses)
    step = np.diff(points[:, :2], axis=0)
    turn = np.abs((np.diff(points[:, 2]) + np.pi) % (2 * np.pi) - np.pi)
    chord = 2 * 0.8 * np.sin(np.minimum(turn, 3.0) / 2)
    # Steps in which a segment ends may be shorter.
    assert (np.hypot(step[:, 0], step[:, 1]) >= chord - 1e-3).mean() > 0.95
    forward = step[:, 0] * np.cos(points[:-1, 2]) + step[:, 1] * np.sin(points[:-1, 2])
    assert (forward < -0.01).any() == (space == "reeds_shepp")


@pytest.mark.parametrize("planner", ["rrt_star", "informed_rrt_star"])
def test_improving_planner_stops_before_its_maximum_number_of_iterations(planner: str) -> None:
    checked = list[float]()

    def is_free(x: float, y: float, yaw: float) -> bool:
        checked.append(x)
        return True

    def checks(iterations: int, improving: int) -> int:
        checked.clear()
        poses = search_poses(
            planner, "reeds_shepp", 0.8, BOUNDS, Pose2(0, 0), Pose2(1, 1), is_free, 1, iterations,
            improving_iterations=improving,
        )  # fmt: skip
        assert poses is not None
        return len(checked)

    assert max(checks(100_000, 50), checks(250, 50)) < 0.5 * checks(250, 250)
