"""Tests of slowing down before gaps and curves."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.model.controllers import RegulatedPurePursuit as Spec
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.footprint import distance_at
from simscen.stack.protocols import CostmapView, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot, setting

PERIOD_S, DECELERATION = 0.05, 3.0
ROBOT = round_robot(0.21, speed=2.0, linear_deceleration=DECELERATION)
FAR = Goal("far", Pose2(8.0, 0.0, 0.0))


def view_of(*boxes: tuple[float, float, float, float]) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-3.0, -4.0, 9.0, 4.0))
    return LayeredCostmap(CostmapSpec(), Surroundings(ROBOT, grid, TICK_RATE_HZ)).view


def path_with_bend(radius: float, straight: float = 3.0) -> np.ndarray:
    """Return a path along x, then along a quarter of a circle to the left, and then along y."""
    x, turn = np.arange(0.0, straight, 0.05), np.arange(0.0, math.pi / 2, 0.05 / radius)
    y = np.arange(0.05, 3.0, 0.05)
    return np.vstack((
        np.column_stack((x, 0 * x, 0 * x)),
        np.column_stack((straight + radius * np.sin(turn), radius * (1 - np.cos(turn)), turn)),
        np.column_stack((np.full_like(y, straight + radius), radius + y, np.full_like(y, math.pi / 2))),
    ))  # fmt: skip


def speeds(view: CostmapView, path: np.ndarray, end: float, **options: object) -> list[tuple[float, float]]:
    """Return pairs (x, speed) of a robot that starts with 2 m/s and follows the commands within its deceleration."""
    controller = RegulatedPurePursuit(Spec(desired_linear_vel=2.0, **options), setting(ROBOT))
    controller.set_path(Path(path))
    x, speed, pairs = 0.0, 2.0, list[tuple[float, float]]()
    while x < end:
        command = controller.command(Pose2(x, 0.0, 0.0), Twist(speed), view, FAR).vx
        speed = max(min(command, 2.0), speed - DECELERATION * PERIOD_S)
        x += speed * PERIOD_S
        pairs.append((x, speed))
    return pairs


@pytest.mark.parametrize("half_width", [0.27, 0.32])
def test_speed_in_a_gap_is_limited_by_the_lateral_clearance(half_width: float) -> None:
    view = view_of((2.0, half_width, 2.4, 3.0), (2.0, -3.0, 2.4, -half_width))
    clearance = distance_at(view, 2.2, 0.0)
    limit = min(2.0 * clearance / 0.6, 0.25 + 10.0 * (clearance - 0.21))
    line = np.column_stack((np.arange(0.0, 8.0, 0.05), np.zeros((160, 2))))
    in_gap = [speed for x, speed in speeds(view, line, 2.3) if x > 2.0]
    assert max(in_gap) == pytest.approx(limit, abs=0.1)
    without_slowing_ahead = [speed for x, speed in speeds(view, line, 2.3, slow_down_ahead=False) if x > 2.0]
    assert max(without_slowing_ahead) > max(in_gap) + 0.03
    assert all(speed == 2.0 for x, speed in speeds(view, line, 1.0) if x < 0.8)


def test_speed_is_reduced_before_a_curve() -> None:
    path, free_view = path_with_bend(0.6), view_of()
    options: dict[str, object] = {"regulated_linear_scaling_min_radius": 1.2}
    assert speeds(free_view, path, 3.0, **options)[-1][1] == pytest.approx(1.0, abs=0.2)
    assert speeds(free_view, path, 2.0, slow_down_ahead=False, **options)[-1][1] == 2.0


@pytest.mark.parametrize("radius", [0.5, 0.8, 2.0])
def test_curvature_of_a_circle_is_one_over_its_radius(radius: float) -> None:
    tracker = PathTracker(Path(path_with_bend(radius)))
    tracker.locate(Pose2(0.0, 0.0, 0.0))
    tracker.index = int(np.searchsorted(tracker.path_lengths, 3.2))
    meters, points, curvatures = zip(*tracker.samples_ahead(0.1, radius * math.pi / 2 - 0.6), strict=True)
    assert curvatures == pytest.approx([1.0 / radius] * len(curvatures), rel=0.03)
    assert np.diff(meters) == pytest.approx(0.1, abs=0.051)
    assert [abs(point - complex(3.0, radius)) for point in points] == pytest.approx([radius] * len(points))


def test_samples_of_a_straight_path_have_no_curvature_and_end_at_the_cusp() -> None:
    x = np.concatenate((np.arange(0.0, 1.001, 0.05), np.arange(0.95, 0.19, -0.05)))
    tracker = PathTracker(Path(np.column_stack((x, np.zeros((len(x), 2))))))
    samples = list(tracker.samples_ahead(0.1, 5.0))
    assert samples[-1][0] == pytest.approx(1.0)
    assert all(curvature == 0.0 for _, _, curvature in samples)
