"""How far things reach."""

from __future__ import annotations

import numpy as np

from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Solid
from simscen.worlds.upright import upright


def rectangle(solid: Solid, frame: Pose3 | None = None) -> tuple[float, float, float, float]:
    """What a solid covers in plan at most, as (min x, min y, max x, max y); `frame` is where it is placed."""
    prism = upright(solid, frame)
    if prism is not None:
        return prism.rectangle
    (left, low), (right, high) = plan_extents(solid, frame).tolist()
    return left, low, right, high


def plan_extents(solid: Solid, frame: Pose3 | None = None) -> Array:
    """The lower left and upper right corner (2, 2) of what any solid covers in plan; `frame` is where it is placed."""
    from simscen.worlds.meshing import triangulate

    pose = frame.compose(solid.pose) if frame else solid.pose
    corners = pose.apply(triangulate(solid.shape).vertices)[:, :2]
    return np.stack((corners.min(axis=0), corners.max(axis=0)))
