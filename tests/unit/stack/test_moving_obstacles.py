"""Tests of the quick check for encounters with moving obstacles."""

import numpy as np
import pytest

from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.rollouts import HORIZON_S, TIMES
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacle, MovingObstacles
from simscen.testing.flatland import round_robot


def test_minimum_distance_bound_holds_for_every_path() -> None:
    rng, times = np.random.default_rng(5), np.linspace(0.0, 3.0, 3001)
    for _ in range(200):
        x, y, vx, vy = rng.normal(0.0, 2.0, 4).tolist()
        here, speed = complex(*rng.normal(0.0, 2.0, 2)), float(rng.uniform(0.0, 3.0))
        thing = MovingObstacle(complex(x, y), complex(vx, vy), 0.3, 0.0, 0.0, 0.0)
        off = np.abs(thing.position + thing.velocity * times - here) - speed * times - 0.3
        assert thing.min_distance(here, speed, 3.0) == pytest.approx(off.min(), abs=2e-3)
    assert MovingObstacle(2 + 0j, 0j, 0.3, 0.0, 0.0, 0.0).min_distance(0j, 0.0, 3.0) == pytest.approx(1.7)
    assert MovingObstacle(0j, -1 + 0j, 0.3, 0.0, 0.0, 0.0).min_distance(0j, 0.0, 3.0) == pytest.approx(-0.3)


def test_arrays_are_unchanged_and_rotate_with_the_frame() -> None:
    spread = np.kron([[[0.1, 0.02], [0.02, 0.4]]], np.eye(2))
    one = MovingObstacles((MovingObstacle(3 + 1j, 1 + 0j, 0.3, 0.1, 0.02, 0.4),), 1.0)
    assert one.covariances == pytest.approx(spread)
    seen = one.in_frame(Pose2(1.0, 1.0, np.pi / 2)).after(2.0)
    assert seen.centers == pytest.approx(np.array([[0.0, -4.0]]))
    assert seen.velocities == pytest.approx(np.array([[0.0, -1.0]]))
    step = np.eye(4) + 2.0 * np.eye(4, k=2)
    noise = np.array([0.5 * 2.0**2, 2.0])  # of position and velocity, by an acceleration of 1 m/s² during 2 s
    assert seen.covariances == pytest.approx(step @ spread @ step.T + np.kron(np.outer(noise, noise), np.eye(2)))
    assert NO_MOVING_OBSTACLES.centers.shape == (0, 2)
    assert NO_MOVING_OBSTACLES.covariances.shape == (0, 4, 4)


def test_quick_check_agrees_with_a_check_of_each_prediction() -> None:
    """Robots that brake, speed up and drive backward, beside a bent path, among things on all sides."""
    rng, robot, clear, off = np.random.default_rng(7), round_robot(), 0, 0
    along = np.linspace(0.0, 5.0, 101)
    for _ in range(300):
        path = FollowedPath(np.column_stack((along, np.sin(along * rng.uniform(0.0, 2.0)))))
        here = Pose2(float(rng.uniform(-0.3, 3.0)), float(rng.uniform(-0.4, 0.4)), float(rng.uniform(-3.0, 3.0)))
        twist, wanted = (Twist(float(rng.uniform(-0.5, 0.5)), 0.0, 0.0) for _ in range(2))
        thing = MovingObstacle(complex(*rng.uniform(-4, 4, 2)), complex(*rng.uniform(-1, 1, 2)), 0.3, 0.01, 0.0, 0.02)
        moving = MovingObstacles((thing,), 1.5)
        place, speed, apart = path.position_over_time(here, twist, wanted, robot)
        way = path.rollouts(here, twist, wanted, (1.0,), robot, with_headings=False)
        assert np.abs(way.x[0] + 1j * way.y[0] - [place(time) for time in TIMES]).max() <= apart + 1e-9
        near = moving.nearness(way.x, way.y, TIMES, 0.22, 0.25)[0].max()
        if moving.is_surely_clear(place, speed, 0.22 + apart, 0.25, HORIZON_S):
            clear += 1
            assert near <= 0.0
        off += near <= 0.0
    assert clear > 0.8 * off > 100
