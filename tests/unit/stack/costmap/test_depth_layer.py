"""Tests of the depth camera layer."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2, Pose3
from simscen.core.messages.sensor_data import Image, Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, round_robot

MOUNT = Pose3(0.1, 0.0, 0.3)
WIDTH, HEIGHT, VIEW = 64, 48, 1.2
FOCAL = WIDTH / 2 / math.tan(VIEW / 2)
Slab = tuple[float, float, float, float, float]
"""Vertical sheet across x: x, minimum y, maximum y, bottom, and top in m."""


def image(*slabs: Slab, base: Pose2 = Pose2(0.0, 0.0)) -> Image:
    """Return the depth image of vertical sheets and of the ground, for a base that faces along x.

    Each pixel is computed by intersecting its ray with the sheets; the costmap does the inverse projection.
    """
    depth = np.full((HEIGHT, WIDTH), np.inf)
    eye = base.x + MOUNT.x, base.y + MOUNT.y, MOUNT.z
    for row in range(HEIGHT):
        for column in range(WIDTH):
            left, up = (WIDTH / 2 - 0.5 - column) / FOCAL, (HEIGHT / 2 - 0.5 - row) / FOCAL
            if up < 0.0:
                depth[row, column] = eye[2] / -up
            for x, low, high, bottom, top in slabs:
                distance = x - eye[0]
                if distance > 0 and low <= eye[1] + left * distance <= high and bottom <= eye[2] + up * distance <= top:
                    depth[row, column] = min(depth[row, column], distance)
    return Image("camera", 0, np.zeros((HEIGHT, WIDTH, 3), np.uint8), depth.astype(np.float32), MOUNT, VIEW)


def costmap(**options: float) -> LayeredCostmap:
    return LayeredCostmap(
        Spec(rolling_size=8.0, track_unknown_space=False, **options), Surroundings(round_robot(), None, TICK_RATE_HZ)
    )


def lethal_points(map_: LayeredCostmap) -> np.ndarray:
    """Return the centers (n, 2) of the lethal cells."""
    view = map_.view
    return (np.argwhere(view.costs == 254)[:, ::-1] + 0.5) * view.resolution + view.origin


LOW_BOX, TABLE_TOP, LAMP = (1.5, -0.3, 0.3, 0.0, 0.12), (1.5, -0.3, 0.3, 0.7, 0.75), (1.5, -0.3, 0.3, 0.5, 0.9)


@pytest.mark.parametrize("slab", [LOW_BOX, (1.5, -0.3, 0.3, 0.5, 0.75)])
def test_obstacles_below_and_above_the_scan_plane_are_marked(slab: Slab) -> None:
    map_ = costmap()
    map_.update(Pose2(0.0, 0.0), image(slab))
    points = lethal_points(map_)
    assert points[:, 0] == pytest.approx(1.5, abs=0.06)
    assert points[:, 1].min() == pytest.approx(-0.3, abs=0.08)
    assert points[:, 1].max() == pytest.approx(0.3, abs=0.08)


def test_ground_and_objects_above_the_robot_are_not_obstacles() -> None:
    map_ = costmap(max_obstacle_height=0.4)
    map_.update(Pose2(0.0, 0.0), image(LAMP))
    assert not len(lethal_points(map_))
    assert len(lethal_points(_update(costmap(max_obstacle_height=1.0), LAMP)))


def _update(map_: LayeredCostmap, *slabs: Slab) -> LayeredCostmap:
    """Update the costmap with an image from the origin, and return the costmap."""
    map_.update(Pose2(0.0, 0.0), image(*slabs))
    return map_


def test_camera_clears_free_space() -> None:
    map_ = _update(costmap(), LOW_BOX)
    assert len(lethal_points(map_))
    assert not len(lethal_points(_update(map_)))


def test_camera_rays_above_a_low_box_do_not_clear_it() -> None:
    wall = (2.2, -1.0, 1.0, 0.0, 2.0)
    map_ = _update(costmap(), LOW_BOX)
    before = {tuple(p) for p in np.round(lethal_points(map_), 3)}
    after = {tuple(p) for p in np.round(lethal_points(_update(map_, LOW_BOX, wall)), 3)}
    assert before <= after
    assert any(x > 2.1 for x, _ in after)


def test_lidar_does_not_clear_obstacles_below_its_plane_that_a_camera_marked() -> None:
    map_ = _update(costmap(), LOW_BOX)
    before = lethal_points(map_)
    no_hits = np.full(360, np.inf)
    map_.update(Pose2(0.0, 0.0), Scan("lidar", 0, no_hits, -math.pi, 2 * math.pi / 360, 0.05, 12.0))
    assert np.array_equal(lethal_points(map_), before)


def test_obstacles_outside_the_camera_view_are_remembered() -> None:
    map_ = _update(costmap(), LOW_BOX)
    before = {tuple(p) for p in np.round(lethal_points(map_), 3)}
    base = Pose2(1.2, 0.6)  # beside the box, which is outside the image; the rolling window has moved
    map_.update(base, image(base=base))
    assert before == {tuple(p) for p in np.round(lethal_points(map_), 3)}
