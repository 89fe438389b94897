"""How far things reach."""

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.shapes import Solid
from simscen.worlds.meshing import triangulate


def plan_extents(solid: Solid, frame: Pose3 | None = None) -> Array:
    """The lower left and upper right corner (2, 2) of what a solid covers in plan; `frame` is where it is placed."""
    pose = frame.compose(solid.pose) if frame else solid.pose
    corners = pose.apply(triangulate(solid.shape).vertices)[:, :2]
    return np.stack((corners.min(axis=0), corners.max(axis=0)))
