"""Distances between polygons against shapely."""

import numpy as np
import pytest
import shapely
import shapely.affinity

from simscen.criteria.keepout import _distances


def random_polygon(chance, size):
    angles = np.sort(chance.uniform(0, 2 * np.pi, 6))
    radii = chance.uniform(0.4, 1.0, 6) * size
    return np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))


def test_polygons_apart_are_as_far_apart_as_shapely_says():
    chance = np.random.default_rng(3)
    checked = 0
    for _ in range(40):
        hull, region = random_polygon(chance, 0.5), random_polygon(chance, 2.0)
        poses = np.column_stack((chance.uniform(-4, 4, (20, 2)), chance.uniform(-3, 3, 20)))
        found = _distances(poses, hull, region)
        for (x, y, yaw), distance in zip(poses, found, strict=True):
            moved = shapely.affinity.rotate(shapely.Polygon(hull), yaw, origin=(0, 0), use_radians=True)
            moved = shapely.affinity.translate(moved, x, y)
            expected = moved.distance(shapely.Polygon(region))
            if expected > 0:
                checked += 1
                assert distance == pytest.approx(expected, abs=1e-9)
            elif moved.within(shapely.Polygon(region)):
                assert distance < 0
    assert checked > 200
