"""Tests of predicted moving obstacles, and of the quick check that a path is clear of them."""

import numpy as np
import pytest

from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.rollouts import HORIZON_S, TIMES
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacle, MovingObstacles
from simscen.testing.flatland import round_robot


def test_min_distance_is_the_smallest_distance_that_the_robot_can_reach_in_any_direction() -> None:
    rng, times = np.random.default_rng(5), np.linspace(0.0, 3.0, 3001)
    for _ in range(200):
        x, y, vx, vy = rng.normal(0.0, 2.0, 4).tolist()
        start, speed = complex(*rng.normal(0.0, 2.0, 2)), float(rng.uniform(0.0, 3.0))
        obstacle = MovingObstacle(complex(x, y), complex(vx, vy), 0.3, 0.0, 0.0, 0.0)
        distances = np.abs(obstacle.position + obstacle.velocity * times - start) - speed * times - 0.3
        assert obstacle.min_distance(start, speed, 3.0) == pytest.approx(distances.min(), abs=2e-3)
    assert MovingObstacle(2 + 0j, 0j, 0.3, 0.0, 0.0, 0.0).min_distance(0j, 0.0, 3.0) == pytest.approx(1.7)
    assert MovingObstacle(0j, -1 + 0j, 0.3, 0.0, 0.0, 0.0).min_distance(0j, 0.0, 3.0) == pytest.approx(-0.3)


def test_predicted_states_and_covariances_are_in_the_given_frame() -> None:
    covariance = np.kron([[[0.1, 0.02], [0.02, 0.4]]], np.eye(2))
    moving = MovingObstacles((MovingObstacle(3 + 1j, 1 + 0j, 0.3, 0.1, 0.02, 0.4),), 1.0)
    assert moving.covariances == pytest.approx(covariance)
    predicted = moving.in_frame(Pose2(1.0, 1.0, np.pi / 2)).after(2.0)
    assert predicted.centers == pytest.approx(np.array([[0.0, -4.0]]))
    assert predicted.velocities == pytest.approx(np.array([[0.0, -1.0]]))
    step = np.eye(4) + 2.0 * np.eye(4, k=2)
    noise = np.array([0.5 * 2.0**2, 2.0])  # change of position and velocity by 1 m/s² in 2 s
    assert predicted.covariances == pytest.approx(
        step @ covariance @ step.T + np.kron(np.outer(noise, noise), np.eye(2))
    )
    assert NO_MOVING_OBSTACLES.centers.shape == (0, 2)
    assert NO_MOVING_OBSTACLES.covariances.shape == (0, 4, 4)


def test_quick_check_finds_most_clear_paths_and_no_others() -> None:
    """The robots brake, accelerate, or drive backward next to a winding path, with obstacles on all sides."""
    rng, robot, surely_clear_count, clear_count = np.random.default_rng(7), round_robot(), 0, 0
    x = np.linspace(0.0, 5.0, 101)
    for _ in range(300):
        path = FollowedPath(np.column_stack((x, np.sin(x * rng.uniform(0.0, 2.0)))))
        pose = Pose2(float(rng.uniform(-0.3, 3.0)), float(rng.uniform(-0.4, 0.4)), float(rng.uniform(-3.0, 3.0)))
        twist, command = (Twist(float(rng.uniform(-0.5, 0.5)), 0.0, 0.0) for _ in range(2))
        obstacle = MovingObstacle(
            complex(*rng.uniform(-4, 4, 2)), complex(*rng.uniform(-1, 1, 2)), 0.3, 0.01, 0.0, 0.02
        )
        moving = MovingObstacles((obstacle,), 1.5)
        position, speed, deviation = path.position_over_time(pose, twist, command, robot)
        rollouts = path.rollouts(pose, twist, command, (1.0,), robot, with_headings=False)
        assert np.abs(rollouts.x[0] + 1j * rollouts.y[0] - [position(time) for time in TIMES]).max() <= deviation + 1e-9
        cost = moving.nearness(rollouts.x, rollouts.y, TIMES, 0.22, 0.25)[0].max()
        if moving.is_surely_clear(position, speed, 0.22 + deviation, 0.25, HORIZON_S):
            surely_clear_count += 1
            assert cost <= 0.0
        clear_count += cost <= 0.0
    assert surely_clear_count > 0.8 * clear_count > 100
