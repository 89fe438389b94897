"""Tests of ground detection with a depth camera."""

import math
from itertools import pairwise

import numpy as np
import pytest

from simscen.core.geometry import Pose2, Pose3
from simscen.core.messages.sensor_data import Image
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, round_robot

WIDTH, HEIGHT, VIEW = 64, 48, 1.2
FOCAL = WIDTH / 2 / math.tan(VIEW / 2)
LEVEL, TILTED = Pose3(0.2, 0.0, 0.45), Pose3.from_rpy(0.1, 0.05, 0.8, 0.0, 0.5, 0.2)
Ground = tuple[tuple[float, float], ...]
"""Corners (x, z) in m of the profile of the ground along x; vertical between two corners with the same x."""


def image(ground: Ground, mount: Pose3) -> Image:
    """Return the depth image of the ground: each pixel is the first intersection of its ray with the profile."""
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    left, up = (WIDTH / 2 - 0.5 - column) / FOCAL, (HEIGHT / 2 - 0.5 - row) / FOCAL
    rays = np.dstack((np.ones_like(left), left, up)).reshape(-1, 3) @ mount.rotation().T
    depth = np.full(len(rays), np.inf)
    for (x1, z1), (x2, z2) in pairwise(ground):
        normal = np.array([z1 - z2, 0.0, x2 - x1])
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (np.array([x1, 0.0, z1]) - np.array(mount.position)) @ normal / (rays @ normal)
            hit = np.array(mount.position) + distance[:, None] * rays
        progress = (hit[:, 0] - x1) * (x2 - x1) + (hit[:, 2] - z1) * (z2 - z1)
        is_hit = (distance > 0) & (progress >= 0) & (progress <= (x2 - x1) ** 2 + (z2 - z1) ** 2)
        depth = np.where(is_hit & (distance < depth), distance, depth)
    depth_image = depth.reshape(HEIGHT, WIDTH).astype(np.float32)
    return Image("camera", 0, np.zeros((HEIGHT, WIDTH, 3), np.uint8), depth_image, mount, VIEW)


def marked_x(ground: Ground, mount: Pose3, **options: float) -> np.ndarray:
    """Return the x coordinates (n,) of the lethal cells near the x axis."""
    spec = Spec(rolling_size=8.0, track_unknown_space=False, **options)
    map_ = LayeredCostmap(spec, Surroundings(round_robot(), None, TICK_RATE_HZ))
    map_.update(Pose2(0.0, 0.0), image(ground, mount))
    view = map_.view
    points = (np.argwhere(view.costs == 254)[:, ::-1] + 0.5) * view.resolution + view.origin
    return points[np.abs(points[:, 1]) < 0.3][:, 0]


def ramp(degrees: float, start: float, height: float = 0.3) -> Ground:
    """Return level ground with a ramp from x = `start` up to `height`."""
    top = start + height / math.tan(math.radians(degrees))
    return ((-1.0, 0.0), (start, 0.0), (top, height), (9.0, height))


@pytest.mark.parametrize("mount", [LEVEL, TILTED], ids=["level", "tilted"])
@pytest.mark.parametrize("degrees", [2, 5, 8])
@pytest.mark.parametrize("start", [0.4, 1.5])
def test_a_ramp_ahead_is_ground(mount: Pose3, degrees: float, start: float) -> None:
    assert not len(marked_x(ramp(degrees, start), mount))


@pytest.mark.parametrize("mount", [LEVEL, TILTED], ids=["level", "tilted"])
def test_rising_ground_at_the_end_of_a_slope_is_ground(mount: Pose3) -> None:
    """In the frame of a robot that drives down a slope, the level ground at its end rises.

    In the frame of a robot that drives up, the level ground falls.
    """
    assert not len(marked_x(((-1.0, 0.0), (0.8, 0.0), (9.0, 8.2 * math.tan(0.14))), mount))
    assert not len(marked_x(((-1.0, 0.0), (0.8, 0.0), (9.0, -8.2 * math.tan(0.14))), mount))


def ground_of_pitched_robot(degrees: float, down: float) -> Ground:
    """Return the profile in the frame of a robot that is pitched down by `degrees`.

    The ground descends by `down` degrees for one meter, and is level from there on.
    """
    pitch = math.radians(degrees)
    height = math.tan(pitch - math.radians(down))
    return ((-1.0, 0.0), (0.0, 0.0), (1.0, height), (9.0, height + 8.0 * math.tan(pitch)))


@pytest.mark.parametrize("mount", [LEVEL, TILTED], ids=["level", "tilted"])
def test_pitch_of_the_robot_counts_as_slope(mount: Pose3) -> None:
    """The allowed slope of 0.2 rad is 11.5°: a pitch of 8° is below the limit, and a pitch of 16° is above."""
    for down in (0.0, 8.0):
        assert not len(marked_x(ground_of_pitched_robot(8.0, down), mount))
        assert len(marked_x(ground_of_pitched_robot(16.0, down), mount))
    assert not len(marked_x(ground_of_pitched_robot(16.0, 8.0), mount, max_ground_slope=0.32))


@pytest.mark.parametrize("mount", [LEVEL, TILTED], ids=["level", "tilted"])
@pytest.mark.parametrize("distance", [0.8, 1.3])
@pytest.mark.parametrize("height", [0.1, 0.15])
def test_curb_is_an_obstacle_with_level_ground_behind_it(mount: Pose3, distance: float, height: float) -> None:
    marked = marked_x(((-1.0, 0.0), (distance, 0.0), (distance, height), (9.0, height)), mount)
    # The level camera sees no ground nearer than 1.1 m.
    assert distance - 0.06 < marked.min() < distance + 0.15


def test_object_on_a_ramp_or_steep_surface_is_an_obstacle() -> None:
    up = math.tan(math.radians(6))
    box = ((-1.0, 0.0), (0.4, 0.0), (1.4, up), (1.4, up + 0.15), (1.7, up + 0.15), (1.7, 1.3 * up), (3.0, 2.6 * up))
    marked = marked_x(box, LEVEL)
    assert marked.min() == pytest.approx(1.4, abs=0.06)
    assert len(marked_x(ramp(20, 0.8), LEVEL))


def test_without_slope_parameter_all_higher_points_are_marked_as_in_nav2() -> None:
    assert len(marked_x(ramp(5, 1.0), LEVEL, max_ground_slope=0.0))


def test_short_ramp_seen_from_afar_remains_ground_below_the_minimum_range() -> None:
    """The same ramp is an obstacle if the camera has never seen it from a greater distance."""
    map_ = LayeredCostmap(
        Spec(rolling_size=8.0, track_unknown_space=False), Surroundings(round_robot(), None, TICK_RATE_HZ)
    )
    for distance in (1.5, 1.0, 0.5, 0.3):
        map_.update(Pose2(1.5 - distance, 0.0), image(ramp(8, distance, 0.08), LEVEL))
        assert not (map_.view.costs == 254).any()
    assert len(marked_x(ramp(8, 0.3, 0.08), LEVEL))


def test_box_whose_base_is_below_the_image_is_an_obstacle() -> None:
    box = ((-1.0, 0.0), (0.95, 0.0), (0.95, 0.13), (1.05, 0.13), (1.05, 0.0), (9.0, 0.0))
    marked = marked_x(box, LEVEL)
    assert marked.min() == pytest.approx(0.95, abs=0.06)
