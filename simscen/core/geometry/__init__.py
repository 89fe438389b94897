"""Geometry in the plane and in space: poses, polygons, shapes, meshes, rays, and scripted paths.

Lengths are in meters and angles in radians. Frames follow ROS REP 103.
"""

from simscen.core.geometry.poses import (
    Array,
    Polygon,
    Pose2,
    Pose3,
    Vector,
    forward_and_left,
    rotate_vector,
    wrap,
    wrap_array,
)

__all__ = ["Array", "Polygon", "Pose2", "Pose3", "Vector", "forward_and_left", "rotate_vector", "wrap", "wrap_array"]
