"""Tests of VFH+: the contract of stacks, and the histogram of the paper."""

import math

import numpy as np
import pytest
from vfh_plus.histogram import WIDTH, Histogram, polar
from vfh_plus.spec import VfhPlus

from simscen.testing import promises_of


@pytest.mark.parametrize("promise", promises_of(VfhPlus()), ids=str)
def test_component_meets_its_contract(promise) -> None:
    promise.check()


def test_an_obstacle_blocks_the_sectors_in_which_the_enlarged_robot_would_hit_it() -> None:
    blocked = np.flatnonzero(polar(np.array([[1.0, 0.0]]), 0.5, 2.0))
    half = math.asin(0.5)
    middles = (blocked + 0.5) * WIDTH
    assert np.abs((middles + math.pi) % (2 * math.pi) - math.pi).max() <= half + WIDTH
    assert len(blocked) == pytest.approx(2 * half / WIDTH, abs=2)


def test_without_obstacles_vfh_drives_to_its_target() -> None:
    assert Histogram().direction(np.empty((0, 2)), 0.3, 1.5, 0.7, 0.0) == 0.7


def test_vfh_passes_an_obstacle_on_the_side_of_its_target() -> None:
    wall = np.column_stack((np.full(21, 0.8), np.linspace(-1.0, 0.3, 21)))
    direction = Histogram().direction(wall, 0.3, 1.5, 0.1, 0.0)
    assert direction is not None
    assert 0.3 < math.remainder(direction, 2 * math.pi) < 2.0


def test_surrounded_robot_has_no_free_direction() -> None:
    angles = np.arange(0, 2 * math.pi, 0.1)
    ring = 0.5 * np.column_stack((np.cos(angles), np.sin(angles)))
    assert Histogram().direction(ring, 0.3, 1.5, 0.0, 0.0) is None
