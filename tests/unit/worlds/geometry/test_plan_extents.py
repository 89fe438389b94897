import math

import numpy as np
import pytest

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.worlds.geometry.prisms import mesh_bounds_2d


def test_extents_follow_the_pose_of_solid_and_frame():
    solid = Solid(Box((2.0, 1.0, 1.0)), Pose3(x=1.0))
    assert mesh_bounds_2d(solid) == pytest.approx(np.array([[0, -0.5], [2, 0.5]]))
    turned = Pose3.from_rpy(10, 0, 0, 0, 0, math.pi / 2)
    assert mesh_bounds_2d(solid, turned) == pytest.approx(np.array([[9.5, 0], [10.5, 2]]))
